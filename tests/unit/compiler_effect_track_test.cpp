// Motion in small steps, and how it is stored.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "effect/simulate.h"
#include "effect_document.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::bake;
using tests::readDocument;
using tests::smallest;

json whirling() {
  json document = smallest();
  document["emitters"][0]["velocity"] = json::parse(R"({"speed": [1, 2], "spread": 40})");
  document["emitters"][0]["forces"] = json::parse(R"({"gravity": [0, -1, 0], "drag": 0.8, "wind": [1, 0, 0],
                                                      "curlNoise": {"speed": 0, "frequency": 0.7}})");
  return document;
}

// Without whirls, the steps must arrive where the closed form does.
TEST(EffectTracks, SimulationAgreesWithTheClosedForm) {
  json document = whirling();
  document["emitters"][0]["tracks"] = {{"framesPerSecond", 60}, {"error", 0.001}};
  format::EffectTables tables = bake(document).effects;
  for (const double time : {0.05, 0.5, 0.777, 1.5, 2.4}) {
    const auto sampled = format::particlesAt(tables, 0, time);
    tables.emitters[0].track = format::kNoTrack;
    const auto exact = format::particlesAt(tables, 0, time);
    tables.emitters[0].track = 0;
    ASSERT_EQ(sampled.size(), exact.size());
    ASSERT_FALSE(sampled.empty());
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_EQ(sampled[i].seed, exact[i].seed);
      for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(sampled[i].center[a], exact[i].center[a], 0.005f) << time;
    }
  }
}

TEST(EffectTracks, PlacesKeepTheErrorAskedFor) {
  json document = whirling();
  document["emitters"][0]["forces"]["curlNoise"]["speed"] = 3;
  const EffectDescription effect = readDocument(document);
  const format::EffectTables tables = bake(document).effects;
  const auto births = format::birthsOf(tables, tables.effects[0], 0);
  const TrackPoints points = simulate(births, effect.emitters[0], "test");
  ASSERT_EQ(points.size(), tables.trackPoints.size());
  double worst = 0;
  std::size_t count = 0;
  for (std::size_t f = 0; f < points.size(); ++f) {
    ASSERT_EQ(points[f].size(), tables.trackPoints[f].size());
    for (std::size_t i = 0; i < points[f].size(); ++i, ++count) {
      EXPECT_EQ(points[f][i].number, tables.trackPoints[f][i].number);
      double square = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double off = static_cast<double>(points[f][i].position[a] - tables.trackPoints[f][i].position[a]);
        square += off * off;
      }
      worst = std::max(worst, std::sqrt(square));
    }
  }
  EXPECT_GT(count, 200u);
  EXPECT_LE(worst, effect.emitters[0].trackError * 1.0001);
  EXPECT_GT(worst, effect.emitters[0].trackError * 0.05);
}

TEST(EffectTracks, WhirlsDoNotGatherAndAttractorsDo) {
  const auto extent = [](const json& document) {
    const auto particles = format::particlesAt(bake(document).effects, 0, 1.99);
    double sum = 0;
    for (const format::Particle& p : particles) {
      sum += static_cast<double>(p.center[0] * p.center[0] + p.center[1] * p.center[1] + p.center[2] * p.center[2]);
    }
    return std::sqrt(sum / static_cast<double>(particles.size()));
  };
  json still = smallest();
  still["emitters"][0]["shape"] = json::parse(R"({"type": "box", "halfSides": [4, 4, 4]})");
  still["emitters"][0]["rate"] = 300;
  json whirls = still, pulled = still;
  whirls["emitters"][0]["forces"] = json::parse(R"({"drag": 5, "curlNoise": {"speed": 2, "frequency": 0.5}})");
  pulled["emitters"][0]["forces"] =
      json::parse(R"({"drag": 1, "attractor": {"position": [0, 0, 0], "strength": 20, "radius": 2}})");
  const double before = extent(still);
  EXPECT_NEAR(extent(whirls) / before, 1, 0.15);
  EXPECT_LT(extent(pulled), 0.85 * before);
}

TEST(EffectTracks, TheirSizeIsLimited) {
  json document = whirling();
  document["emitters"][0]["rate"] = 4000;
  document["emitters"][0]["tracks"] = {{"framesPerSecond", 240}};
  document["emitters"][0]["lifetime"] = 8;
  try {
    bake(document);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("emitters[0]: its track would have"), std::string::npos) << error.what();
  }
  document["emitters"][0]["rate"] = 10;
  document["emitters"][0]["tracks"] = {{"error", 1e-6}};
  document["emitters"][0]["velocity"]["speed"] = 1000;
  EXPECT_THROW(bake(document), Error);
}

}  // namespace
}  // namespace billow
