// Effect descriptions: what is refused and how, what becomes of the rest.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "effect/black_body.h"
#include "effect_document.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::bake;
using tests::EffectFile;
using tests::readDocument;
using tests::smallest;

// ---- What is refused

struct Refusal {
  const char* pointer;   // where `value` is put; as in JSON pointers
  const char* value;     // JSON, or "" to take the member away
  const char* expected;  // in the message
};

TEST(EffectSchema, RefusalsNamePlaceValueAndWhatWasExpected) {
  const Refusal refusals[] = {
      {"/name", "", "name is missing"},
      {"/name", "\"\"", "name is \"\""},
      {"/duration", "0", "duration is 0"},
      {"/duration", "1e9", "3600"},
      {"/seed", "-1", "seed is -1"},
      {"/loop", "1", "loop is 1"},
      {"/prewarm", "true", "\"loop\": true beside it"},
      {"/emiters", "[]", "emitters"},
      {"/emitters", "[]", "emitters is []"},
      {"/emitters/0/rate", "-1", "emitters[0].rate is -1"},
      {"/emitters/0/rate", "[[0, 1], [0, 2]]", "emitters[0].rate[1][0] is 0"},
      {"/emitters/0/rate", "[[0, 1], [3, 2]]", "emitters[0].rate[1][0] is 3"},
      {"/emitters/0/rate", "[[0, 1, 2]]", "emitters[0].rate[0]"},
      {"/emitters/0/rate", "1e6", "1048576 particles in one run"},
      {"/emitters/0/rate", "0", "at least one particle"},
      {"/emitters/0/rates", "1", "rate"},
      {"/emitters/0/bursts", "[{\"time\": 5, \"count\": 1}]", "emitters[0].bursts[0].time is 5"},
      {"/emitters/0/bursts", "[{\"time\": 0, \"count\": 0}]", "emitters[0].bursts[0].count is 0"},
      {"/emitters/0/bursts", "[{\"time\": 0, \"count\": 70000}]", "at most 65536"},
      {"/emitters/0/lifetime", "601", "emitters[0].lifetime is 601"},
      {"/emitters/0/lifetime", "[2, 1]", "the smaller number first"},
      {"/emitters/0/lifetime", "0", "emitters[0].lifetime is 0"},
      {"/emitters/0/shape", "{\"type\": \"torus\"}", "emitters[0].shape.type is \"torus\""},
      {"/emitters/0/shape", "{\"type\": \"mesh\"}", "emitters[0].shape.file is missing"},
      {"/emitters/0/shape", "{\"type\": \"box\", \"radius\": 1}", "radius"},
      {"/emitters/0/velocity", "{\"speed\": 1, \"direction\": [0, 0, 0]}", "emitters[0].velocity.direction is [0,0,0]"},
      {"/emitters/0/velocity", "{\"speed\": 1, \"direction\": \"normal\"}", "a shape of type \"mesh\" beside it"},
      {"/emitters/0/velocity", "{\"speed\": 1, \"spread\": 181}", "emitters[0].velocity.spread is 181"},
      {"/emitters/0/forces", "{\"wind\": [1, 0, 0]}", "a drag above 0"},
      {"/emitters/0/forces", "{\"drag\": \"much\"}", "emitters[0].forces.drag is \"much\""},
      {"/emitters/0/forces", "{\"curlNoise\": {\"speed\": 1, \"frequency\": 1}}", "a drag above 0"},
      {"/emitters/0/forces", "{\"drag\": 1, \"curlNoise\": {\"speed\": 1}}", "curlNoise.frequency is missing"},
      {"/emitters/0/forces", "{\"attractor\": {\"position\": [0, 0, 0], \"strength\": 1, \"radius\": 0}}",
       "attractor.radius is 0"},
      {"/emitters/0/forces", "{\"vortex\": {}}", "vortex"},
      {"/emitters/0/tracks", "{\"error\": 0.1}", "other motion needs no track"},
      {"/emitters/0/primitive/kind", "\"cube\"", "primitive.kind is \"cube\""},
      {"/emitters/0/primitive/kind", "\"box\"", "\"proportions\""},
      {"/emitters/0/primitive/proportions", "[1, 1, 1]", "no proportions of a sphere"},
      {"/emitters/0/primitive/radius", "-1", "primitive.radius is -1"},
      {"/emitters/0/primitive/density/extinction", "", "density.extinction is missing"},
      {"/emitters/0/primitive/density/profile", "\"soft\"", "density.profile is \"soft\""},
      {"/emitters/0/primitive/density/profile", "[[0, 2]]", "density.profile[0][1] is 2"},
      {"/emitters/0/primitive/diffuse", "{\"colour\": [1, 2, 0]}", "diffuse.colour[1] is 2"},
      {"/emitters/0/primitive/diffuse", "{\"ramp\": [{\"age\": 0}]}", "diffuse.ramp[0]"},
      {"/emitters/0/primitive/emission", "{}", "emission.strength is missing"},
      {"/emitters/0/primitive/emission", "{\"strength\": 1, \"temperature\": 20}", "emission.temperature is 20"},
      {"/emitters/0/primitive/displacement", "{\"amount\": 1}", "displacement.amount is 1"},
      {"/emitters/0/primitive/displacement", "{\"amount\": 0.5, \"noise\": {\"kind\": \"perlin\"}}",
       "noise.kind is \"perlin\""},
      {"/emitters/0/primitive/displacement",
       "{\"amount\": 0.5, \"noise\": {\"kind\": \"fbm\", \"framesPerSecond\": 2}}", "2 or more frames"},
  };
  ASSERT_NO_THROW(readDocument(smallest()));
  for (const Refusal& refusal : refusals) {
    json document = smallest();
    const json::json_pointer pointer(refusal.pointer);
    if (*refusal.value == 0) {
      document[pointer.parent_pointer()].erase(pointer.back());
    } else {
      document[pointer] = json::parse(refusal.value);
    }
    try {
      readDocument(document);
      ADD_FAILURE() << refusal.pointer << " " << refusal.value << " passed";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      const std::string message = error.what();
      EXPECT_NE(message.find(refusal.expected), std::string::npos) << refusal.pointer << " gave " << message;
      EXPECT_NE(message.find(".effect.json: "), std::string::npos) << message;
    }
  }
}

TEST(EffectSchema, TooManyAliveAreCounted) {
  json document = smallest();
  document["loop"] = true;
  document["emitters"][0]["rate"] = 1000;
  document["emitters"][0]["lifetime"] = 100;
  try {
    readDocument(document);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("10000"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("at most 65536"), std::string::npos) << error.what();
  }
}

TEST(EffectSchema, MissingAndBrokenFiles) {
  EXPECT_THROW(
      try { readEffect("/nowhere.effect.json"); } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::file);
        throw;
      },
      Error);
  EXPECT_THROW(readEffect(EffectFile("{ \"name\": ").path()), Error);
}

// ---- What is baked

TEST(EffectBake, RateCurvesLoseNoParticle) {
  json document = smallest();
  document["emitters"][0]["rate"] = json::parse("[[0.2, 0], [1, 37], [1.5, 3]]");
  const EffectDescription effect = readDocument(document);
  const auto& spans = effect.emitters[0].spans;
  std::uint32_t born = 0;
  for (const format::SpawnSpan& span : spans) {
    EXPECT_EQ(span.first, born);
    born += span.count;
  }
  EXPECT_EQ(born, std::lround(0.8 * 37 / 2 + 0.5 * 20 + 0.5 * 3));
  EXPECT_GE(spans.front().begin, 0.19f);
}

TEST(EffectBake, CurvesAndRampsAreSampled) {
  json document = smallest();
  json& primitive = document["emitters"][0]["primitive"];
  primitive["density"]["opacity"] = json::parse("[[0, 0], [1, 63]]");
  primitive["diffuse"] = json::parse(R"({"ramp": [{"age": 0, "stops": [[0, [0, 0, 0]], [1, [1, 0, 0]]]},
                                                   {"age": 1, "stops": [[0, [0, 1, 0]]]}]})");
  primitive["emission"] = json::parse(R"({"strength": [[0, 2], [1, 0]], "colour": [1, 0.5, 0]})");
  const format::PackTables tables = bake(document);
  const format::EmitterRecord& emitter = tables.effects.emitters[0];
  ASSERT_NE(emitter.opacityRow, format::kNoRow);
  for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
    EXPECT_NEAR(tables.effects.curves[emitter.opacityRow].values[i], static_cast<float>(i), 1e-4f);
    EXPECT_NEAR(tables.effects.curves[emitter.emissionRow + 1].values[i], 1 - static_cast<float>(i) / 63, 1e-5f);
  }
  const format::RampTable& ramp = tables.effects.ramps[tables.effects.materials[0].diffuseRamp];
  EXPECT_EQ(ramp.values[0][31][0], 1);
  EXPECT_NEAR(ramp.values[5][31][1], 1.0f / 3, 1e-6f);
  EXPECT_EQ(emitter.radiusRow, format::kNoRow);
}

TEST(EffectBake, EqualThingsAreStoredOnce) {
  json document = smallest();
  json& emitters = document["emitters"];
  emitters[0]["primitive"]["radiusOverLife"] = json::parse("[[0, 0], [1, 1]]");
  emitters[0]["primitive"]["displacement"] = json::parse(R"({"amount": 0.3, "noise": {"kind": "fbm"}})");
  emitters.push_back(emitters[0]);
  emitters[1]["name"] = "more puffs";
  const format::PackTables tables = bake(document);
  EXPECT_EQ(tables.effects.materials.size(), 1u);
  EXPECT_EQ(tables.effects.curves.size(), 1u);
  EXPECT_EQ(tables.effects.maps.size(), 1u);
}

TEST(EffectBake, HeatHasItsColours) {
  const auto candle = blackBody(1900), day = blackBody(6500), blue = blackBody(15000);
  EXPECT_GT(candle[0], 2 * candle[1]);
  EXPECT_GT(candle[1], 2 * candle[2]);
  EXPECT_NEAR(day[1] / day[0], 1, 0.08);
  EXPECT_NEAR(day[2] / day[0], 1, 0.08);
  EXPECT_GT(blue[2], blue[0]);
  EXPECT_GT(largest(day), 100 * largest(candle));
}

}  // namespace
}  // namespace billow
