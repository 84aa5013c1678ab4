// Effects of several packs in one set of tables.
#include <gtest/gtest.h>

#include <cstring>

#include "billow/format/affine.h"
#include "billow/format/gather_effects.h"
#include "billow/format/particle_field.h"
#include "effect_tables.h"

namespace billow::tests {
namespace {

using namespace format;
using Point = std::array<float, 3>;

CurveRow rising(float from, float to) {
  CurveRow row{};
  for (std::uint32_t i = 0; i < kCurveSamples; ++i) {
    row.values[i] = from + (to - from) * static_cast<float>(i) / static_cast<float>(kCurveSamples - 1);
  }
  return row;
}

CubeMap mapOf(std::uint32_t seed) {
  CubeMap map{};
  for (std::size_t i = 0; i < map.blocks.size(); ++i) {
    seed = seed * 1664525 + 1013904223;
    map.blocks[i] = static_cast<std::byte>(seed >> 24);
  }
  return map;
}

// Two effects of two emitters each that use curves, ramps, maps and a track; `number` tells packs apart.
EffectTables richEffects(std::uint32_t number) {
  const float n = static_cast<float>(number);
  EffectTables tables = plainEffect();
  tables.effects.push_back(tables.effects[0]);
  tables.effects[0].emitterCount = tables.effects[1].emitterCount = 2;
  tables.effects[1].firstEmitter = 2;
  tables.effects[1].seed = 100 + number;
  for (std::uint32_t i = 0; i < 9; ++i) tables.curves.push_back(rising(0.1f * n, 0.1f * static_cast<float>(i + 1)));
  for (std::uint32_t i = 0; i < 6; ++i) tables.maps.push_back(mapOf(number * 10 + i));
  RampTable ramp{};
  ramp.values[3][5][1] = n;
  for (auto& age : ramp.values) {
    for (auto& colour : age) colour[0] = 0.25f * n;
  }
  tables.ramps = {RampTable{}, ramp};
  tables.materials.push_back({kProfileCurve, 8, 1, 1, 0.5f, 2, 0.5f, 0.3f});
  tables.emitters.resize(4, plainEmitter());
  for (std::uint32_t e = 1; e < 4; ++e) tables.emitters[e].firstSpan = e;
  for (std::uint32_t e = 1; e < 4; ++e) tables.spans.push_back({0, 4, 0, 10 * e});
  EmitterRecord& rich = tables.emitters[3];
  rich.positionRow = 0;
  rich.diffuseRow = 2;
  rich.radiusRow = 5;
  rich.opacityRow = 6;
  rich.firstMap = 2;
  rich.mapCount = 3;
  rich.displacement = 0.5f;
  rich.material = 1;
  rich.track = 1;
  tables.emitters[1].firstMap = 4;
  tables.emitters[1].mapCount = 1;
  tables.emitters[1].displacement = 0.3f;
  tables.tracks = {{0, 2, 1, 0}, {2, 3, 1, 0}};
  for (std::uint32_t f = 0; f < 5; ++f) {
    tables.trackFrames.push_back({2 * f, 2, 1});
    tables.trackBytes.resize(2 * f + 2, static_cast<std::byte>(f + number));
    tables.trackPoints.push_back({{0, {static_cast<float>(f) + n, 1, 2}}});
  }
  tables.trackRadii.resize(5);
  return tables;
}

// To the second effect, an emitter of three given particles whose radii change.
void addGiven(EffectTables& tables, std::uint32_t number) {
  EmitterRecord emitter = plainEmitter();
  emitter.firstSpan = static_cast<std::uint32_t>(tables.spans.size());
  emitter.spanCount = 0;
  emitter.firstGiven = static_cast<std::uint32_t>(tables.given.size());
  emitter.givenCount = 3;
  emitter.track = static_cast<std::uint32_t>(tables.tracks.size());
  for (std::uint32_t i = 0; i < 3; ++i) {
    tables.given.push_back({0.25f * static_cast<float>(i), 2, 0, 3, 1, {1, 0.5f, 1}, 10 * number + i, 0});
  }
  tables.tracks.push_back({static_cast<std::uint32_t>(tables.trackFrames.size()), 2, 1, kTrackRadii});
  for (std::uint32_t f = 0; f < 2; ++f) {
    tables.trackFrames.push_back({tables.trackBytes.size(), 1, 3});
    tables.trackBytes.push_back(static_cast<std::byte>(number));
    const auto at = static_cast<float>(f + number);
    tables.trackPoints.push_back({{0, {at, 1, 2}}, {1, {at, 3, 2}}, {2, {at, 5, 2}}});
    tables.trackRadii.push_back({1, 0.25f * at, 0.5f});
  }
  tables.emitters.push_back(emitter);
  ++tables.effects.back().emitterCount;
}

// The same particles, and they add the same everywhere that is looked at.
void expectSameEffect(const EffectTables& tables, std::uint32_t effect, const EffectTables& gathered,
                      std::uint32_t there) {
  const ParticleField field(tables), gatheredField(gathered);
  const auto particles = particlesAt(tables, effect, 1.5), moved = particlesAt(gathered, there, 1.5);
  ASSERT_FALSE(particles.empty());
  ASSERT_EQ(particles.size(), moved.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Particle alike = moved[i];
    alike.map = particles[i].map;
    alike.material = particles[i].material;
    ASSERT_EQ(std::memcmp(&alike, &particles[i], sizeof alike), 0) << i;
    for (const Point& away : {Point{0.1f, 0.2f, 0.3f}, Point{-0.5f, 0.2f, 0.1f}, Point{0.3f, -0.6f, -0.2f}}) {
      Point at{};
      for (std::size_t c = 0; c < 3; ++c) at[c] = particles[i].center[c] + away[c] * particles[i].radius;
      const ParticleSample a = field.sample(particles[i], at), b = gatheredField.sample(moved[i], at);
      EXPECT_EQ(a.density, b.density);
      EXPECT_EQ(a.diffuse, b.diffuse);
    }
  }
}

TEST(GatherEffects, WhatIsGatheredIsWhatThePacksHold) {
  const EffectTables a = richEffects(1), b = richEffects(2);
  GatheredEffects gathered;
  const std::uint32_t first = gathered.add(b, 1), second = gathered.add(a, 1), third = gathered.add(a, 0);
  expectSameEffect(b, 1, gathered.tables(), first);
  expectSameEffect(a, 1, gathered.tables(), second);
  expectSameEffect(a, 0, gathered.tables(), third);
}

TEST(GatherEffects, HoldsOnlyWhatIsUsedAndThatOnce) {
  const EffectTables a = richEffects(1);
  GatheredEffects gathered;
  const std::uint32_t first = gathered.add(a, 1);
  EXPECT_EQ(gathered.add(a, 1), first);
  const EffectTables& tables = gathered.tables();
  EXPECT_EQ(tables.effects.size(), 1u);
  EXPECT_EQ(tables.emitters.size(), 2u);
  EXPECT_EQ(tables.materials.size(), 2u);
  EXPECT_EQ(tables.curves.size(), 3u + 3 + 1 + 1 + 1);  // position, colour, radius, opacity, profile
  EXPECT_EQ(tables.ramps.size(), 1u);
  EXPECT_EQ(tables.maps.size(), 3u);
  ASSERT_EQ(tables.tracks.size(), 1u);
  EXPECT_EQ(tables.trackFrames.size(), 3u);
  EXPECT_EQ(tables.trackBytes.size(), 6u);
  EXPECT_EQ(tables.trackBytes[0], a.trackBytes[4]);
  gathered.add(a, 0);  // one map more, the material of the first
  EXPECT_EQ(tables.materials.size(), 2u);
  EXPECT_EQ(tables.maps.size(), 4u);
}

TEST(GatherEffects, GivenParticlesGoAlong) {
  EffectTables a = richEffects(1), b = richEffects(2);
  addGiven(a, 1);
  addGiven(b, 2);
  GatheredEffects gathered;
  const std::uint32_t none = gathered.add(a, 0), first = gathered.add(b, 1), second = gathered.add(a, 1);
  expectSameEffect(a, 0, gathered.tables(), none);
  expectSameEffect(b, 1, gathered.tables(), first);
  expectSameEffect(a, 1, gathered.tables(), second);
  gathered.add(a, 1, 0.5f, 1);  // has rows of its own
  const EffectTables& tables = gathered.tables();
  EXPECT_EQ(tables.given.size(), 9u);
  EXPECT_EQ(tables.emitters.back().firstGiven, 6u);
  EXPECT_EQ(tables.tracks.size(), 4u);  // shared
  EXPECT_EQ(tables.trackRadii.size(), tables.trackFrames.size());
  EXPECT_EQ(tables.trackRadii[4], (std::vector<float>{1, 0.75f, 0.5f}));
}

// Each with its look, and as bright as a pack's rules allow.
TEST(GatherEffects, FactorsMakeAnEffectOfItsOwn) {
  EffectTables a = richEffects(1);
  a.emitters[3].emission[2] = 2;
  GatheredEffects gathered;
  const std::uint32_t plain = gathered.add(a, 1), thin = gathered.add(a, 1, 0.5f, 3);
  EXPECT_NE(plain, thin);
  EXPECT_EQ(gathered.add(a, 1, 0.5f, 3), thin);
  const EffectTables& tables = gathered.tables();
  EXPECT_EQ(tables.maps.size(), 3u);  // shared
  const auto particles = particlesAt(tables, plain, 1.5), others = particlesAt(tables, thin, 1.5);
  ASSERT_EQ(particles.size(), others.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    EXPECT_FLOAT_EQ(others[i].extinction, particles[i].extinction * 0.5f);
    EXPECT_FLOAT_EQ(others[i].emission[2], particles[i].emission[2] * 3);
    EXPECT_EQ(others[i].seed, particles[i].seed);
  }
  const std::uint32_t bright = gathered.add(a, 1, 1e9f, 1e9f);
  EXPECT_EQ(tables.emitters[tables.effects[bright].firstEmitter + 1].emission[2], kMaxMagnitude);
}

TEST(Affine, ComposedTransformsFollowOneAnother) {
  const double outer[12] = {0, 0, 2, 10, 2, 0, 0, 20, 0, 2, 0, 30};
  const double inner[12] = {2, 0, 0, 1, 0, 3, 0, 2, 0, 0, 4, 3};
  double product[12];
  compose(outer, inner, product);
  const double expected[12] = {0, 0, 8, 16, 4, 0, 0, 22, 0, 6, 0, 34};
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(product[i], expected[i]) << i;
}

}  // namespace
}  // namespace billow::tests
