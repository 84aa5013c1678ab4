// extract gives back exactly what the pack holds; compare finds every difference.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "grids.h"
#include "import/vdb_write.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::tests {
namespace {

using compiler::ImportedFrame;
using compiler::ImportedGrid;

// A ball of smoothly varying values, some of its bricks partly active, a tile beside it.
ImportedGrid ball(float scale) {
  ImportedGrid grid = ballGrid({-1016, -16, 2000}, [scale](float density, std::int32_t) { return density * scale; });
  grid.indexToWorld = {0.25, 0, 0, 1, 0, 0.5, 0, -2, 0.125, 0, 0.25, 3};
  grid.tiles.push_back({{128 * 3, 0, 2048}, 128, 0.5f * scale});
  return grid;
}

class Extract : public testing::Test {
 protected:
  // Two frames of a density, a vec3 velocity and a lone scalar.
  void SetUp() override {
    const ImportedGrid density = ball(2), x = ball(-3), y = ball(1), z = ball(5);
    for (const char* name : {"s_4.vdb", "s_5.vdb"}) {
      compiler::writeVdb(folder_ / name,
                         std::vector<compiler::VdbOutput>{
                             {"density", true, {&density}}, {"heat", false, {&y}}, {"vel", false, {&x, &y, &z}}});
    }
    run("compile '" + source() + "' -o '" + pack() + "'", 0);
  }

  CommandResult run(const std::string& line, int code) {
    CommandResult result = billow(line);
    EXPECT_EQ(result.code, code) << "billow " << line << "\n" << result.err << result.out;
    return result;
  }

  std::string source() const { return folder_ / "s_#.vdb"; }
  std::string pack() const { return folder_ / "s.blw"; }

  // Imports one file's only frame.
  static std::pair<compiler::PlannedVolume, ImportedFrame> importFile(const std::string& path) {
    const compiler::Warn ignore = [](const std::string&) {};
    const compiler::Plan plan = compiler::planInputs({path}, {}, ignore);
    return {plan.volumes.at(0), compiler::importFrame(plan.volumes[0], plan.volumes[0].frames.at(0), {}, ignore)};
  }

  TempFolder folder_;
};

void expectSameTopology(const ImportedGrid& source, const ImportedGrid& extracted, const std::string& name) {
  EXPECT_EQ(source.activeVoxels, extracted.activeVoxels) << name;
  EXPECT_EQ(source.background, extracted.background) << name;
  for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(source.indexToWorld[i], extracted.indexToWorld[i], 1e-9) << name;
  ASSERT_EQ(source.tiles.size(), extracted.tiles.size()) << name;
  for (std::size_t i = 0; i < source.tiles.size(); ++i) {
    EXPECT_EQ(source.tiles[i].origin, extracted.tiles[i].origin) << name;
    EXPECT_EQ(source.tiles[i].dim, extracted.tiles[i].dim) << name;
  }
  ASSERT_EQ(source.leaves.size(), extracted.leaves.size()) << name;
  for (std::size_t i = 0; i < source.leaves.size(); ++i) {
    EXPECT_EQ(source.leaves[i].origin, extracted.leaves[i].origin) << name;
    for (std::size_t w = 0; w < 16; ++w) {
      EXPECT_EQ(source.leaves[i].active.words[w], extracted.leaves[i].active.words[w]) << name;
    }
  }
}

TEST_F(Extract, KeepsNamesTypesTopologyAndPlace) {
  run("extract '" + pack() + "' --frame 5 -o '" + (folder_ / "x_5.vdb") + "'", 0);
  const auto [sourceVolume, source] = importFile(folder_ / "s_5.vdb");
  const auto [volume, extracted] = importFile(folder_ / "x_5.vdb");
  ASSERT_EQ(volume.grids.size(), 5u);
  for (std::size_t g = 0; g < 5; ++g) {
    EXPECT_EQ(volume.grids[g].name, sourceVolume.grids[g].name);
    EXPECT_EQ(volume.grids[g].sourceType, sourceVolume.grids[g].sourceType);  // vec3 again
    expectSameTopology(source.grids[g], extracted.grids[g], volume.grids[g].name);
  }
}

TEST_F(Extract, IsWhatThePackHoldsToTheBit) {
  run("extract '" + pack() + "' --frame 4 -o '" + (folder_ / "x_4.vdb") + "'", 0);
  const CommandResult compared = run("compare '" + pack() + "' '" + (folder_ / "x_4.vdb") + "' --json", 0);
  const auto report = nlohmann::json::parse(compared.out);
  ASSERT_EQ(report.at("grids").size(), 5u);
  for (const auto& grid : report.at("grids")) {
    EXPECT_EQ(grid.at("exact"), true) << grid;
    EXPECT_EQ(grid.at("mismatchedVoxels"), 0) << grid;
  }
}

TEST_F(Extract, TakesTheGridsAskedFor) {
  run("extract '" + pack() + "' --frame 4 --grid vel.y --grid heat -o '" + (folder_ / "x.vdb") + "'", 0);
  const auto [volume, frame] = importFile(folder_ / "x.vdb");
  ASSERT_EQ(volume.grids.size(), 2u);
  EXPECT_EQ(volume.grids[0].name, "heat");
  EXPECT_EQ(volume.grids[1].name, "vel.y");
}

TEST_F(Extract, ComplainsInOneLine) {
  const std::string output = " -o '" + (folder_ / "x.vdb") + "'";
  EXPECT_NE(run("extract '" + pack() + "' --frame 9" + output, 1).err.find("4 to 5"), std::string::npos);
  EXPECT_NE(run("extract '" + pack() + "' --frame 4 --grid no" + output, 1).err.find("density"), std::string::npos);
  EXPECT_NE(run("extract '" + pack() + "' --frame 4 --volume no" + output, 1).err.find("there is: s"),
            std::string::npos);
  run("extract '" + (folder_ / "none.blw") + "' --frame 4" + output, 2);
  run("extract '" + (folder_ / "s_4.vdb") + "' --frame 4" + output, 3);
  run("extract '" + pack() + "' --frame 4 -o '" + (folder_ / "no/x.vdb") + "'", 2);
  run("extract '" + pack() + "' --frame 4 -o /dev/null", 2);
  const std::string before = readFile(pack());
  run("extract '" + pack() + "' --frame 4 -o '" + pack() + "'", 1);
  EXPECT_EQ(readFile(pack()), before);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.vdb"));
}

TEST_F(Extract, LeavesNothingBehindOnAFullDisk) {
  const std::size_t files = folder_.fileCount();
  const std::string line = "extract '" + pack() + "' --frame 4 -o '" + (folder_ / "x.vdb") + "'";
  const CommandResult full = billow(line, "trap '' XFSZ; ulimit -f 8; ");
  EXPECT_EQ(full.code, 2) << full.err;
  EXPECT_EQ(folder_.fileCount(), files) << full.err;
}

TEST_F(Extract, CompareMeetsWhatCompileWasAsked) {
  const auto report = nlohmann::json::parse(run("compare '" + pack() + "' '" + source() + "' --json", 0).out);
  ASSERT_EQ(report.at("grids").size(), 10u);
  EXPECT_EQ(report.at("sound"), true);
  for (const auto& grid : report.at("grids")) {
    EXPECT_EQ(grid.at("mismatchedVoxels"), 0);
    EXPECT_TRUE(grid.at("exact") == true || grid.at("psnr") >= 45) << grid;
    EXPECT_GE(grid.at("maxError"), grid.at("rmse")) << grid;
    EXPECT_EQ(grid.at("depthPsnr").is_null(), grid.at("exact") == true) << grid;
    EXPECT_TRUE(grid.at("exact") == true || grid.at("depthPsnr") > 30) << grid;
  }
}

TEST_F(Extract, TellsVolumesApart) {
  std::ofstream(folder_ / "m.json") << R"({"volumes": [{"name": "one", "inputs": ["s_#.vdb"], "frames": "4"},
      {"name": "two", "inputs": ["s_#.vdb"], "grids": [{"name": "warmth", "source": "heat", "role": "temperature"}]}]})";
  const std::string manifest = folder_ / "m.json", two = folder_ / "two.blw", output = folder_ / "x.vdb";
  run("compile '" + manifest + "' -o '" + two + "'", 0);
  const auto report = nlohmann::json::parse(run("compare '" + two + "' '" + manifest + "' --json", 0).out);
  EXPECT_EQ(report.at("grids").size(), 7u);
  EXPECT_NE(run("extract '" + two + "' --frame 4 -o '" + output + "'", 1).err.find("one, two"), std::string::npos);
  EXPECT_NE(run("render '" + two + "' --frame 4 -o '" + (folder_ / "x.png") + "'", 1).err.find("one, two"),
            std::string::npos);
  run("extract '" + two + "' --volume one --frame 5 -o '" + output + "'", 1);
  run("extract '" + two + "' --volume two --frame 5 -o '" + output + "'", 0);
  EXPECT_EQ(importFile(output).first.grids.at(0).name, "warmth");
}

// One voxel more, one grid more, one frame more, another background: each is exit code 3.
TEST_F(Extract, CompareFindsEveryDifference) {
  const auto compareWith = [&](const ImportedGrid& density, const std::string& name, const std::string& file) {
    compiler::writeVdb(folder_ / file, std::vector<compiler::VdbOutput>{{name, true, {&density}}});
    return run("compare '" + pack() + "' '" + (folder_ / file) + "' --json", 3).out;
  };
  ImportedGrid density = ball(2);
  compiler::Leaf& leaf = density.leaves[21];
  leaf.active.words[3] ^= 1u << 7;
  EXPECT_NE(compareWith(density, "density", "t_4.vdb").find("\"mismatchedVoxels\": 1"), std::string::npos);
  density = ball(2);
  density.tiles.clear();
  EXPECT_NE(compareWith(density, "density", "t_4.vdb").find("\"mismatchedVoxels\": 2097152"), std::string::npos);
  density = ball(2);
  EXPECT_NE(compareWith(density, "soot", "t_4.vdb").find("no such grid"), std::string::npos);
  EXPECT_NE(compareWith(density, "density", "t_6.vdb").find("no such frame"), std::string::npos);
  density.background = 0.5f;
  EXPECT_NE(compareWith(density, "density", "t_4.vdb").find("background"), std::string::npos);
}

TEST_F(Extract, CompareGivesJsonWhateverTheNames) {
  const std::string odd = folder_ / "odd\xff.blw";
  std::filesystem::copy_file(pack(), odd);
  EXPECT_TRUE(nlohmann::json::accept(run("compare '" + odd + "' '" + source() + "' --json", 0).out));
}

// A tile that ends where 32 bits do.
TEST_F(Extract, TheLastTileOfTheIndexSpaceIsCompared) {
  ImportedGrid grid;
  grid.present = true;
  constexpr std::int32_t kLast = 2147483647 - 127;
  grid.tiles.push_back({{kLast, kLast, kLast}, 128, 0.5f});
  compiler::writeVdb(folder_ / "far.vdb", std::vector<compiler::VdbOutput>{{"density", true, {&grid}}});
  run("compile '" + (folder_ / "far.vdb") + "' -o '" + (folder_ / "far.blw") + "'", 0);
  const auto report = nlohmann::json::parse(
      run("compare '" + (folder_ / "far.blw") + "' '" + (folder_ / "far.vdb") + "' --json", 0).out);
  EXPECT_EQ(report.at("grids").at(0).at("activeVoxels"), 128 * 128 * 128);
}

}  // namespace
}  // namespace billow::tests
