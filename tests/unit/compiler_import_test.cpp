// Planning: which files, frames, grids and roles come out of what the user typed; and what damaged files give.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "import/roles.h"
#include "import/vdb_write.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using format::Role;
using tests::TempFolder;

ImportedGrid oneVoxel(float value) {
  ImportedGrid grid;
  grid.present = true;
  Leaf leaf{};
  leaf.origin = {8, -16, 0};
  leaf.active.words[0] = 1;
  leaf.values[0] = value;
  grid.leaves.push_back(leaf);
  return grid;
}

// Writes float grids of one voxel each; a name that ends in '*' becomes a vec3 grid.
void writeGrids(const std::string& path, const std::vector<std::string>& names, float value = 1) {
  const ImportedGrid grid = oneVoxel(value);
  std::vector<VdbOutput> outputs;
  for (const std::string& name : names) {
    const bool vector = name.ends_with('*');
    outputs.push_back({vector ? name.substr(0, name.size() - 1) : name,
                       false,
                       {&grid, vector ? &grid : nullptr, vector ? &grid : nullptr}});
  }
  writeVdb(path, outputs);
}

struct Planned {
  std::vector<PlannedVolume> volumes;
  std::vector<std::string> warnings;
  int fault = 0;  // of the error, 0 where there is none
  std::string error;
};

Planned plan(const std::vector<std::string>& inputs, const ImportOptions& options = {}) {
  Planned result;
  try {
    result.volumes =
        planInputs(inputs, options, [&](const std::string& text) { result.warnings.push_back(text); }).volumes;
  } catch (const Error& error) {
    result.fault = static_cast<int>(error.fault());
    result.error = error.what();
  }
  return result;
}

std::vector<std::int32_t> numbersOf(const Planned& planned) {
  std::vector<std::int32_t> numbers;
  if (planned.volumes.empty()) return numbers;
  for (const PlannedFrame& frame : planned.volumes.front().frames) numbers.push_back(frame.number);
  return numbers;
}

std::vector<std::string> namesOf(const Planned& planned) {
  std::vector<std::string> names;
  if (planned.volumes.empty()) return names;
  for (const PlannedGrid& grid : planned.volumes.front().grids) names.push_back(grid.name);
  return names;
}

Role roleOf(const Planned& planned, const std::string& name) {
  for (const PlannedGrid& grid : planned.volumes.at(0).grids) {
    if (grid.name == name) return grid.role;
  }
  ADD_FAILURE() << "no grid " << name;
  return Role::none;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

using Numbers = std::vector<std::int32_t>;
using Names = std::vector<std::string>;

TEST(PlanFrames, AreFoundByNumberHoweverTheyAreGiven) {
  const TempFolder folder;
  for (const char* name : {"a_8.vdb", "a_9.vdb", "a_10.vdb"}) writeGrids(folder / name, {"density"});
  const Numbers expected{8, 9, 10};
  EXPECT_EQ(numbersOf(plan({folder.path().string()})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_#.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_%d.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_*.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_10.vdb", folder / "a_8.vdb", folder / "a_9.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_##.vdb"})), Numbers{10});
  EXPECT_EQ(numbersOf(plan({folder / "a_%02d.vdb"})), Numbers{10});
  EXPECT_EQ(numbersOf(plan({folder / "a_9.vdb"})), Numbers{9});
  EXPECT_EQ(plan({folder.path().string()}).volumes[0].name, "a");
  std::ofstream(folder / "._a_9.vdb") << "a Mac's";
  EXPECT_EQ(numbersOf(plan({folder.path().string()})), expected);
}

TEST(PlanFrames, PatternTakesTheNumberAtItsPlace) {
  const TempFolder folder;
  writeGrids(folder / "fire_0001_v2.vdb", {"density"});
  writeGrids(folder / "fire_0002_v2.vdb", {"density"});
  EXPECT_EQ(numbersOf(plan({folder / "fire_####_v2.vdb"})), (Numbers{1, 2}));
}

TEST(PlanFrames, FileWithoutNumberIsFrameZeroAlone) {
  const TempFolder folder;
  writeGrids(folder / "cloud.vdb", {"density"});
  writeGrids(folder / "vec3_cloud.vdb", {"density"});
  EXPECT_EQ(numbersOf(plan({folder / "cloud.vdb"})), Numbers{0});
  EXPECT_EQ(numbersOf(plan({folder / "vec3_cloud.vdb"})), Numbers{0});  // the 3 does not end the name
  const Planned two = plan({folder / "cloud.vdb", folder / "vec3_cloud.vdb"});
  EXPECT_EQ(two.fault, 3);
  EXPECT_TRUE(has(two.error, "cloud.vdb") && has(two.error, "no frame number")) << two.error;
}

TEST(PlanFrames, GapsAreAnErrorOrHeldOrBlank) {
  const TempFolder folder;
  for (const char* name : {"a_1.vdb", "a_2.vdb", "a_5.vdb"}) writeGrids(folder / name, {"density"});
  ImportOptions options;
  const Planned gap = plan({folder.path().string()}, options);
  EXPECT_EQ(gap.fault, 3);
  EXPECT_TRUE(has(gap.error, "3, 4")) << gap.error;

  options.missing = MissingFrames::hold;
  const Planned held = plan({folder.path().string()}, options);
  ASSERT_EQ(numbersOf(held), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(held.volumes[0].frames[3].flags, format::kFrameHeld);
  EXPECT_EQ(held.volumes[0].frames[3].files, held.volumes[0].frames[1].files);

  options.missing = MissingFrames::blank;
  const Planned blank = plan({folder.path().string()}, options);
  ASSERT_EQ(numbersOf(blank), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(blank.volumes[0].frames[2].flags, format::kFrameBlank);
  EXPECT_TRUE(blank.volumes[0].frames[2].files.empty());

  options.missing = MissingFrames::hold;
  options.firstFrame = 0;
  EXPECT_TRUE(has(plan({folder.path().string()}, options).error, "no frame before"));
}

TEST(PlanFrames, StepSelectsAndIsProposed) {
  const TempFolder folder;
  for (const char* name : {"a_2.vdb", "a_4.vdb", "a_6.vdb"}) writeGrids(folder / name, {"density"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "--frames 2-6:2"));
  ImportOptions options;
  options.firstFrame = 2;
  options.lastFrame = 6;
  options.frameStep = 2;
  EXPECT_EQ(numbersOf(plan({folder.path().string()}, options)), (Numbers{2, 4, 6}));
  options.frameStep = 4;
  EXPECT_EQ(numbersOf(plan({folder.path().string()}, options)), (Numbers{2, 6}));
}

TEST(PlanFrames, LayersMergeWhereTheyCountTheSameFrames) {
  const TempFolder folder;
  writeGrids(folder / "smoke_1.vdb", {"density"});
  writeGrids(folder / "smoke_2.vdb", {"density"});
  writeGrids(folder / "vel_1.vdb", {"vel*"});
  const Planned uneven = plan({folder.path().string()});
  EXPECT_EQ(uneven.fault, 3);
  EXPECT_TRUE(has(uneven.error, "smoke_#") && has(uneven.error, "vel_#")) << uneven.error;
  writeGrids(folder / "vel_2.vdb", {"vel*"});
  const Planned merged = plan({folder.path().string()});
  EXPECT_EQ(namesOf(merged), (Names{"density", "vel.x", "vel.y", "vel.z"})) << merged.error;
  EXPECT_EQ(merged.volumes.at(0).frames.at(1).files.size(), 2u);
  writeGrids(folder / "vel_2.vdb", {"vel*", "density"});
  const Planned clash = plan({folder.path().string()});
  EXPECT_EQ(clash.fault, 3);
  EXPECT_TRUE(has(clash.error, "'density'") && has(clash.error, "smoke_2.vdb")) << clash.error;
}

TEST(PlanFrames, OneNumberTwiceIsAnError) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"density"});
  writeGrids(folder / "a_01.vdb", {"density"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "twice"));
}

TEST(PlanFrames, NothingThereIsAFileError) {
  const TempFolder folder;
  EXPECT_EQ(plan({folder.path().string()}).fault, 2);
  EXPECT_EQ(plan({folder / "none.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "none_####.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "*.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "none.json"}).fault, 2);
}

TEST(PlanGrids, AreTheUnionOverFramesInOrderOfName) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"fuel", "density"});
  writeGrids(folder / "a_2.vdb", {"vel*"});
  EXPECT_EQ(namesOf(plan({folder.path().string()})), (Names{"density", "fuel", "vel.x", "vel.y", "vel.z"}));
}

TEST(PlanGrids, RepeatedAndMissingNamesAreNumbered) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"", "", "x", "x"});
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"})), (Names{"unnamed", "unnamed_1", "x", "x_1"}));
}

TEST(PlanGrids, FilterTakesNamesBaseNamesAndComponents) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  ImportOptions options;
  options.grids = {"vel"};
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"}, options)), (Names{"vel.x", "vel.y", "vel.z"}));
  options.grids = {"vel.y"};
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"}, options)), Names{"vel.y"});
  EXPECT_EQ(roleOf(plan({folder / "a.vdb"}, options), "vel.y"), Role::velocityY);
  options.grids = {"smoke"};
  const Planned unknown = plan({folder / "a.vdb"}, options);
  EXPECT_EQ(unknown.fault, 1);
  EXPECT_TRUE(has(unknown.error, "density, vel")) << unknown.error;
}

// Names come from anywhere; a pack's are UTF-8 without control characters.
TEST(PlanGrids, NamesThatAPackCannotHoldAreMended) {
  const TempFolder folder;
  writeGrids(folder / "smoke\xff\x01_7.vdb", {"den\nsity", "h\xc3\xa9t", "t\xc3"});
  const Planned planned = plan({folder.path().string()});
  EXPECT_EQ(namesOf(planned), (Names{"den_sity", "h\xc3\xa9t", "t_"})) << planned.error;
  EXPECT_EQ(planned.volumes.at(0).name, "smoke__");
  EXPECT_EQ(planned.volumes.at(0).grids[0].source, "den\nsity");
  EXPECT_EQ(planned.warnings.size(), 3u);
  ImportOptions options;
  options.grids = {"den_sity"};
  EXPECT_EQ(namesOf(plan({folder.path().string()}, options)), Names{"den_sity"});
}

TEST(PlanFrames, RatesThatAPackCannotHoldAreRefused) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density"});
  ImportOptions options;
  for (const double rate : {0.0, 1e-50, 0.0009, 1.1e6, std::nan("")}) {
    options.framesPerSecond = rate;
    EXPECT_EQ(plan({folder / "a.vdb"}, options).fault, 1) << rate;
  }
  options.framesPerSecond = 0.001;
  EXPECT_EQ(plan({folder / "a.vdb"}, options).fault, 0);
}

TEST(PlanGrids, OneNameMustNotBeScalarAndVector) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"v"});
  writeGrids(folder / "a_2.vdb", {"v*"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "component"));
  writeGrids(folder / "b.vdb", {"v.x", "v*"});
  EXPECT_TRUE(has(plan({folder / "b.vdb"}).error, "two grids are named 'v.x'"));
}

std::vector<PlannedGrid> rolesFor(const std::vector<std::string>& names) {
  std::vector<PlannedGrid> grids;
  for (const std::string& name : names) {
    const bool vector = name.ends_with('*');
    const std::string base = vector ? name.substr(0, name.size() - 1) : name;
    for (std::uint32_t c = 0; c < (vector ? 3u : 1u); ++c) {
      PlannedGrid grid;
      grid.name = vector ? base + "." + static_cast<char>('x' + c) : base;
      grid.component = vector ? c : format::kNone;
      grids.push_back(grid);
    }
  }
  assignRoles(grids, std::vector<bool>(grids.size(), false));
  return grids;
}

TEST(PlanRoles, FollowTheNamesThatToolsUse) {
  const auto grids = rolesFor({"Density", "HEAT", "flames", "fuel", "Vel*", "Cd*"});
  const Role expected[] = {Role::extinction, Role::temperature, Role::flames, Role::fuel,   Role::velocityX,
                           Role::velocityY,  Role::velocityZ,   Role::colorR, Role::colorG, Role::colorB};
  for (std::size_t i = 0; i < grids.size(); ++i) EXPECT_EQ(grids[i].role, expected[i]) << grids[i].name;
}

TEST(PlanRoles, AreGivenOnceByPreference) {
  const auto grids = rolesFor({"density", "density_noise", "smoke"});
  EXPECT_EQ(grids[0].role, Role::none);
  EXPECT_EQ(grids[1].role, Role::extinction);
  EXPECT_EQ(grids[2].role, Role::none);
}

TEST(PlanRoles, ALoneUnknownScalarIsTheExtinction) {
  EXPECT_EQ(rolesFor({"mask"})[0].role, Role::extinction);
  EXPECT_EQ(rolesFor({"mask", "vel*"})[0].role, Role::extinction);
  EXPECT_EQ(rolesFor({"mask", "temperature"})[0].role, Role::none);
  EXPECT_EQ(rolesFor({"a", "b"})[0].role, Role::none);
  EXPECT_EQ(rolesFor({"fuel"})[0].role, Role::fuel);
}

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
      {"[]", {"/", "[]", "an object"}},
      {"{}", {"volumes"}},
      {R"({"volumes":[]})", {"/volumes", "[]", "a list of volumes"}},
      {R"({"volumes":[{"name":"a"}]})", {"/volumes/0", "inputs"}},
      {R"({"volumes":[{"name":"","inputs":["x"]}]})", {"/volumes/0/name"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"fsp":24}]})", {"/volumes/0/fsp", "unknown key"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"fps":-1}]})", {"/volumes/0/fps", "-1"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"frames":"4-2"}]})", {"/volumes/0/frames", "4-2", "A-B"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"missing":"x"}]})", {"/volumes/0/missing", "hold"}},
      {R"({"volumes":[{"name":"a","inputs":["in/a_#.vdb"],"grids":[{"name":"hot","role":"heat"}]}]})",
       {"/volumes/0/grids/0/role", "heat", "temperature"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"grids":[{"name":"hot"}]}]})", {"'hot'", "density"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"albedo":[1,2,0]}}]})",
       {"/volumes/0/look/albedo/1", "2"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"anisotropy":1}}]})",
       {"/volumes/0/look/anisotropy"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"look":{"anisotropy":0.99999999999}}]})",
       {"/volumes/0/look/anisotropy"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"fps":1e999}]})", {"1e999"}},
      {R"({"volumes":[{"name":"a\n","inputs":["in/cloud.vdb"]}]})", {"/volumes/0/name", "control"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"],"grids":[{"name":"\u007f","source":"density"}]}]})",
       {"/volumes/0/grids/0/name", "control"}},
      {R"({"volumes":[{"name":"a","inputs":["in/cloud.vdb"]},{"name":"a","inputs":["in/cloud.vdb"]}]})",
       {"/volumes/1/name", "no other volume"}},
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
  const auto schema =
      nlohmann::json::parse(tests::readFile(std::string(BILLOW_SOURCE_DIR) + "/spec/manifest.schema.json"));
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
      EXPECT_FALSE(has(plan({folder / "m.json"}).error, "unknown key")) << part << "." << key;
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

// Imports what there is; only Error may come out of it.
void importAll(const std::string& path) {
  try {
    const Warn ignore = [](const std::string&) {};
    for (const PlannedVolume& volume : planInputs({path}, {}, ignore).volumes) {
      for (const PlannedFrame& frame : volume.frames) importFrame(volume, frame, {}, ignore);
    }
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input) << error.what();
    EXPECT_TRUE(has(error.what(), path)) << error.what();
  }
}

TEST(DamagedFile, EveryTruncationIsAnError) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  const std::string whole = tests::readFile(folder / "a.vdb");
  const std::string path = folder / "cut.vdb";
  for (std::size_t size = 0; size < whole.size(); size += size < 1500 ? 1 : 97) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    const Planned planned = plan({path});
    EXPECT_EQ(planned.fault, 3) << size;
    EXPECT_TRUE(has(planned.error, "cut.vdb")) << planned.error;
  }
}

TEST(DamagedFile, RandomDamageGivesOneClearErrorOrAGrid) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  const std::string whole = tests::readFile(folder / "a.vdb");
  const std::string path = folder / "damaged.vdb";
  std::mt19937 random(1);
  for (int round = 0; round < 500; ++round) {
    std::string bytes = whole;
    const std::size_t zone = round % 2 == 0 ? 1500 : bytes.size();  // the first kilobytes hold all counts and offsets
    for (std::uint32_t i = 0; i < 1 + random() % 4; ++i) bytes[random() % zone] = static_cast<char>(random());
    std::ofstream(path, std::ios::binary) << bytes;
    importAll(path);
  }
}

}  // namespace
}  // namespace billow::compiler
