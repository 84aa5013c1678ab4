// PLY files as particles.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "import/points.h"
#include "ply_file.h"
#include "point_attributes.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using tests::PlyColumn;
using tests::plyText;

PointFrame read(const std::string& text, const PointAttributes& attributes = tests::usualAttributes(),
                std::uint32_t most = 100) {
  return readPly(std::as_bytes(std::span(text)), "test.ply", attributes, most);
}

std::string errorOf(const std::string& text, const PointAttributes& attributes = tests::usualAttributes()) {
  try {
    read(text, attributes);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    return error.what();
  }
  return "";
}

std::vector<PlyColumn> columns() {
  return {{"double", "z", {3, 6.5, -9}},   {"float", "x", {1, 4, 7.25}},     {"int16", "unknown", {-5, 0, 5}},
          {"float32", "y", {2, 5, -1e-3}}, {"uint", "id", {4e9, 12, 0}},     {"double", "radius", {0.5, 0.25, 2}},
          {"uchar", "red", {0, 255, 188}}, {"uchar", "green", {10, 128, 0}}, {"uchar", "blue", {0, 0, 1}},
          {"char", "age", {1, 2, 3}},      {"ushort", "life", {9, 8, 7}}};
}

class PlyEncodings : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, PlyEncodings, testing::Values("ascii", "binary_little_endian", "binary_big_endian"));

TEST_P(PlyEncodings, GiveTheSameParticles) {
  for (const bool lists : {false, true}) {
    const PointFrame frame = read(plyText(GetParam(), columns(), lists));
    EXPECT_TRUE(frame.ordered);
    EXPECT_EQ(frame.places, (std::vector<std::array<float, 3>>{{1, 2, 3}, {4, 5, 6.5f}, {7.25f, -1e-3f, -9}}));
    EXPECT_EQ(frame.ids, (std::vector<std::int64_t>{4000000000, 12, 0}));
    EXPECT_EQ(frame.radii, (std::vector<float>{0.5f, 0.25f, 2}));
    EXPECT_EQ(frame.ages, (std::vector<float>{1, 2, 3}));
    EXPECT_EQ(frame.lives, (std::vector<float>{9, 8, 7}));
    ASSERT_EQ(frame.colours.size(), 3u);
    EXPECT_EQ(frame.colours[1][0], 1);
    EXPECT_NEAR(frame.colours[1][1], 0.2158605f, 1e-6f);  // 128 of 255 in sRGB
    EXPECT_NEAR(frame.colours[0][1], 10 / 255.0 / 12.92, 1e-8);
    EXPECT_NEAR(frame.colours[2][0], std::pow((188 / 255.0 + 0.055) / 1.055, 2.4), 1e-7);
  }
}

TEST_P(PlyEncodings, EndTooEarlyAtAnyByte) {
  const std::string text = plyText(GetParam(), columns(), true);
  const std::size_t tail = std::string(GetParam()) == "ascii" ? 6 : 4;  // the last element is not read
  EXPECT_EQ(errorOf(text.substr(0, text.size() - tail)), "");
  for (std::size_t size = 0; size + tail < text.size(); ++size) {
    // Exact sizes, so that a sanitizer sees what is read behind the end. Half a number in text may be a number.
    const std::string part = text.substr(0, size);
    const std::string error = errorOf(part);
    if (tail == 6 && size + tail + 3 > text.size()) continue;
    EXPECT_NE(error.find("test.ply: "), std::string::npos) << size;
  }
}

TEST(Ply, ColoursHaveManyNames) {
  for (const char* end : {"_r", ".x", "0", "[0]"}) {
    std::vector<PlyColumn> all = {{"float", "x", {1}}, {"float", "y", {1}}, {"float", "z", {1}}};
    std::string names[3] = {end, end, end};
    for (std::size_t c = 0; c < 3; ++c) {
      for (char& letter : names[c]) {
        if (letter == '0') letter = static_cast<char>('0' + c);
        if (letter == 'x') letter = static_cast<char>('x' + c);
        if (letter == 'r') letter = "rgb"[c];
      }
      all.push_back({"float", "Cd" + names[c], {0.25 * static_cast<double>(c)}});
    }
    const PointFrame frame = read(plyText("ascii", all));
    ASSERT_EQ(frame.colours.size(), 1u) << end;
    EXPECT_EQ(frame.colours[0], (std::array<float, 3>{0, 0.25f, 0.5f}));
  }
}

TEST(Ply, WhatIsNotThereIsSaid) {
  PointAttributes attributes = tests::usualAttributes();
  attributes.radius = {{"size"}, true};
  const std::string error = errorOf(plyText("ascii", columns()), attributes);
  EXPECT_NE(error.find("no attribute 'size' of a fitting type; there is: z, x, unknown"), std::string::npos) << error;
  attributes = tests::usualAttributes();
  attributes.colour = {{"paint"}, true};
  EXPECT_NE(errorOf(plyText("ascii", columns()), attributes).find("'paint'"), std::string::npos);
  std::vector<PlyColumn> flat = columns();
  flat.erase(flat.begin());
  EXPECT_NE(errorOf(plyText("ascii", flat)).find("no properties x, y and z"), std::string::npos);
}

TEST(Ply, NumbersMayBeAnything) {
  const auto place = [](const char* number) {
    return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
           "end_header\n0 " +
           std::string(number) + " 0\n";
  };
  EXPECT_TRUE(std::isnan(read(place("nan")).places[0][1]));
  EXPECT_TRUE(std::isinf(read(place("-inf")).places[0][1]));
  EXPECT_TRUE(std::isinf(read(place("1e999")).places[0][1]));
  EXPECT_TRUE(std::isinf(read(place("1e300")).places[0][1]));
  EXPECT_EQ(read(place("+2.5e1")).places[0][1], 25);
  for (const char* wrong : {"x", "1,5", "--1", "0x10", "+"}) {
    EXPECT_NE(errorOf(place(wrong)).find("no number"), std::string::npos) << wrong;
  }
  std::vector<PlyColumn> broken = columns();
  broken[4] = {"float", "id", {1, 2.5, 3}};
  EXPECT_NE(errorOf(plyText("binary_big_endian", broken)).find("particle 1: an id of 2.5"), std::string::npos);
}

TEST(Ply, HeadersAreNotBelieved) {
  const std::string head = "ply\nformat binary_little_endian 1.0\n";
  const std::string place = "property float x\nproperty float y\nproperty float z\n";
  const std::pair<std::string, std::string> cases[] = {
      {"", "not a PLY file"},
      {"solid\n", "not a PLY file"},
      {"ply\nformat ascii 2.0\n", "its format is 'ascii 2.0'"},
      {head, "its header does not end"},
      {head + "element vertex 12345678901234567890123\n", "has a count of"},
      {head + "element vertex -1\n", "has a count of '-1'"},
      {head + "element vertex 4000000000\n" + place + "end_header\n", "4000000000 particles; expected at most 100"},
      {head + "element vertex 100\n" + place + "end_header\n", "the file ends before its values"},
      {head + "element a 18446744073709551615\nproperty double p\nelement vertex 1\n" + place + "end_header\n",
       "the file ends before its values"},
      {head + "element a 18446744073709551615\nproperty list char double p\nend_header\n\xff\xff", "negative count"},
      {head + "element a 4294967295\nproperty list uint double p\nend_header\n\xff\xff\xff\xff", "the file ends"},
      {head + "property float x\n", "before the first element"},
      {head + "element vertex 1\nproperty quad x\n", "unknown type 'quad'"},
      {head + "element vertex 1\nproperty float x\nproperty int x\n", "two named 'x'"},
      {head + "element vertex 1\nproperty list float int x\n", "count is no integer"},
      {head + "element a 9\nend_header\n", "no element 'vertex'"},
      {head + "nonsense\n", "line 3 of its header begins with 'nonsense'"},
      {head + std::string(5000, 'c') + "\n", "its header does not end"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string error = errorOf(text);
    EXPECT_NE(error.find(expected), std::string::npos) << error << "\n" << text;
  }
  std::string many = head;
  for (int i = 0; i < 65; ++i) many += "element e" + std::to_string(i) + " 0\n";
  EXPECT_NE(errorOf(many).find("more than 64 elements"), std::string::npos);
}

}  // namespace
}  // namespace billow
