// Detail levels as users meet them: compiled on request, told of, measured and taken out; never drawn or listed
// unasked.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "stages.h"
#include "unit/run_command.h"

namespace billow::tests {
namespace {

using nlohmann::json;

class LevelCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const CommandResult result = billow("compile '" + sampleFire() + "' --levels 2 --json -o '" + pack() + "'");
    ASSERT_EQ(result.code, 0) << result.err;
    report_ = json::parse(result.out);
  }
  static void TearDownTestSuite() { delete folder_; }

  static CommandResult run(const std::string& line, int code) {
    CommandResult result = billow(line);
    EXPECT_EQ(result.code, code) << "billow " << line << "\n" << result.err << result.out;
    return result;
  }
  static std::string pack() { return *folder_ / "fire.blw"; }

  static TempFolder* folder_;
  static json report_;
};
TempFolder* LevelCommand::folder_ = nullptr;
json LevelCommand::report_;

TEST_F(LevelCommand, InfoTellsThemWithTheirVolume) {
  run("validate '" + pack() + "'", 0);
  const json info = json::parse(run("info '" + pack() + "' --json", 0).out);
  ASSERT_EQ(info["volumes"].size(), 1u);
  const json& levels = info["volumes"][0]["levels"];
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_EQ(levels[0]["factor"], 2);
  EXPECT_EQ(levels[1]["factor"], 4);
  EXPECT_EQ(levels[0]["grids"].size(), info["volumes"][0]["grids"].size());
  const json& frame = levels[1]["grids"][0]["frames"][0];
  EXPECT_GT(frame["inPlaceOfFull"]["maxError"], 0);
  EXPECT_LT(frame["inPlaceOfFull"]["psnr"], levels[0]["grids"][0]["frames"][0]["inPlaceOfFull"]["psnr"]);
  EXPECT_EQ(report_["frames"], info["volumes"][0]["frames"].size());
  const std::string text = run("info '" + pack() + "'", 0).out;
  EXPECT_NE(text.find("level of voxels 4 times as long"), std::string::npos) << text;
}

// The pack's own figures, from another run over source and pack.
TEST_F(LevelCommand, CompareFindsTheErrorThatIsStated) {
  const json info = json::parse(run("info '" + pack() + "' --json", 0).out);
  for (const int level : {1, 2}) {
    const json compared = json::parse(
        run("compare '" + pack() + "' '" + sampleFire() + "' --json --level " + std::to_string(level), 0).out);
    const json& stated = info["volumes"][0]["levels"][static_cast<std::size_t>(level - 1)]["grids"];
    std::size_t rows = 0;
    for (const json& row : compared["grids"]) {
      EXPECT_TRUE(row["depthPsnr"].is_null());
      EXPECT_EQ(row["mismatchedVoxels"], 0);
      for (const json& grid : stated) {
        for (const json& frame : grid["frames"]) {
          if (grid["name"] != row["grid"] || frame["frame"] != row["frame"]) continue;
          EXPECT_NEAR(frame["inPlaceOfFull"]["psnr"].get<double>(), row["psnr"].get<double>(), 1e-9);
          const double largest = row["maxError"];
          EXPECT_NEAR(frame["inPlaceOfFull"]["maxError"].get<double>(), largest, 1e-6 * largest);
          ++rows;
        }
      }
    }
    EXPECT_EQ(rows, compared["grids"].size());
    EXPECT_GT(rows, 0u);
  }
  run("compare '" + pack() + "' '" + sampleFire() + "' --level 3", 1);
  run("compare '" + pack() + "' '" + sampleFire() + "' --level 1 --report x.html", 1);
}

TEST_F(LevelCommand, ExtractGivesTheLevelWhereItsVolumeLies) {
  const json info = json::parse(run("info '" + pack() + "' --json", 0).out);
  const std::string frame = info["volumes"][0]["frames"][0]["frame"].dump();
  std::vector<double> edges, masses;
  for (const int level : {0, 1, 2}) {
    const std::string file = *folder_ / ("level" + std::to_string(level) + "_0.vdb");
    run("extract '" + pack() + "' --frame " + frame + " --level " + std::to_string(level) + " -o '" + file + "'", 0);
    const compiler::Plan plan = compiler::planInputs({file}, {}, [](const std::string&) {});
    const auto imported = compiler::importFrame(plan.volumes[0], plan.volumes[0].frames[0], {}, {});
    const compiler::ImportedGrid& grid = imported.grids.front();
    double mass = 0;
    for (const compiler::Leaf& leaf : grid.leaves) {
      for (const float value : leaf.values) mass += static_cast<double>(value);
    }
    edges.push_back(grid.indexToWorld[0]);
    masses.push_back(mass * std::pow(8, level));
  }
  EXPECT_DOUBLE_EQ(edges[1], 2 * edges[0]);
  EXPECT_DOUBLE_EQ(edges[2], 4 * edges[0]);
  EXPECT_NEAR(masses[1], masses[0], 0.01 * masses[0]);
  EXPECT_NEAR(masses[2], masses[0], 0.01 * masses[0]);
  const CommandResult none = run("extract '" + pack() + "' --frame " + frame + " --level 3 -o x.vdb", 1);
  EXPECT_NE(none.err.find("there is: 0, 1, 2"), std::string::npos) << none.err;
}

// The name of a level's volume is no way to a level.
TEST_F(LevelCommand, AreNoVolumesToChoose) {
  const json info = json::parse(run("info '" + pack() + "' --json", 0).out);
  const std::string frame = info["volumes"][0]["frames"][0]["frame"].dump();
  const std::string name = info["volumes"][0]["levels"][0]["name"];
  const CommandResult result =
      run("extract '" + pack() + "' --frame " + frame + " --volume '" + name + "' -o x.vdb", 1);
  EXPECT_NE(result.err.find("no volume \"" + name + "\""), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find(name, result.err.find("there is")), std::string::npos) << result.err;
}

TEST_F(LevelCommand, CompileTakesAtMostTwo) {
  run("compile '" + sampleFire() + "' --levels 3 -o x.blw", 1);
  run("compile '" + sampleFire() + "' --levels -1 -o x.blw", 1);
}

}  // namespace
}  // namespace billow::tests
