// Effects on the command line.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "run_command.h"

namespace billow {
namespace {

using nlohmann::json;
using tests::shell;
using tests::TempFolder;

const std::string kSamples = std::string(BILLOW_SOURCE_DIR) + "/samples/effects/";

TEST(CommandEffect, CompileInfoValidateExtract) {
  const TempFolder folder;
  const std::string pack = folder / "e.blw", vdb = folder / "e.vdb";
  const auto compiled = shell("$BILLOW compile " + kSamples + "explosion.effect.json " + kSamples +
                              "steam_jet.effect.json -o " + pack + " --json");
  ASSERT_EQ(compiled.code, 0) << compiled.err;
  EXPECT_EQ(json::parse(compiled.out)["effects"][1]["name"], "steam jet");
  EXPECT_EQ(shell("$BILLOW validate " + pack).code, 0);
  const auto info = shell("$BILLOW info " + pack + " --json");
  ASSERT_EQ(info.code, 0);
  const json effects = json::parse(info.out)["effects"];
  ASSERT_EQ(effects.size(), 2u);
  EXPECT_EQ(effects[0]["name"], "explosion");
  EXPECT_EQ(effects[0]["emitters"][0]["born"], 90);
  EXPECT_EQ(effects[0]["mostAlive"], 250);
  EXPECT_NE(shell("$BILLOW info " + pack).out.find("explosion: effect of 0.4 s, at most 250 particles"),
            std::string::npos);
  const auto extracted = shell("$BILLOW extract " + pack + " --effect explosion --time 0.5 --voxel-size 0.2 -o " + vdb);
  ASSERT_EQ(extracted.code, 0) << extracted.err;
  // Also the same bytes again, the file's UUID included.
  const std::string second = folder / "again.vdb";
  ASSERT_EQ(shell("$BILLOW extract " + pack + " --effect explosion --time 0.5 --voxel-size 0.2 -o " + second).code, 0);
  EXPECT_TRUE(tests::readFile(vdb) == tests::readFile(second));
  // What was written is a volume like any other.
  const auto again = shell("$BILLOW compile " + vdb + " -o " + (folder / "v.blw") + " --json");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_GT(json::parse(again.out)["grids"][3]["activeVoxels"].get<int>(), 1000);
}

TEST(CommandEffect, ExtractSaysWhatItNeeds) {
  const TempFolder folder;
  const std::string pack = folder / "e.blw", out = " -o " + (folder / "e.vdb");
  ASSERT_EQ(shell("$BILLOW compile " + kSamples + "steam_jet.effect.json -o " + pack).code, 0);
  const auto none = shell("$BILLOW extract " + pack + out);
  EXPECT_EQ(none.code, 1);
  EXPECT_NE(none.err.find("--effect"), std::string::npos) << none.err;
  const auto unknown = shell("$BILLOW extract " + pack + " --effect jet --time 1 --voxel-size 1" + out);
  EXPECT_EQ(unknown.code, 1);
  EXPECT_NE(unknown.err.find("there is: steam jet"), std::string::npos) << unknown.err;
  const auto size = shell("$BILLOW extract " + pack + " --effect 'steam jet' --time 1" + out);
  EXPECT_EQ(size.code, 1);
  EXPECT_NE(size.err.find("--voxel-size"), std::string::npos) << size.err;
  const auto small = shell("$BILLOW extract " + pack + " --effect 'steam jet' --time 1 --voxel-size 0.0001" + out);
  EXPECT_EQ(small.code, 1);
  EXPECT_NE(small.err.find("give a larger one"), std::string::npos) << small.err;
  const auto late = shell("$BILLOW extract " + pack + " --effect 'steam jet' --time 0 --voxel-size 1" + out);
  EXPECT_EQ(late.code, 0);
  EXPECT_NE(late.err.find("is empty 0 s after"), std::string::npos) << late.err;
}

TEST(CommandEffect, WhatIsForVolumesSaysSo) {
  const TempFolder folder;
  const std::string pack = folder / "e.blw";
  ASSERT_EQ(shell("$BILLOW compile " + kSamples + "steam_jet.effect.json -o " + pack).code, 0);
  const auto compared = shell("$BILLOW compare " + pack + " " + kSamples + "steam_jet.effect.json");
  EXPECT_EQ(compared.code, 1);
  EXPECT_NE(compared.err.find("cannot measure effects"), std::string::npos) << compared.err;
  const auto frame = shell("$BILLOW extract " + pack + " --frame 0 -o " + (folder / "e.vdb"));
  EXPECT_EQ(frame.code, 1);
  EXPECT_NE(frame.err.find("no volumes"), std::string::npos) << frame.err;
}

TEST(CommandEffect, ABadDescriptionIsInvalidInput) {
  const TempFolder folder;
  const std::string file = folder / "bad.effect.json";
  const auto result = shell("echo '{\"name\": \"x\", \"duration\": 1, \"emmiters\": []}' > " + file +
                            "; $BILLOW compile " + file + " -o " + (folder / "x.blw"));
  EXPECT_EQ(result.code, 3);
  EXPECT_NE(result.err.find("bad.effect.json: emmiters"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("emitters"), std::string::npos) << result.err;
  EXPECT_EQ(shell("$BILLOW compile " + (folder / "no.effect.json") + " -o " + (folder / "x.blw")).code, 2);
  const auto budget =
      shell("$BILLOW compile " + kSamples + "steam_jet.effect.json --disk-budget 1MB -o " + (folder / "x.blw"));
  EXPECT_EQ(budget.code, 1);
}

}  // namespace
}  // namespace billow
