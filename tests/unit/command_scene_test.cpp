// Scenes of several volumes and effects: where they stand, what shows when, and what is refused.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "effect_tables.h"
#include "run_command.h"
#include "sample_pack.h"

namespace billow::tests {
namespace {

using nlohmann::json;

// A small cube of smoke around (9, 9, 9), denser from frame to frame: `frames` of them from number 7 on, 24 a second.
std::vector<std::byte> smoke(std::uint32_t frames) {
  return writePack({}, [frames](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("smoke", {"density"}, frames);
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      GridFrameBuilder builder(writer, 0);
      builder.brick({10, 10, 10}, format::kEncodingConstant, {}, 1 + static_cast<float>(frame), 0, format::kMaskAll);
      tables.gridFrames.push_back(builder.finish(tables));
    }
    return tables;
  });
}

// Balls that rise from the origin; the second effect is like the first, of another colour.
std::vector<std::byte> balls() {
  return writePack({.effects = true}, [](format::PackWriter&) {
    format::EffectTables effects = plainEffect();
    effects.effects.push_back(effects.effects[0]);
    effects.effects[1].firstEmitter = 1;
    effects.emitters[0].speed[0] = effects.emitters[0].speed[1] = 2;
    effects.emitters[0].radius[0] = effects.emitters[0].radius[1] = 0.8f;
    effects.emitters.push_back(effects.emitters[0]);
    effects.emitters[1].firstSpan = 1;
    effects.emitters[1].diffuse[1] = 0;
    effects.spans.push_back(effects.spans[0]);
    return packTables(std::move(effects));
  });
}

class Scene : public testing::Test {
 protected:
  Scene() {
    write("smoke.blw", smoke(4));
    write("balls.blw", balls());
  }

  void write(const std::string& name, const std::vector<std::byte>& bytes) {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  // A scene with a camera and coarse voxels, for speed.
  static json sceneOf(json members) {
    members["size"] = {40, 30};
    members["voxelSize"] = 0.25;
    members["camera"] = {{"eye", {9, 9, 24}}, {"target", {9, 9, 9}}, {"fieldOfView", 50}, {"up", "y"}};
    return members;
  }
  static json volume(json members = json::object()) {
    members["pack"] = "smoke.blw";
    return members;
  }
  static json effect(json members = json::object()) {
    members["pack"] = "balls.blw";
    if (!members.contains("effect")) members["effect"] = "effect 0";
    if (!members.contains("transform")) members["transform"] = {{"translate", {9, 8, 9}}};
    return members;
  }

  CommandResult render(const json& scene, const std::string& options) {
    std::ofstream(folder_ / "scene.json") << scene.dump();
    return billow("render '" + (folder_ / "scene.json") + "' " + options);
  }
  std::string picture(const json& scene, const std::string& when = "--frame 2") {
    const CommandResult result = render(sceneOf(scene), when + " -o '" + (folder_ / "p.png") + "'");
    EXPECT_EQ(result.code, 0) << scene << when << "\n" << result.err;
    return readFile(folder_ / "p.png");
  }
  void expectRefused(const json& scene, const std::string& named, int code = 3, const std::string& when = "--frame 0") {
    const CommandResult result = render(scene, when + " -o '" + (folder_ / "x.png") + "'");
    EXPECT_EQ(result.code, code) << scene << when << "\n" << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << scene << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "x.png"));
  }

  TempFolder folder_;
};

TEST_F(Scene, EachThingIsInThePicture) {
  const json moved = {{"translate", {3, 0, 0}}}, small = {{"translate", {4.5, 4.5, 4.5}}, {"scale", 0.5}};
  std::set<std::string> pictures;
  for (const json& scene : std::vector<json>{
           {{"volumes", {volume()}}},
           {{"volumes", {volume(), volume({{"transform", moved}})}}},
           {{"volumes", {volume({{"transform", small}})}}},
           {{"volumes", {volume({{"look", {{"density", 0.1}}}})}}},
           {{"effects", {effect()}}},
           {{"effects", {effect({{"effect", "effect 1"}})}}},
           {{"effects", {effect({{"look", {{"density", 0.1}}}})}}},
           {{"effects", {effect({{"begin", -1}})}}},
           {{"volumes", {volume()}}, {"effects", {effect(), effect({{"effect", "effect 1"}, {"transform", moved}})}}},
       }) {
    EXPECT_TRUE(pictures.insert(picture(scene, "--time 1.5")).second) << scene << " is like another";
  }
}

// A transform is where the thing stands: the camera that moves along sees the same.
TEST_F(Scene, TransformsAreOfTheWholeThing) {
  const json still = sceneOf({{"volumes", {volume()}}, {"effects", {effect()}}});
  json moved = sceneOf({{"volumes", {volume({{"transform", {{"translate", {64, 0, 0}}}}})}},
                        {"effects", {effect({{"transform", {{"translate", {73, 8, 9}}}}})}}});
  moved["camera"]["eye"] = {73, 9, 24};
  moved["camera"]["target"] = {73, 9, 9};
  const std::string at = "--time 1.5 -o '" + (folder_ / "p.png") + "'";
  ASSERT_EQ(render(still, at).code, 0);
  const std::string first = readFile(folder_ / "p.png");
  ASSERT_EQ(render(moved, at).code, 0);
  EXPECT_EQ(first, readFile(folder_ / "p.png"));
}

TEST_F(Scene, TransformsCanBeSaidInTwoWays) {
  const json said = {{"scale", 0.5}, {"rotate", {{"axis", {0, 0, 2}}, {"degrees", 90}}}, {"translate", {14, 4, 5}}};
  const json matrix = {{"matrix", {{0, -0.5, 0, 14}, {0.5, 0, 0, 4}, {0, 0, 0.5, 5}}}};
  const auto scene = [](const json& transform) {
    return json{{"volumes", {volume({{"transform", transform}})}}, {"effects", {effect({{"transform", transform}})}}};
  };
  EXPECT_EQ(picture(scene(said), "--time 1.5"), picture(scene(matrix), "--time 1.5"));
}

TEST_F(Scene, VolumesShowTheFrameOfTheTime) {
  const auto at = [&](const json& members, const std::string& when) {
    return picture({{"volumes", {volume(members)}}}, when);
  };
  const auto frame = [&](int number) { return at({{"frame", number}}, "--frame 0"); };
  const std::string frames[] = {frame(7), frame(8), frame(9), frame(10)};
  EXPECT_NE(frames[0], frames[1]);
  EXPECT_EQ(at({}, "--frame 0"), frames[0]);
  EXPECT_EQ(at({}, "--frame 2"), frames[2]);
  EXPECT_EQ(at({}, "--time 0.05"), frames[1]);
  EXPECT_EQ(at({}, "--frame 50"), frames[3]);
  EXPECT_EQ(at({{"after", "loop"}}, "--frame 6"), frames[2]);
  EXPECT_EQ(at({{"begin", -0.125}, {"after", "vanish"}}, "--frame 0"), frames[3]);
  EXPECT_EQ(at({{"begin", 1}}, "--frame 25"), frames[1]);
  EXPECT_EQ(at({{"framesPerSecond", 12}}, "--frame 3"), frames[1]);
  const std::string nothing = at({{"begin", 1}}, "--frame 0");
  EXPECT_EQ(at({{"after", "vanish"}}, "--frame 4"), nothing);
  for (const std::string& shown : frames) EXPECT_NE(shown, nothing);
  EXPECT_EQ(picture({{"volumes", {volume()}}, {"framesPerSecond", 12}}, "--frame 1"), frames[2]);
}

TEST_F(Scene, RangesAreNumberedAndOptionsOverride) {
  const json scene = sceneOf({{"volumes", {volume({{"look", {{"density", 0.2}, {"albedo", {1, 0, 0}}}}})}}});
  const auto draw = [&](const std::string& options) {
    EXPECT_EQ(render(scene, options + " -o '" + (folder_ / "r.png") + "'").code, 0) << options;
  };
  draw("--frame 1-2");
  const std::string one = readFile(folder_ / "r_0001.png");
  EXPECT_NE(one, readFile(folder_ / "r_0002.png"));
  draw("--frame 1 --density 3");
  const std::string dense = readFile(folder_ / "r.png");
  EXPECT_NE(dense, one);
  draw("--frame 1 --albedo 0,0,1");
  EXPECT_NE(readFile(folder_ / "r.png"), one);
  draw("--frame 1 --method direct");
  EXPECT_EQ(readFile(folder_ / "r.png").substr(1, 3), "PNG");
}

// Documents of which the schema and the command must think alike; the first are sound.
std::vector<std::pair<json, std::string>> documents() {
  const json volume = {{"pack", "smoke.blw"}};
  const json effect = {{"pack", "balls.blw"}, {"effect", "effect 0"}};
  const auto volumes = [&](json members) {
    members.update(volume);
    return json{{"volumes", {members}}};
  };
  const auto effects = [&](json members) {
    members.update(effect);
    return json{{"effects", {members}}};
  };
  const auto placed = [&](const json& transform) { return volumes({{"transform", transform}}); };
  const json flat = {{1, 0, 0, 0}, {0, 1, 0, 0}};
  return {
      {volumes({{"transform", {{"scale", {1, -2, 3}}, {"translate", {1, 2, 3}}}}, {"look", {{"fire", 2}}}}), ""},
      {effects({{"begin", -3}, {"transform", {{"scale", 2}}}, {"look", {{"fire", 0}}}}), ""},
      {{{"pack", "smoke.blw"}, {"look", {{"ambient", {1, 1, 1}}}}}, ""},
      {{{"volumes", {volume}}, {"look", {{"anisotropy", 0.1}}}}, ""},
      {{{"volumes", json::array()}}, "volumes is []"},
      {{{"volumes", json(9, volume)}}, "at most 8 volumes"},
      {{{"volumes", {volume}}, {"pack", "smoke.blw"}}, "pack is \"smoke.blw\"; expected none beside"},
      {{{"pack", "smoke.blw"}, {"framesPerSecond", 12}}, "framesPerSecond is 12"},
      {{{"effects", {effect}}, {"framesPerSecond", 0}}, "framesPerSecond is 0"},
      {{{"effects", {{{"pack", "balls.blw"}}}}}, "effects[0].effect is missing"},
      {{{"volumes", {{{"volume", "smoke"}}}}}, "volumes[0].pack is missing"},
      {volumes({{"effect", "effect 0"}}), "volumes[0].effect is not known"},
      {effects({{"volume", "smoke"}}), "effects[0].volume is not known"},
      {effects({{"look", {{"albedo", {1, 1, 1}}}}}), "effects[0].look.albedo is not known"},
      {volumes({{"look", {{"ambient", {1, 1, 1}}}}}), "volumes[0].look.ambient is [1,1,1]; expected none here"},
      {volumes({{"frame", 7}, {"begin", 1}}), "volumes[0].frame is 7; expected either it or \"begin\""},
      {volumes({{"frame", 7.5}}), "volumes[0].frame is 7.5"},
      {volumes({{"begin", 1e7}}), "volumes[0].begin is 1"},
      {volumes({{"after", "stop"}}), "volumes[0].after is \"stop\"; expected \"hold\" or \"loop\" or \"vanish\""},
      {placed({{"scale", 0}}), "volumes[0].transform.scale is 0"},
      {placed({{"scale", {1, 2}}}), "volumes[0].transform.scale is [1,2]"},
      {placed({{"scale", {1, 1e-9, 1}}}), "volumes[0].transform.scale[1] is 1e-09"},
      {placed({{"rotate", {{"axis", {0, 1, 0}}}}}), "volumes[0].transform.rotate.degrees is missing"},
      {placed({{"turn", 90}}), "volumes[0].transform.turn is not known"},
      {placed({{"matrix", flat}}), "volumes[0].transform.matrix is"},
      {placed({{"matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1}}}}), "volumes[0].transform.matrix[2] is [0,0,1]"},
      {placed({{"matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}, {"scale", 2}}), "either a matrix or \"scale\""},
  };
}

TEST_F(Scene, TheCommandSaysWhatIsWrongWhere) {
  for (const auto& [document, named] : documents()) {
    // What is sound by itself is refused for what the command line lacks.
    if (named.empty()) {
      expectRefused(document, "--size", 1, "--frame 7 --size 0x0");
    } else {
      expectRefused(document, named);
    }
  }
}

TEST_F(Scene, TheSchemaThinksAlike) {
  if (std::system("python3 -c 'import jsonschema' 2>/dev/null") != 0) GTEST_SKIP() << "python3-jsonschema is not there";
  json all = json::array();
  for (const auto& [document, named] : documents()) all.push_back({document, named.empty()});
  std::ofstream(folder_ / "all.json") << all.dump();
  const CommandResult result = shell(
      "python3 -c '\nimport json, sys, jsonschema\nschema = json.load(open(sys.argv[1]))\n"
      "jsonschema.Draft202012Validator.check_schema(schema)\n"
      "check = jsonschema.Draft202012Validator(schema)\n"
      "for document, sound in json.load(open(sys.argv[2])):\n"
      "  if check.is_valid(document) != sound: print(document)\n' '" +
      std::string(BILLOW_SOURCE_DIR) + "/spec/scene.schema.json' '" + (folder_ / "all.json") + "'");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "");
}

// From its packs, as quickstart.sh makes them.
TEST_F(Scene, TheSampleIsDrawn) {
  const std::string samples = std::string(BILLOW_SOURCE_DIR) + "/samples/";
  ASSERT_EQ(billow("compile '" + sampleFire() + "' --effort 0 -o '" + (folder_ / "fire.blw") + "'").code, 0);
  ASSERT_EQ(billow("compile '" + samples + "effects/'*.effect.json -o '" + (folder_ / "effects.blw") + "'").code, 0);
  std::string text = readFile(samples + "scenes/campfire.scene.json");
  for (std::size_t at = text.find("../../out/"); at != std::string::npos; at = text.find("../../out/")) {
    text.erase(at, 10);
  }
  std::ofstream(folder_ / "sample.scene.json") << text;
  const std::string line =
      "render '" + (folder_ / "sample.scene.json") + "' --frame 5 --size 32x18 --voxel-size 0.1 -o ";
  const CommandResult result = billow(line + "'" + (folder_ / "sample.png") + "'");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(readFile(folder_ / "sample.png").substr(1, 3), "PNG");
}

// What only the packs or whole numbers can tell.
TEST_F(Scene, WhatIsNotThereOrCannotBe) {
  const auto matrix = [](const json& rows) { return json{{"transform", {{"matrix", rows}}}}; };
  expectRefused({{"volumes", {volume(matrix({{1, 1, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}}))}}},
                "volumes[0].transform.matrix is");
  expectRefused({{"volumes", {volume(matrix({{0, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}))}}}, "of column 0 is 0");
  expectRefused({{"volumes", {volume({{"transform", {{"rotate", {{"axis", {0, 0, 0}}, {"degrees", 9}}}}}})}}},
                "volumes[0].transform.rotate.axis is [0,0,0]");
  for (const json& scale : {json{1, 2, 1}, json(-1)}) {
    expectRefused({{"effects", {effect({{"transform", {{"scale", scale}}}})}}},
                  "effects[0].transform is {\"scale\":" + scale.dump() + "}; expected the same scale");
  }
  expectRefused({{"volumes", {volume(), {{"pack", "none.blw"}}}}}, "scene.json: volumes[1]: ", 2);
  expectRefused({{"volumes", {{{"pack", "scene.json"}}}}}, "volumes[0]: ", 3);
  expectRefused({{"volumes", {volume({{"volume", "fog"}})}}}, "no volume \"fog\"; there is: smoke");
  expectRefused({{"volumes", {volume({{"grids", {{"extinction", "soot"}}}})}}}, "it has density");
  expectRefused({{"volumes", {volume({{"frame", 3}})}}}, "no frame 3");
  expectRefused({{"volumes", {{{"pack", "balls.blw"}}}}}, "no volumes");
  expectRefused({{"effects", {effect({{"effect", "effect 2"}})}}}, "there is: effect 0, effect 1");
  expectRefused({{"effects", {{{"pack", "smoke.blw"}, {"effect", "smoke"}}}}}, "there is: none");
  expectRefused({{"pack", "smoke.blw"}, {"volume", "fog"}}, "no volume \"fog\"", 3, "--frame 7");
}

TEST_F(Scene, TheCommandLineMayNotSayWhatTheSceneSays) {
  const json scene = {{"volumes", {volume()}}, {"effects", {effect()}}};
  expectRefused(scene, "--volume", 1, "--frame 0 --volume smoke");
  expectRefused(scene, "--effect", 1, "--frame 0 --effect 'effect 0'");
  expectRefused(scene, "--frame or --time", 1, "");
  expectRefused(scene, "--frame or --time", 1, "--frame 0 --time 1");
  expectRefused(scene, "at most 100000", 1, "--frame 0-2000000000");
  expectRefused(scene, "draws one volume where it lies; here are 1 of them and 1 effects", 1,
                "--frame 0 --method direct");
  expectRefused({{"volumes", {volume({{"transform", {{"scale", 2}}}})}}}, "has a transform", 1,
                "--frame 0 --method direct");
  expectRefused({{"volumes", {volume({{"begin", 1}})}}}, "no frame shows", 3, "--frame 0 --method direct");
  std::filesystem::create_hard_link(folder_ / "balls.blw", folder_ / "balls.png");
  EXPECT_EQ(render(scene, "--frame 0 -o '" + (folder_ / "balls.png") + "'").code, 1);
}

}  // namespace
}  // namespace billow::tests
