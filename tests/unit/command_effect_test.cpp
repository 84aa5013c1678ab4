// Effects on the command line.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "ply_file.h"
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
  // Every kind is counted, and all of it in the whole and in what compile says.
  const json gpu = json::parse(info.out)["gpu"];
  EXPECT_EQ(gpu["effects"]["particles"], (250 + 411) * 96);
  EXPECT_EQ(gpu["effects"]["emitters"], 3 * 256);
  EXPECT_EQ(gpu["effects"]["ramps"], 32 * 16 * 16);
  EXPECT_EQ(gpu["effects"]["maps"].get<std::uint64_t>() % (66 * 66 * 6), 0u);
  EXPECT_EQ(gpu["effects"]["tracks"], 0);
  std::uint64_t sum = 0;
  for (const auto& [kind, bytes] : gpu["effects"].items()) sum += kind == "total" ? 0 : bytes.get<std::uint64_t>();
  EXPECT_EQ(gpu["effects"]["total"], sum);
  EXPECT_EQ(gpu["total"], sum);
  EXPECT_EQ(json::parse(compiled.out)["gpuBytes"], sum);
  EXPECT_EQ(json::parse(compiled.out)["effectGpuBytes"], sum);
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
  const auto frame = shell("$BILLOW extract " + pack + " --frame 0 -o " + (folder / "e.vdb"));
  EXPECT_EQ(frame.code, 1);
  EXPECT_NE(frame.err.find("no volumes"), std::string::npos) << frame.err;
}

// A description whose every part can be told, to be changed at will.
json described() {
  return json::parse(R"({"name": "test", "duration": 2, "emitters": [{
    "name": "puffs", "rate": 10, "lifetime": 1, "velocity": {"speed": [1, 2], "spread": 40},
    "forces": {"drag": 1, "curlNoise": {"speed": 2, "frequency": 0.7}}, "tracks": {"error": 0.01},
    "primitive": {"kind": "sphere", "radius": 1,
      "density": {"extinction": 2, "opacity": [[0, 0], [0.5, 1], [1, 0]]},
      "emission": {"strength": [[0, 9], [1, 4]], "temperature": [[0, 2100], [1, 1300]],
        "ramp": [{"age": 0, "stops": [[0, [1, 1, 1]], [0.5, [0, 0, 0]]]}]},
      "displacement": {"amount": 0.3, "noise": {"kind": "fbm", "frames": 3}}}}]})");
}

class CompareEffects : public testing::Test {
 protected:
  CompareEffects() {
    write(described());
    EXPECT_EQ(shell("$BILLOW compile " + file_ + " -o " + pack_).code, 0);
  }
  void write(const json& document) { std::ofstream(file_) << document.dump(); }
  json compare(const json& document, int code) {
    write(document);
    const auto result = shell("$BILLOW compare " + pack_ + " " + file_ + " --json");
    EXPECT_EQ(result.code, code) << result.err;
    return result.out.empty() ? json() : json::parse(result.out);
  }
  static json part(const json& report, const std::string& name) {
    for (const json& row : report.at("effects")) {
      if (row.value("part", "") == name) return row;
    }
    return json::object();
  }
  // What a changed description is told.
  void expectProblem(const json& document, const std::string& name, const std::string& problem) {
    const json report = compare(document, 3);
    EXPECT_EQ(report["sound"], false);
    EXPECT_NE(part(report, name).value("problem", "").find(problem), std::string::npos) << report.dump(1);
  }

  TempFolder folder_;
  std::string file_ = folder_ / "test.effect.json", pack_ = folder_ / "test.blw";
};

TEST_F(CompareEffects, MeasuresEveryPart) {
  const json report = compare(described(), 0);
  EXPECT_EQ(report["sound"], true);
  EXPECT_TRUE(report["grids"].empty());
  EXPECT_EQ(part(report, "numbers")["maxError"], 0);
  // The peak lies in the middle between two samples, which are 1 / 63 below it; the error is a triangle.
  const json opacity = part(report, "opacity");
  EXPECT_NEAR(opacity["maxError"].get<double>(), 1.0 / 63, 1e-6);
  EXPECT_NEAR(opacity["rmse"].get<double>(), 1.0 / 63 / std::sqrt(3.0 * 63), 1e-6);
  EXPECT_EQ(opacity["largest"], 1);
  // Between samples at 15 / 31 and 16 / 31, the line from 1 to 0 at a half ends before the second.
  EXPECT_NEAR(part(report, "emission ramp")["maxError"].get<double>(), 1.0 / 62, 1e-6);
  const json emission = part(report, "emission");
  EXPECT_GT(emission["maxError"].get<double>(), 1e-6);
  EXPECT_LT(emission["maxError"].get<double>(), 0.01);
  const json maps = part(report, "displacement maps");
  EXPECT_GT(maps["rmse"].get<double>(), 0.001);
  EXPECT_LT(maps["maxError"].get<double>(), 0.06);
  const json track = part(report, "track");
  EXPECT_EQ(track["asked"], 0.01);
  EXPECT_GT(track["maxError"].get<double>(), 0.001);
  EXPECT_LE(track["maxError"].get<double>(), 0.01);
}

TEST_F(CompareEffects, FindsWhatDiffers) {
  json document = described();
  const auto emitter = [&]() -> json& { return document["emitters"][0]; };
  const auto expectAfter = [&](const auto& change, const std::string& name, const std::string& problem) {
    document = described();
    change();
    expectProblem(document, name, problem);
  };
  expectAfter([&] { document["seed"] = 1; }, "numbers", "seed is 0 in the pack, 1 in the description");
  expectAfter([&] { emitter()["name"] = "clouds"; }, "numbers", "emitter 0 is 'puffs' in the pack, 'clouds'");
  expectAfter([&] { document["emitters"].push_back(json(emitter())), document["emitters"][1]["name"] = "b"; },
              "numbers", "number of emitters is 1 in the pack, 2");
  expectAfter([&] { emitter()["rate"] = 11; }, "numbers", "20 particles are born in a run in the pack, 22");
  expectAfter([&] { emitter()["lifetime"] = {1, 1.5}; }, "numbers", "lifetime is 1 1 in the pack, 1 1.5");
  expectAfter([&] { emitter()["lifetime"] = {1, 1.5}; }, "track", "numbers differ");
  expectAfter([&] { emitter()["primitive"]["density"]["softness"] = 0.5; }, "numbers", "softness differ");
  expectAfter(
      [&] {
        emitter()["primitive"]["radiusOverLife"] = {{0, 1}, {1, 2}};
      },
      "radius over life", "only the description has it");
  expectAfter([&] { emitter()["primitive"].erase("displacement"); }, "displacement maps", "only the pack has it");
  expectAfter([&] { emitter()["primitive"]["displacement"]["noise"]["frames"] = 4; }, "displacement maps",
              "3 maps in the pack, 4");
  expectAfter([&] { emitter()["tracks"]["framesPerSecond"] = 60; }, "track", "30 a second, in the pack");
  expectAfter([&] { document["name"] = "other"; }, "", "the pack has no such effect");
}

// A curve that was changed is no other effect, but a large error.
TEST_F(CompareEffects, ChangedCurvesAreErrors) {
  json document = described();
  document["emitters"][0]["primitive"]["density"]["opacity"] = {{0, 0.5}, {1, 0.5}};
  const json report = compare(document, 0);
  EXPECT_NEAR(part(report, "opacity")["maxError"].get<double>(), 0.5, 0.02);
  document = described();
  document["emitters"][0]["primitive"]["displacement"]["noise"]["seed"] = 9;
  EXPECT_GT(part(compare(document, 0), "displacement maps")["rmse"].get<double>(), 0.1);
}

class CompareGiven : public CompareEffects {
 protected:
  static json fromFiles() {
    return json::parse(R"({"name": "swarm", "duration": 1, "emitters": [{"name": "bees",
      "particles": {"files": "bees_####.ply", "framesPerSecond": 10, "error": 0.01},
      "primitive": {"kind": "sphere", "density": {"extinction": 2}}}]})");
  }
  CompareGiven() {
    for (int f = 0; f < 3; ++f) writeFrame(f, 40, 0);
    write(fromFiles());
    EXPECT_EQ(shell("$BILLOW compile " + file_ + " -o " + pack_).code, 0);
  }
  void writeFrame(int frame, int particles, double shift) {
    std::vector<tests::PlyColumn> columns{
        {"float", "x", {}}, {"float", "y", {}}, {"float", "z", {}}, {"float", "pscale", {}}, {"int", "id", {}}};
    for (int i = 0; i < particles; ++i) {
      const double values[] = {0.37 * i + shift, 0.71 * frame * i, 3, 0.5 + 0.1 * frame + 0.003 * i, 1.0 * i};
      for (std::size_t c = 0; c < 5; ++c) columns[c].values.push_back(values[c]);
    }
    std::ofstream(folder_ / ("bees_000" + std::to_string(frame) + ".ply"), std::ios::binary)
        << tests::plyText("binary_little_endian", columns);
  }
};

TEST_F(CompareGiven, MeasuresPlacesAndRadii) {
  const json report = compare(fromFiles(), 0);
  EXPECT_EQ(report["sound"], true) << report.dump(1);
  for (const char* name : {"track", "radii"}) {
    const json measured = part(report, name);
    EXPECT_EQ(measured["asked"], 0.01) << name;
    EXPECT_GT(measured["maxError"].get<double>(), 0.0005) << name;
    EXPECT_LE(measured["maxError"].get<double>(), 0.01) << name;
  }
  EXPECT_NEAR(part(report, "radii")["largest"].get<double>(), 0.7 + 0.003 * 39, 1e-6);
  const json gpu = json::parse(shell("$BILLOW info " + pack_ + " --json").out);
  EXPECT_EQ(gpu["gpu"]["effects"]["given"], 40 * 40);
  EXPECT_EQ(gpu["gpu"]["effects"]["tracks"], 3 * 40 * (16 + 4));
  EXPECT_EQ(gpu["effects"][0]["emitters"][0]["born"], 40);
  EXPECT_EQ(gpu["effects"][0]["emitters"][0]["mostAlive"], 40);
}

TEST_F(CompareGiven, FindsWhatDiffers) {
  json document = fromFiles();
  document["emitters"][0]["particles"]["radius"] = false;
  expectProblem(document, "radii", "only the pack has it");
  document = fromFiles();
  document["emitters"][0]["particles"]["framesPerSecond"] = 12;
  expectProblem(document, "track", "10 a second, in the pack; 3 and 12");
  writeFrame(1, 40, 0.25);  // places are errors, not others
  EXPECT_NEAR(part(compare(fromFiles(), 0), "track")["maxError"].get<double>(), 0.25, 0.01);
  for (int f = 0; f < 3; ++f) writeFrame(f, 39, 0);
  expectProblem(fromFiles(), "numbers", "40 particles are given in the pack, 39 by the description's files");
  expectProblem(fromFiles(), "track", "40 particles in frame 0 in the pack, 39");
  expectProblem(described(), "", "the pack has no such effect");
}

TEST_F(CompareEffects, VolumesAndEffectsTogether) {
  const std::string both = folder_ / "both.blw", inputs = "'" + tests::sampleFire() + "' " + file_ + " --frames 7";
  ASSERT_EQ(shell("$BILLOW compile " + inputs + " -o " + both).code, 0);
  const auto text = shell("$BILLOW compare " + both + " " + inputs);
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("fire/density"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("test/puffs"), std::string::npos) << text.out;
  const std::string page = folder_ / "page.html";
  const auto report = json::parse(shell("$BILLOW compare " + both + " " + inputs + " --json --report " + page).out);
  const std::string html = tests::readFile(page);
  EXPECT_NE(html.find("Every effect"), std::string::npos);
  EXPECT_NE(html.find("displacement maps"), std::string::npos);
  EXPECT_GT(report["grids"].size(), 0u);
  EXPECT_EQ(report["effects"].size(), 6u);
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
