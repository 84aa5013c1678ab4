// `billow render` as a user meets it: pictures, their names, and what is refused.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "run_command.h"
#include "sample_pack.h"

namespace billow::tests {
namespace {

void writeFile(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// Some bricks of smoke with fire in the middle of them: two frames, 7 and 8, the second with more of it.
std::vector<std::byte> smallFire() {
  return writePack({}, [](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("fire", {"density", "flames"}, 2);
    for (std::uint32_t frame = 0; frame < 2; ++frame) {
      GridFrameBuilder smoke(writer, 0), flames(writer, 0);
      for (std::uint32_t i = 0; i < 12 + frame * 6; ++i) {
        const std::array<std::uint32_t, 3> cell{10 + i % 3, 10 + i / 3 % 2, 10 + i / 6};
        smoke.brick(cell, i % 2 == 0 ? format::kEncodingBc7Z : format::kEncodingUniform8,
                    randomBytes(i % 2 == 0 ? 128 : 512, i), 0, 0.004f, format::kMaskAll);
        if (i % 3 == 1) {
          flames.brick(cell, format::localEncoding(3), randomBytes(224, i), 0, 0.0003f, format::kMaskAll);
        }
      }
      tables.gridFrames.push_back(smoke.finish(tables));
      tables.gridFrames.push_back(flames.finish(tables));
    }
    return tables;
  });
}

std::string samplePackIn(const TempFolder& folder) {
  const std::vector<std::byte> bytes = smallFire();
  writeFile(folder / "p.blw", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return folder / "p.blw";
}

std::uint32_t bigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
  return value;
}

class Render : public testing::Test {
 protected:
  CommandResult render(const std::string& arguments, const std::string& prefix = "") {
    return billow("render " + arguments, prefix);
  }
  void expectRefused(const std::string& arguments, int code, const std::string& named) {
    const std::size_t before = folder_.fileCount();
    const CommandResult result = render(arguments);
    EXPECT_EQ(result.code, code) << arguments << "\n" << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << arguments << "\n" << result.err;
    EXPECT_EQ(folder_.fileCount(), before) << "something was written by " << arguments;
  }
  void expectSceneRefused(const std::string& scene, const std::string& named) {
    writeFile(folder_ / "scene.json", scene);
    expectRefused("'" + (folder_ / "scene.json") + "' --frame 7 -o '" + (folder_ / "x.png") + "'", 3, named);
  }

  TempFolder folder_;
  std::string pack_ = samplePackIn(folder_);
};

TEST_F(Render, WritesPngOfTheSizeAskedFor) {
  const CommandResult result = render("'" + pack_ + "' --frame 7 --size 40x24 -o '" + (folder_ / "a.png") + "'");
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string png = readFile(folder_ / "a.png");
  ASSERT_GT(png.size(), 100u);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_EQ(bigEndian(png, 16), 40u);
  EXPECT_EQ(bigEndian(png, 20), 24u);
  EXPECT_EQ(folder_.fileCount(), 2u) << "no unfinished file is left";
}

TEST_F(Render, WritesExrWithColourAndDepth) {
  const CommandResult result = render("'" + pack_ + "' --frame 7 --size 40x24 -o '" + (folder_ / "a.exr") + "'");
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string exr = readFile(folder_ / "a.exr");
  EXPECT_EQ(exr.substr(0, 4), std::string("\x76\x2f\x31\x01"));
  // Channel list: name, zero, pixel type (1 half, 2 float).
  for (const char* channel : {"A", "B", "G", "R"}) {
    EXPECT_NE(exr.find(std::string(channel) + std::string("\0\1\0\0\0", 5)), std::string::npos) << channel;
  }
  EXPECT_NE(exr.find(std::string("Z\0\2\0\0\0", 6)), std::string::npos);
}

TEST_F(Render, NumbersAFrameRangeAndRepeatsItself) {
  const std::string options = "'" + pack_ + "' --frame 7-8 --size 32x18 -o '";
  ASSERT_EQ(render(options + (folder_ / "s.png") + "'").code, 0);
  const std::string first = readFile(folder_ / "s_0007.png");
  EXPECT_NE(first, readFile(folder_ / "s_0008.png"));
  ASSERT_EQ(render(options + (folder_ / "t.png") + "'").code, 0);
  EXPECT_EQ(first, readFile(folder_ / "t_0007.png"));
  ASSERT_EQ(render("'" + pack_ + "' --frame 7 --size 32x18 -o '" + (folder_ / "one.png") + "'").code, 0);
  EXPECT_EQ(first, readFile(folder_ / "one.png")) << "a frame alone and within a range are one picture";
}

TEST_F(Render, OptionsChangeThePicture) {
  std::set<std::string> pictures;
  const std::vector<std::string> variants = {"",
                                             "--density 0.2",
                                             "--fire 0",
                                             "--sun 0,0,-1",
                                             "--exposure 2",
                                             "--filter nearest",
                                             "--background 0,1,0",
                                             "--fov 60",
                                             "--up y",
                                             "--flames none",
                                             "--camera 14,16,13:9,9,9:40",
                                             "--ambient 5,0,0"};
  for (const std::string& variant : variants) {
    const CommandResult result =
        render("'" + pack_ + "' --frame 7 --size 64x36 " + variant + " -o '" + (folder_ / "v.png") + "'");
    ASSERT_EQ(result.code, 0) << variant << "\n" << result.err;
    EXPECT_TRUE(pictures.insert(readFile(folder_ / "v.png")).second) << variant << " changes nothing";
  }
}

TEST_F(Render, ScenesSayWhatTheCommandLineSays) {
  writeFile(folder_ / "scene.json",
            R"({// comments are allowed
                "pack": "p.blw", "size": [32, 18], "sun": {"direction": [0, 1, 1], "intensity": 4}, "exposure": 1,
                "camera": {"eye": [14, 16, 13], "target": [9, 9, 9], "fieldOfView": 40, "up": "y"},
                "background": {"bottom": [0, 0, 0], "top": [0, 0, 1]}, "look": {"density": 2}, "filter": "nearest"})");
  ASSERT_EQ(render("'" + (folder_ / "scene.json") + "' --frame 7 -o '" + (folder_ / "a.png") + "'").code, 0);
  ASSERT_EQ(render("'" + pack_ +
                   "' --frame 7 --size 32x18 --sun 0,1,1 --sun-intensity 4 --exposure 1 --up y --density 2 "
                   "--camera 14,16,13:9,9,9:40 --background 0,0,0:0,0,1 --filter nearest -o '" +
                   (folder_ / "b.png") + "'")
                .code,
            0);
  EXPECT_EQ(readFile(folder_ / "a.png"), readFile(folder_ / "b.png"));
}

TEST_F(Render, SceneErrorsNameTheirPlace) {
  expectSceneRefused("{", "not JSON: line 1");
  expectSceneRefused("[]", "an object");
  expectSceneRefused(R"({"pack": "p.blw", "exposure": 1e999})", "scene.json");
  expectSceneRefused("{}", "pack is missing");
  expectSceneRefused(R"({"pack": "p.blw", "colour": 1})", "colour is not known");
  expectSceneRefused(R"({"pack": "p.blw", "camera": {"fieldOfView": 200}})", "camera.fieldOfView is 200");
  expectSceneRefused(R"({"pack": "p.blw", "camera": {"eye": [1, 2, 3]}})", "both eye and target");
  expectSceneRefused(R"({"pack": "p.blw", "look": {"albedo": [1, 2, 0]}})", "look.albedo[1] is 2");
  expectSceneRefused(R"({"pack": "p.blw", "size": [0, 4]})", "size[0] is 0");
  expectSceneRefused(R"({"pack": "p.blw", "background": {"bottom": [0, 0, 0]}})", "background.top is missing");
  expectSceneRefused(R"({"pack": "p.blw", "exposure": 1, "exposure": 2})", "exposure is there twice");
}

// The schema and the reader know the same members.
TEST_F(Render, SchemaListsWhatTheReaderTakes) {
  const auto schema = nlohmann::json::parse(readFile(std::string(BILLOW_SOURCE_DIR) + "/spec/scene.schema.json"));
  writeFile(folder_ / "scene.json", R"({"?": 0})");
  const std::string told = render("'" + (folder_ / "scene.json") + "' --frame 7 -o '" + (folder_ / "x.png") + "'").err;
  for (const auto& [name, member] : schema["properties"].items()) {
    EXPECT_NE(told.find(name), std::string::npos) << name;
    EXPECT_TRUE(name == "$schema" || member.contains("description")) << name;
  }
}

TEST_F(Render, RefusesWhatItCannotDo) {
  const std::string out = " -o '" + (folder_ / "x.png") + "'";
  expectRefused("'" + pack_ + "' --frame 7 --method voxels" + out, 1, "--method");
  expectRefused("'" + pack_ + "' --frame 6" + out, 1, "7 to 8");
  expectRefused("'" + pack_ + "' --frame 8-7" + out, 1, "--frame");
  expectRefused("'" + pack_ + "' --frame 7 --size 0x9" + out, 1, "--size");
  expectRefused("'" + pack_ + "' --frame 7 --camera 1,2,3" + out, 1, "--camera");
  expectRefused("'" + pack_ + "' --frame 7 --extinction smoke" + out, 1, "density, flames");
  expectRefused("'" + pack_ + "' --frame 7 -o '" + (folder_ / "x.jpg") + "'", 1, ".png or .exr");
  expectRefused("'" + (folder_ / "none.blw") + "' --frame 7" + out, 2, "none.blw");
  expectRefused("'" + pack_ + "' --frame 7 -o '" + (folder_ / "no/x.png") + "'", 2, "no/x.png");
  expectRefused("'" + pack_ + "' --frame 7 --gpu-budget 1000" + out, 4, "budget");
  expectRefused("'" + pack_ + "' --frame 7 --device 99" + out, 4, "device 99");
  for (const char* option : {"--albedo 0,2,0", "--ambient 0,-1,0", "--sun-color -1,0,0", "--background 0,0,-1",
                             "--background 0,0,0:0,-1,0"}) {
    expectRefused("'" + pack_ + "' --frame 7 " + option + out, 1, std::string(option).substr(0, 5));
  }
  for (const char* option : {"--fov nan", "--exposure nan", "--step nan", "--density nan", "--sun-intensity nan",
                             "--anisotropy nan", "--temperature-scale inf", "--temperature-offset 1e39"}) {
    expectRefused("'" + pack_ + "' --frame 7 " + option + out, 1, "not a finite number");
  }
  std::filesystem::create_directory(folder_ / "folder.json");
  expectRefused("'" + (folder_ / "folder.json") + "' --frame 7" + out, 2, "folder.json");
  writeFile(folder_ / "text.blw", "no pack");
  expectRefused("'" + (folder_ / "text.blw") + "' --frame 7" + out, 3, "text.blw");
}

TEST_F(Render, NeverReplacesItsInput) {
  const std::string before = readFile(pack_), disguised = folder_ / "pack_0007.png";
  std::filesystem::create_hard_link(pack_, disguised);
  expectRefused("'" + pack_ + "' --frame 7 -o '" + disguised + "'", 1, "the input itself");
  expectRefused("'" + pack_ + "' --frame 7-8 -o '" + (folder_ / "pack.png") + "'", 1, "the input itself");
  EXPECT_EQ(readFile(disguised), before);
}

TEST_F(Render, SaysThatThereIsNoGpu) {
  const CommandResult result = render("'" + pack_ + "' --frame 7 -o '" + (folder_ / "x.png") + "'",
                                      "VK_DRIVER_FILES=/nowhere.json VK_ICD_FILENAMES=/nowhere.json ");
  EXPECT_EQ(result.code, 4);
  EXPECT_NE(result.err.find("Vulkan"), std::string::npos) << result.err;
  EXPECT_EQ(folder_.fileCount(), 1u);
}

}  // namespace
}  // namespace billow::tests
