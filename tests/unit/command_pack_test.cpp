// `billow validate` and `billow info` on packs made for the purpose: what they print, where, and how they exit.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pack_image.h"
#include "run_command.h"
#include "sample_pack.h"

namespace billow {
namespace {

using tests::CommandResult;
using tests::PackImage;

class PackFile {
 public:
  explicit PackFile(const std::vector<std::byte>& bytes) {
    std::ofstream(path(), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  std::string path() const { return folder_ / "a pack.blw"; }
  CommandResult run(const std::string& command) const { return tests::billow(command + " '" + path() + "'"); }

 private:
  tests::TempFolder folder_;
};

// Sound, but with a page that nothing reaches.
std::vector<std::byte> packWithWarning() {
  PackImage image = PackImage::of(tests::samplePack());
  for (format::GridFrame& frame : image.gridFrames) frame = tests::absentGridFrame();
  image.pageLists.clear();
  return image.assemble();
}

std::vector<std::byte> brokenPack() {
  PackImage image = PackImage::of(tests::samplePack());
  image.gridFrames[0].maxError = -1;
  image.gridFrames[2].origin[1] = 3;
  return image.assemble();
}

TEST(ValidateCommand, SilentWhenSound) {
  const CommandResult result = PackFile(tests::samplePack()).run("validate --warnings-as-errors");
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.out + result.err, "");
}

TEST(ValidateCommand, SaysWhatIsBrokenAndWhere) {
  const PackFile file(brokenPack());
  const CommandResult text = file.run("validate");
  EXPECT_EQ(text.code, 3);
  EXPECT_NE(text.out.find("error 218 grid-frame-values at GFRM byte"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("volume 0 frame 8 grid 0"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find(": 2 errors, 0 warnings\n"), std::string::npos) << text.out;

  const CommandResult json = file.run("validate --format json");
  EXPECT_EQ(json.code, 3);
  const auto report = nlohmann::json::parse(json.out);
  EXPECT_EQ(report["valid"], false);
  EXPECT_EQ(report["errors"], 2);
  ASSERT_EQ(report["issues"].size(), 2u);
  EXPECT_EQ(report["issues"][1]["id"], 220);
  EXPECT_EQ(report["issues"][1]["section"], "GFRM");
  EXPECT_EQ(report["issues"][1]["frame"], 8);
}

TEST(ValidateCommand, WarningsFailOnlyWhenAsked) {
  const PackFile file(packWithWarning());
  const CommandResult mild = file.run("validate");
  EXPECT_EQ(mild.code, 0);
  EXPECT_NE(mild.out.find("warning 306 page-unused"), std::string::npos) << mild.out;
  EXPECT_EQ(file.run("validate --warnings-as-errors").code, 3);
}

TEST(ValidateCommand, ForeignAndMissingFiles) {
  EXPECT_EQ(PackFile({}).run("validate").code, 3);
  EXPECT_EQ(PackFile(std::vector<std::byte>(1000, std::byte{'x'})).run("validate").code, 3);
  const tests::TempFolder folder;
  EXPECT_EQ(tests::billow("validate '" + (folder / "none.blw") + "'").code, 2);
  EXPECT_EQ(tests::billow("validate '" + folder.path().string() + "'").code, 2);
  const CommandResult json = tests::billow("validate --format json '" + (folder / "none.blw") + "'");
  EXPECT_EQ(json.code, 2);
  const auto report = nlohmann::json::parse(json.out);
  EXPECT_EQ(report["valid"], false);
  ASSERT_EQ(report["issues"].size(), 1u);
  EXPECT_EQ(report["issues"][0]["id"], 1);
  EXPECT_EQ(tests::billow("info '" + (folder / "none.blw") + "'").code, 2);
}

TEST(InfoCommand, TellsGridsFramesAndBytes) {
  const PackFile file(tests::samplePack());
  const CommandResult result = file.run("info --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto info = nlohmann::json::parse(result.out);
  EXPECT_EQ(info["fileBytes"], tests::samplePack().size());
  EXPECT_EQ(info["encodings"]["constant"], 2);
  EXPECT_EQ(info["encodings"]["coarse"], 1);
  EXPECT_EQ(info["info"]["generator"], "test");
  const auto& volume = info["volumes"][0];
  EXPECT_EQ(volume["name"], "cloud");
  EXPECT_EQ(volume["frames"][1]["frame"], 8);
  ASSERT_EQ(volume["grids"].size(), 2u);
  const auto& frame = volume["grids"][0]["frames"][0];
  EXPECT_EQ(frame["bricks"], 7);
  EXPECT_EQ(frame["gpuBytes"]["uniform"], 192 + 1024 + 512);
  EXPECT_EQ(frame["gpuBytes"]["masks"], 128);
  EXPECT_EQ(frame["gpuBytes"]["records"], (7 + 1) * 16);  // of bricks, and of the tile
  EXPECT_EQ(frame["psnr"], nullptr);
  EXPECT_EQ(volume["grids"][1]["frames"][0]["present"], false);
}

TEST(InfoCommand, ReportsTheErrorOfTheGridFrame) {
  PackImage image = PackImage::of(tests::samplePack());
  format::GridFrame& frame = image.gridFrames[2];  // 512 voxels, source 0.125 to 2
  frame.squaredError = 512 * 0.01 * 0.01;
  frame.maxError = 0.02f;
  const auto info = nlohmann::json::parse(PackFile(image.assemble()).run("info --json").out);
  const auto& row = info["volumes"][0]["grids"][0]["frames"][1];
  EXPECT_NEAR(row["psnr"].get<double>(), 20 * std::log10(1.875 / 0.01), 1e-9);
  EXPECT_FLOAT_EQ(row["maxError"].get<float>(), 0.02f);
}

TEST(InfoCommand, RefusesBrokenPacks) {
  const CommandResult result = PackFile(brokenPack()).run("info");
  EXPECT_EQ(result.code, 3);
  EXPECT_EQ(result.out, "");
  EXPECT_NE(result.err.find("a pack.blw: error 218"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace billow
