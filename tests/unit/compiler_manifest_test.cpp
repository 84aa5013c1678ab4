// Manifests: what they describe, and what is wrong with them.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "import/roles.h"
#include "planned.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using format::Role;
using namespace tests;

using Numbers = std::vector<std::int32_t>;
using Names = std::vector<std::string>;

void writeText(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

class Manifest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "in");
    for (const char* name : {"in/a_2.vdb", "in/a_4.vdb"}) writeGrids(folder_ / name, {"smokey", "hot", "flow*"});
    writeGrids(folder_ / "in/cloud.vdb", {"density"});
  }

  Planned planText(const std::string& text, const ImportOptions& options = {}) {
    writeText(folder_ / "m.json", text);
    return plan({folder_ / "m.json"}, options);
  }

  TempFolder folder_;
};

constexpr const char* kWholeManifest = R"({
  // two volumes
  "volumes": [
    {"name": "fire", "inputs": ["in/a_#.vdb"], "fps": 30, "frames": "2-4:2",
     "grids": [{"name": "density", "source": "smokey", "role": "extinction"},
               {"name": "hot", "role": "temperature"}, {"name": "velocity", "source": "flow"}],
     "look": {"extinctionScale": 2, "albedo": [0.5, 0.6, 0.7], "anisotropy": -0.25, "ambient": [0, 0, 1]}},
    {"name": "cloud", "inputs": ["in/cloud.vdb"]}
  ]
})";

TEST_F(Manifest, DescribesVolumes) {
  const Planned planned = planText(kWholeManifest);
  ASSERT_EQ(planned.volumes.size(), 2u) << planned.error;
  const PlannedVolume& fire = planned.volumes[0];
  EXPECT_EQ(fire.name, "fire");
  EXPECT_EQ(numbersOf(planned), (Numbers{2, 4}));
  EXPECT_EQ(namesOf(planned), (Names{"density", "hot", "velocity.x", "velocity.y", "velocity.z"}));
  EXPECT_EQ(fire.grids[0].source, "smokey");
  EXPECT_EQ(roleOf(planned, "density"), Role::extinction);
  EXPECT_EQ(roleOf(planned, "hot"), Role::temperature);
  EXPECT_EQ(roleOf(planned, "velocity.z"), Role::velocityZ);  // by its new name
  EXPECT_EQ(fire.framesPerSecond, 30);
  EXPECT_EQ(fire.look.set, 0b1000111u);
  EXPECT_EQ(fire.look.albedo[1], 0.6f);
  EXPECT_EQ(fire.look.anisotropy, -0.25f);
  EXPECT_EQ(planned.volumes[1].name, "cloud");
  const ImportedFrame frame = importFrame(fire, fire.frames[0], {}, [](const std::string&) {});
  EXPECT_EQ(frame.grids[0].activeVoxels, 1u);
  EXPECT_EQ(frame.grids[4].activeVoxels, 1u);
}

TEST_F(Manifest, YieldsToTheCommandLine) {
  ImportOptions options;
  options.framesPerSecond = 60;
  options.firstFrame = 4;
  options.lastFrame = 4;
  writeText(folder_ / "m.json", R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"fps":30,"frames":"2-4:2"}]})");
  const Planned planned = plan({folder_ / "m.json"}, options);
  EXPECT_EQ(planned.volumes.at(0).framesPerSecond, 60);
  EXPECT_EQ(numbersOf(planned), Numbers{4});
}

struct BadManifest {
  const char* text;
  std::vector<std::string> says;
};

TEST_F(Manifest, ErrorsNamePlaceValueAndExpectation) {
  const std::vector<BadManifest> bad = {
      {"{", {"not JSON", "line 1"}},
      {"[]", {"the document is []", "an object"}},
      {"{}", {"volumes"}},
      {R"({"volumes":[]})", {"volumes", "[]", "a list of volumes"}},
      {R"({"volumes":[{"name":"a"}]})", {"volumes[0]", "inputs"}},
      {R"({"volumes":[{"name":"","inputs":["x"]}]})", {"volumes[0].name"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"fsp":24}]})",
       {"volumes[0].fsp", "is not known (did you mean \"fps\"?)"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"fps":-1}]})", {"volumes[0].fps", "-1"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"frames":"4-2"}]})", {"volumes[0].frames", "4-2", "A-B"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"missing":"x"}]})", {"volumes[0].missing", "hold"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"grids":[{"name":"hot","role":"heat"}]}]})",
       {"volumes[0].grids[0].role", "heat", "temperature"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"grids":[{"name":"hot"}]}]})", {"'hot'", "density"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"albedo":[1,2,0]}}]})",
       {"volumes[0].look.albedo[1]", "2"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"anisotropy":1}}]})",
       {"volumes[0].look.anisotropy"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"anisotropy":0.99999999999}}]})",
       {"volumes[0].look.anisotropy"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"fps":1e999}]})", {"1e999"}},
      {R"({"volumes":[{"name":"a\n","inputs":["in/cloud.vdb"]}]})", {"volumes[0].name", "control"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"grids":[{"name":"\u007f","source":"density"}]}]})",
       {"volumes[0].grids[0].name", "control"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"]},{"name":"a","inputs":["in/cloud.vdb"]}]})",
       {"volumes[1].name", "no other volume"}},
  };
  for (const BadManifest& manifest : bad) {
    const Planned planned = planText(manifest.text);
    EXPECT_EQ(planned.fault, 3) << manifest.text;
    EXPECT_TRUE(has(planned.error, "m.json")) << planned.error;
    for (const std::string& text : manifest.says)
      EXPECT_TRUE(has(planned.error, text)) << text << "\n" << planned.error;
  }
}

TEST_F(Manifest, TakesTheLargestFactor) {
  const Planned planned =
      planText(R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"emissionScale":1e30}}]})");
  EXPECT_EQ(planned.volumes.at(0).look.emissionScale, 1e30f) << planned.error;
}

TEST_F(Manifest, WhatIsNoFileIsAFileError) {
  std::filesystem::create_directory(folder_ / "folder.json");
  ASSERT_EQ(::mkfifo((folder_ / "pipe.json").c_str(), 0600), 0);
  ASSERT_EQ(::mkfifo((folder_ / "pipe.vdb").c_str(), 0600), 0);
  for (const char* name : {"folder.json", "pipe.json", "pipe.vdb"}) {
    const Planned planned = plan({folder_ / name});
    EXPECT_EQ(planned.fault, 2) << name;
    EXPECT_TRUE(has(planned.error, name)) << planned.error;
  }
}

TEST_F(Manifest, MustBeTheOnlyInput) {
  writeText(folder_ / "m.json", kWholeManifest);
  EXPECT_EQ(plan({folder_ / "m.json", folder_ / "in/cloud.vdb"}).fault, 1);
}

// The reader and the schema know the same keys and words.
TEST(ManifestSchema, AgreesWithTheReader) {
  const auto schema = nlohmann::json::parse(readFile(std::string(BILLOW_SOURCE_DIR) + "/spec/manifest.schema.json"));
  const auto& definitions = schema.at("definitions");
  std::string words;
  for (const auto& word : definitions.at("grid").at("properties").at("role").at("enum")) {
    EXPECT_TRUE(roleByWord(word.get<std::string>()).has_value()) << word;
    words += (words.empty() ? "" : ", ") + word.get<std::string>();
  }
  EXPECT_EQ(words.size(), roleWords().size());
  const TempFolder folder;
  for (const char* part : {"volume", "grid", "look"}) {
    for (const auto& [key, ignored] : definitions.at(part).at("properties").items()) {
      const std::string object = "{\"" + key + "\": {}}";
      const std::string volume = std::string(part) == "volume" ? object
                                 : std::string(part) == "grid"
                                     ? R"({"name":"a","inputs":["x"],"grids":[)" + object + "]}"
                                     : R"({"name":"a","inputs":["x"],"look":)" + object + "}";
      writeText(folder / "m.json", "{\"volumes\":[" + volume + "]}");
      EXPECT_FALSE(has(plan({folder / "m.json"}).error, "is not known")) << part << "." << key;
    }
  }
}

TEST(ManifestSchema, AcceptsTheSampleWhereAValidatorIsInstalled) {
  if (std::system("python3 -c 'import jsonschema' 2>/dev/null") != 0) GTEST_SKIP() << "python3-jsonschema is not there";
  const TempFolder folder;
  std::string text = kWholeManifest;
  text.erase(text.find("//"), text.find('\n', text.find("//")) - text.find("//"));  // JSON proper has no comments
  writeText(folder / "m.json", text);
  writeText(folder / "bad.json", R"({"volumes":[{"name":"a","inputs":["x"],"fsp":1}]})");
  const std::string validate =
      "python3 -c 'import json,sys,jsonschema; "
      "jsonschema.validate(json.load(open(sys.argv[2])),json.load(open(sys.argv[1])))' '" +
      std::string(BILLOW_SOURCE_DIR) + "/spec/manifest.schema.json' ";
  EXPECT_EQ(std::system((validate + "'" + (folder / "m.json") + "'").c_str()), 0);
  EXPECT_NE(std::system((validate + "'" + (folder / "bad.json") + "' 2>/dev/null").c_str()), 0);
}

}  // namespace
}  // namespace billow::compiler
