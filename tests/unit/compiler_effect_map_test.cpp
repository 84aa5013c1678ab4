// Displacement maps and ramps, from noise and from pictures.
#include <gtest/gtest.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "effect/bc4.h"
#include "effect/noise_map.h"
#include "effect_document.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::bake;
using tests::readDocument;
using tests::smallest;
namespace fs = std::filesystem;

TEST(EffectMaps, Bc4IsNearItsTexels) {
  std::uint32_t state = 1;
  for (int round = 0; round < 2000; ++round) {
    std::array<std::uint8_t, 16> texels{};
    const std::uint32_t base = state >> 24, span = round % 5 == 0 ? 0 : state >> 12 & 127;
    for (std::uint8_t& texel : texels) {
      state = state * 1664525 + 1013904223;
      texel = static_cast<std::uint8_t>(std::min(255u, base + (span == 0 ? 0 : (state >> 16) % (span + 1))));
    }
    const auto [least, most] = std::minmax_element(texels.begin(), texels.end());
    const float bound = (static_cast<float>(*most - *least) / 14 + (span == 0 ? 0 : 4.01f)) / 255;
    std::array<float, 16> decoded{};
    format::decodeBc4(encodeBc4(texels), decoded);
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(decoded[i], static_cast<float>(texels[i]) / 255, bound + 1e-6f);
  }
}

TEST(EffectMaps, NoiseFillsItsRangeAndIsTheSameEverywhere) {
  std::uint64_t hash = 0;
  for (const NoiseKind kind : {NoiseKind::fbm, NoiseKind::ridged, NoiseKind::worley}) {
    NoiseMap noise;
    noise.kind = kind;
    noise.frames = kind == NoiseKind::fbm ? 6 : 1;
    const auto maps = makeNoiseMaps(noise);
    ASSERT_EQ(maps.size(), noise.frames);
    float least = 1, most = 0;
    for (const format::CubeMap& map : maps) {
      const format::DecodedCube cube(map);
      for (std::uint32_t t = 0; t < 6 * 64 * 64; ++t) {
        const float value = cube.texel(t / 4096, t % 64, t / 64 % 64);
        least = std::min(least, value);
        most = std::max(most, value);
      }
      hash = XXH3_64bits_withSeed(map.blocks.data(), map.blocks.size(), hash);
    }
    EXPECT_LT(least, 0.02f);
    EXPECT_GT(most, 0.98f);
  }
  EXPECT_EQ(hash, 13903595054640316176u);
}

// ---- Pictures

template <class T>
void put(std::string& text, T value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void attribute(std::string& text, const std::string& name, const std::string& type, const std::string& value) {
  text += name + '\0' + type + '\0';
  put(text, static_cast<std::int32_t>(value.size()));
  text += value;
}

// The simplest EXR: one channel of floats, not compressed.
std::string exrBytes(std::int32_t width, std::int32_t height, const std::vector<float>& values) {
  const auto numbers = [](auto... all) {
    std::string text;
    (put(text, all), ...);
    return text;
  };
  std::string text = numbers(20000630, 2);
  const std::string channel = std::string("Y") + '\0' + numbers(2, 0, 1, 1) + '\0';  // type float, linear, every pixel
  attribute(text, "channels", "chlist", channel);
  attribute(text, "compression", "compression", std::string(1, '\0'));
  attribute(text, "dataWindow", "box2i", numbers(0, 0, width - 1, height - 1));
  attribute(text, "displayWindow", "box2i", numbers(0, 0, width - 1, height - 1));
  attribute(text, "lineOrder", "lineOrder", std::string(1, '\0'));
  attribute(text, "pixelAspectRatio", "float", numbers(1.0f));
  attribute(text, "screenWindowCenter", "v2f", numbers(0.0f, 0.0f));
  attribute(text, "screenWindowWidth", "float", numbers(1.0f));
  text += '\0';
  const std::size_t line = 8 + static_cast<std::size_t>(width) * 4;
  const std::size_t first = text.size() + static_cast<std::size_t>(height) * 8;
  for (std::int32_t y = 0; y < height; ++y)
    put(text, static_cast<std::uint64_t>(first + line * static_cast<std::size_t>(y)));
  for (std::int32_t y = 0; y < height; ++y) {
    text += numbers(y, width * 4);
    for (std::int32_t x = 0; x < width; ++x) put(text, values[static_cast<std::size_t>(y * width + x)]);
  }
  return text;
}

class Picture {
 public:
  explicit Picture(const std::string& bytes, const std::string& extension = ".exr")
      : name_("billow_" + std::to_string(::getpid()) + extension) {
    std::ofstream(fs::temp_directory_path() / name_, std::ios::binary) << bytes;
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;
  ~Picture() { fs::remove(fs::temp_directory_path() / name_); }
  const std::string& name() const { return name_; }

 private:
  std::string name_;  // relative to the description's folder
};

TEST(EffectPictures, DisplaceInTheirDirections) {
  std::vector<float> values(16 * 8);
  for (const std::size_t row : {3u, 4u}) values[row * 16 + 11] = values[row * 16 + 12] = 5;  // about +X
  const Picture picture(exrBytes(16, 8, values));
  json document = smallest();
  document["emitters"][0]["primitive"]["displacement"] = {{"amount", 0.5}, {"picture", picture.name()}};
  const format::PackTables tables = bake(document);
  ASSERT_EQ(tables.effects.maps.size(), 1u);
  const format::DecodedCube cube(tables.effects.maps[0]);
  EXPECT_NEAR(cube.sample({1, 0, 0}), 1, 0.02f);
  EXPECT_NEAR(cube.sample({1, 0.05f, -0.05f}), 1, 0.02f);
  for (const std::array<float, 3>& direction :
       {std::array<float, 3>{-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
    EXPECT_NEAR(cube.sample(direction), 0, 0.02f);
  }
}

TEST(EffectPictures, AreRamps) {
  const Picture picture(exrBytes(2, 2, {0, 1, 0, 0}));
  json document = smallest();
  document["emitters"][0]["primitive"]["diffuse"] = {{"ramp", picture.name()}};
  const format::PackTables tables = bake(document);
  const format::RampTable& ramp = tables.effects.ramps.at(0);
  EXPECT_EQ(ramp.values[0][0][0], 0);
  EXPECT_EQ(ramp.values[0][31][1], 1);
  EXPECT_EQ(ramp.values[15][31][2], 0);
}

TEST(EffectPictures, BrokenOnesAreNamed) {
  const std::string sound = exrBytes(4, 4, std::vector<float>(16, 1));
  const auto refuse = [](const std::string& name, const std::string& expected, Fault fault) {
    json document = smallest();
    document["emitters"][0]["primitive"]["displacement"] = {{"amount", 0.5}, {"picture", name}};
    try {
      readDocument(document);
      ADD_FAILURE() << name << " passed; expected " << expected;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), fault);
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  };
  refuse("nowhere.exr", "nowhere.exr", Fault::file);
  const Picture jpg("text", ".jpg"), png("text", ".png");
  refuse(jpg.name(), "*.exr or *.png", Fault::input);
  refuse(png.name(), "not a PNG", Fault::input);
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{40}, sound.size() / 2, sound.size() - 5}) {
    const Picture cut(sound.substr(0, size));
    refuse(cut.name(), "not a usable EXR", Fault::input);
  }
  const Picture infinite(exrBytes(1, 1, {std::numeric_limits<float>::infinity()}));
  refuse(infinite.name(), "pixel 0,0 is inf", Fault::input);
  std::string huge = sound;  // the data window says 30000 x 30000
  const std::size_t window = huge.find("box2i") + 6 + 4 + 8;
  const std::int32_t edge = 30000;
  for (const std::size_t at : {window, window + 4}) std::memcpy(huge.data() + at, &edge, 4);
  const Picture large(huge);
  refuse(large.name(), large.name(), Fault::input);
}

}  // namespace
}  // namespace billow
