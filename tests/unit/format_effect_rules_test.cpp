// What makes an effect's tables unsound, and that no bytes do harm.
#include <draco/compression/expert_encode.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "billow/format/pack.h"
#include "billow/format/particle_field.h"
#include "billow/format/validate.h"
#include "effect_tables.h"
#include "pack_image.h"

namespace billow {
namespace {

using namespace format;
using tests::packTables;

std::vector<std::byte> trackFrame(const std::vector<TrackPoint>& points, const std::vector<float>& radii = {}) {
  draco::PointCloudBuilder builder;
  builder.Start(static_cast<std::uint32_t>(points.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int number = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_UINT32);
  const int radius = radii.empty() ? -1 : builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_FLOAT32);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (!radii.empty()) builder.SetAttributeValueForPoint(radius, draco::PointIndex(i), &radii[i]);
    builder.SetAttributeValueForPoint(position, draco::PointIndex(i), points[i].position);
    builder.SetAttributeValueForPoint(number, draco::PointIndex(i), &points[i].number);
  }
  const auto cloud = builder.Finalize(false);
  draco::ExpertEncoder encoder(*cloud);
  encoder.SetAttributeQuantization(position, 12);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeToBuffer(&buffer).ok());
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return {first, first + buffer.size()};
}

void addFrame(EffectTables& tables, const std::vector<TrackPoint>& points, const std::vector<float>& radii) {
  const std::vector<std::byte> bytes = points.empty() ? std::vector<std::byte>() : trackFrame(points, radii);
  tables.trackFrames.push_back(
      {tables.trackBytes.size(), static_cast<std::uint32_t>(bytes.size()), static_cast<std::uint32_t>(points.size())});
  tables.trackBytes.insert(tables.trackBytes.end(), bytes.begin(), bytes.end());
}

// The last frame again, with other radii.
void replaceLastFrame(EffectTables& tables, const std::vector<float>& radii) {
  tables.trackBytes.resize(tables.trackFrames.back().offset);
  tables.trackFrames.pop_back();
  addFrame(tables, {{0, {1, 2, 3}}, {1, {4, 5, 6}}}, radii);
}

// An emitter of two given particles.
void addGiven(EffectTables& tables) {
  EmitterRecord emitter = tests::plainEmitter();
  emitter.firstSpan = static_cast<std::uint32_t>(tables.spans.size());
  emitter.spanCount = 0;
  emitter.givenCount = 2;
  emitter.track = static_cast<std::uint32_t>(tables.tracks.size());
  ++tables.effects.back().emitterCount;
  tables.emitters.push_back(emitter);
  tables.given.push_back({0.25f, 0.5f, 0, 1, 1, {1, 1, 1}, 17, 0});
  tables.given.push_back({0.5f, 2, 0.5f, 4, 3, {1, 0.5f, 0}, 5, 0});
  tables.tracks.push_back({static_cast<std::uint32_t>(tables.trackFrames.size()), 3, 4, kTrackRadii});
  addFrame(tables, {}, {});
  addFrame(tables, {{0, {0, 2, 3}}}, {1});
  addFrame(tables, {{0, {1, 2, 3}}, {1, {4, 5, 6}}}, {0.5f, 1});
}

// Two effects that use everything there is.
EffectTables fullEffects() {
  EffectTables tables = tests::plainEffect();
  tables.curves.resize(4);
  tables.ramps.resize(1);
  tables.maps.resize(2);
  tables.materials.push_back({kProfileCurve, 3, 0, 0, 0.5f, 2, 0.5f, 0.5f});
  EffectRecord effect{};
  effect.firstEmitter = 1;
  effect.emitterCount = 1;
  effect.duration = 1;
  effect.flags = kEffectLoop | kEffectPrewarm;
  tables.effects.push_back(effect);
  EmitterRecord emitter = tests::plainEmitter();
  emitter.firstSpan = 1;
  emitter.spanCount = 2;
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::sphere);
  emitter.extent[0] = 1;
  emitter.positionRow = emitter.diffuseRow = emitter.emissionRow = 0;
  emitter.radiusRow = emitter.opacityRow = emitter.rotationRow = emitter.displacementRow = 3;
  emitter.displacement = 0.5f;
  emitter.firstMap = 0;
  emitter.mapCount = 2;
  emitter.mapsPerSecond = 3;
  emitter.material = 1;
  emitter.kind = kKindBox;
  std::fill_n(emitter.proportions, 3, 0.5f);
  tables.emitters.push_back(emitter);
  tables.spans.push_back({0, 0.5f, 0, 10});
  tables.spans.push_back({0.75f, 0.75f, 10, 5});
  tables.tracks.push_back({0, 3, 30, 0});
  tables.emitters[1].track = 0;
  for (std::uint32_t f = 0; f < 3; ++f) {
    std::vector<TrackPoint> points;
    for (std::uint32_t i = 0; i < 3; ++i) points.push_back({i * 2, {static_cast<float>(f + i), 1, 2}});
    addFrame(tables, points, {});
  }
  tables.emitters[0].shape = static_cast<std::uint32_t>(EmitterShape::mesh);
  tables.emitters[0].flags = kEmitterNormal;
  std::fill_n(tables.emitters[0].extent, 3, 2.0f);
  tables.emitters[0].pointCount = 3;
  tables.surfacePoints = {{{0, 0, 0}, {0, 0}}, {{32767, -32767, -32768}, {127, -128}}, {{1, 2, 3}, {-100, 90}}};
  addGiven(tables);
  for (CurveRow& row : tables.curves) std::fill_n(row.values, kCurveSamples, 0.5f);
  return tables;
}

std::vector<std::byte> packBytes(EffectTables effects) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("billow_effects_" + std::to_string(::getpid()) + ".blw")).string();
  {
    PackWriter::Options options;
    options.effects = true;
    PackWriter writer(path, options);
    writer.finish(packTables(std::move(effects)));
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
  std::filesystem::remove(path);
  const auto* first = reinterpret_cast<const std::byte*>(chars.data());
  return {first, first + chars.size()};
}

std::vector<int> issueIds(const std::vector<std::byte>& bytes) {
  std::vector<int> ids;
  validate(*makeMemorySource(bytes), {}, [&](const Issue& issue) { ids.push_back(issue.kind->id); });
  return ids;
}

TEST(EffectRules, SoundOnesComeBackAsTheyWere) {
  const EffectTables tables = packTables(fullEffects()).effects;
  const std::vector<std::byte> bytes = packBytes(fullEffects());
  EXPECT_EQ(issueIds(bytes), std::vector<int>{});
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  ASSERT_TRUE(pack);
  const auto same = [](const auto& a, const auto& b) {
    const auto x = std::as_bytes(std::span(a)), y = std::as_bytes(std::span(b));
    return std::equal(x.begin(), x.end(), y.begin(), y.end());
  };
  EXPECT_TRUE(same(pack->effects().effects, tables.effects));
  EXPECT_TRUE(same(pack->effects().emitters, tables.emitters));
  EXPECT_TRUE(same(pack->effects().spans, tables.spans));
  EXPECT_TRUE(same(pack->effects().materials, tables.materials));
  EXPECT_TRUE(same(pack->effects().curves, tables.curves));
  EXPECT_TRUE(same(pack->effects().ramps, tables.ramps));
  EXPECT_TRUE(same(pack->effects().maps, tables.maps));
  EXPECT_TRUE(same(pack->effects().tracks, tables.tracks));
  EXPECT_TRUE(same(pack->effects().trackFrames, tables.trackFrames));
  EXPECT_TRUE(same(pack->effects().surfacePoints, tables.surfacePoints));
  ASSERT_EQ(pack->effects().trackPoints.size(), 6u);
  EXPECT_EQ(pack->effects().trackPoints[1][2].number, 4u);
  EXPECT_NEAR(pack->effects().trackPoints[1][2].position[0], 3, 1e-3f);
  EXPECT_TRUE(same(pack->effects().given, tables.given));
  ASSERT_EQ(pack->effects().trackRadii.size(), 6u);
  EXPECT_TRUE(pack->effects().trackRadii[2].empty());
  EXPECT_EQ(pack->effects().trackRadii[5], (std::vector<float>{0.5f, 1}));
  EXPECT_EQ(pack->string(pack->effects().effects[1].name), "effect 1");
  EXPECT_FALSE(particlesAt(pack->effects(), 1, 0.9).empty());
}

struct Fault {
  int rule;
  std::function<void(EffectTables&)> change;
};

TEST(EffectRules, EveryBrokenRuleIsTold) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Fault> faults = {
      {701, [](EffectTables& t) { t.effects[1].firstEmitter = 0; }},
      {701, [](EffectTables& t) { t.effects[1].emitterCount = 3; }},
      {701, [](EffectTables& t) { t.effects[1].emitterCount = 0xffffffff; }},
      {701, [](EffectTables& t) { t.effects.pop_back(); }},
      {701, [](EffectTables& t) { t.emitters[0].spanCount = 0; }},
      {701, [](EffectTables& t) { t.emitters[1].spanCount = 3; }},
      {701, [](EffectTables& t) { t.spans.emplace_back(); }},
      {702, [](EffectTables& t) { t.effects[0].flags = kEffectPrewarm; }},
      {702, [](EffectTables& t) { t.effects[0].flags = 4; }},
      {702, [](EffectTables& t) { t.effects[0].duration = t.spans[0].end = 0; }},
      {702, [](EffectTables& t) { t.effects[0].duration = 3601; }},
      {703, [](EffectTables& t) { t.spans[0].count = 140000; }},
      {704, [](EffectTables& t) { t.emitters[0].flags = 8; }},
      {704, [](EffectTables& t) { t.emitters[1].flags = kEmitterNormal; }},
      {704, [](EffectTables& t) { t.emitters[1].shape = 4; }},
      {704, [](EffectTables& t) { t.emitters[0].extent[2] = kNan; }},
      {704, [](EffectTables& t) { t.emitters[0].kind = 4; }},
      {704, [](EffectTables& t) { t.emitters[1].extent[1] = 1.5f; }},
      {704, [](EffectTables& t) { t.emitters[0].position[2] = kNan; }},
      {704, [](EffectTables& t) { t.emitters[0].inheritance = 11; }},
      {704, [](EffectTables& t) { t.emitters[0].lifetime[0] = 0; }},
      {704, [](EffectTables& t) { t.emitters[0].lifetime[1] = 1; }},
      {704, [](EffectTables& t) { t.emitters[0].lifetime[1] = 601; }},
      {704, [](EffectTables& t) { t.emitters[0].direction[1] = 2; }},
      {704, [](EffectTables& t) { t.emitters[0].spreadCosine = 1.5f; }},
      {704, [](EffectTables& t) { t.emitters[0].speed[1] = -1; }},
      {704, [](EffectTables& t) { t.emitters[0].gravity[0] = 1e7f; }},
      {704, [](EffectTables& t) { t.emitters[0].drag = -1; }},
      {704, [](EffectTables& t) { t.emitters[0].wind[0] = kNan; }},
      {704, [](EffectTables& t) { t.emitters[0].radius[0] = -1; }},
      {704, [](EffectTables& t) { t.emitters[0].proportions[0] = 2; }},
      {704, [](EffectTables& t) { t.emitters[0].extinction = -1; }},
      {704, [](EffectTables& t) { t.emitters[0].diffuse[0] = 1.5f; }},
      {704, [](EffectTables& t) { t.emitters[0].emission[0] = -1; }},
      {704, [](EffectTables& t) { t.emitters[0].axis[0] = 0.5f; }},
      {704, [](EffectTables& t) { t.emitters[0].displacement = 1; }},
      {704, [](EffectTables& t) { t.emitters[0].mapsPerSecond = kNan; }},
      {705, [](EffectTables& t) { t.spans[0].end = 5; }},
      {705, [](EffectTables& t) { t.spans[0].begin = kNan; }},
      {705, [](EffectTables& t) { t.spans[2].first = 9; }},
      {705, [](EffectTables& t) { t.spans[2].count = 0; }},
      {705, [](EffectTables& t) { t.spans[0].count = kMaxCycleParticles + 1; }},
      {706, [](EffectTables& t) { t.emitters[0].radiusRow = 4; }},
      {706, [](EffectTables& t) { t.emitters[0].diffuseRow = 2; }},
      {706, [](EffectTables& t) { t.emitters[0].positionRow = 0xfffffffe; }},
      {706, [](EffectTables& t) { t.emitters[0].firstMap = 0; }},
      {706, [](EffectTables& t) { t.emitters[1].mapCount = 3; }},
      {706, [](EffectTables& t) { t.emitters[0].mapCount = 1; }},
      {706, [](EffectTables& t) { t.emitters[0].material = 2; }},
      {706, [](EffectTables& t) { t.materials[0].diffuseRamp = 1; }},
      {707, [](EffectTables& t) { t.materials[0].profile = 3; }},
      {707, [](EffectTables& t) { t.materials[0].profileRow = 0; }},
      {707, [](EffectTables& t) { t.materials[1].profileRow = 4; }},
      {708, [](EffectTables& t) { t.materials[0].softness = 0; }},
      {708, [](EffectTables& t) { t.materials[0].erosion = kNan; }},
      {708, [](EffectTables& t) { t.materials[0].erosionFrequency = 2000; }},
      {708, [](EffectTables& t) { t.materials[0].occlusion = -1; }},
      {709, [](EffectTables& t) { t.curves[0].values[63] = kNan; }},
      {709, [](EffectTables& t) { t.ramps[0].values[15][31][3] = -1; }},
      {706, [](EffectTables& t) { t.emitters[0].track = 2; }},
      {710, [](EffectTables& t) { t.tracks[0].frameCount = 2; }},
      {710, [](EffectTables& t) { t.tracks[0].framesPerSecond = kNan; }},
      {710, [](EffectTables& t) { t.tracks[0].flags = 2; }},
      {710, [](EffectTables& t) { t.tracks.pop_back(), t.emitters[2].track = 0; }},
      {710, [](EffectTables& t) { t.trackFrames[1].offset = 1; }},
      {710, [](EffectTables& t) { t.trackFrames[0].count = kMaxTrackPoints + 1; }},
      {710, [](EffectTables& t) { t.trackBytes.push_back({}); }},
      {711, [](EffectTables& t) { t.trackFrames[0].count = 1; }},
      {711, [](EffectTables& t) { t.trackBytes[0] = std::byte{'X'}; }},
      {714, [](EffectTables& t) { t.emitters[0].pointCount = 0; }},
      {714, [](EffectTables& t) { t.emitters[0].pointCount = 4; }},
      {714, [](EffectTables& t) { t.emitters[0].firstPoint = 1; }},
      {714, [](EffectTables& t) { t.emitters[0].firstPoint = 0xffffffff; }},
      {714, [](EffectTables& t) { t.surfacePoints.resize(t.emitters[0].pointCount = kMaxSurfacePoints + 1); }},
      {714, [](EffectTables& t) { t.surfacePoints.clear(); }},
      {714, [](EffectTables& t) { t.emitters[1].firstPoint = 1; }},
      {714, [](EffectTables& t) { t.emitters[1].pointCount = 1; }},
      {215, [](EffectTables& t) { t.effects[0].reserved[4] = 1; }},
      {215, [](EffectTables& t) { t.emitters[0].reserved[2] = 1; }},
      {215, [](EffectTables& t) { t.given[1].reserved = 1; }},
      {701,
       [](EffectTables& t) {
         t.emitters[2].spanCount = 1, t.spans.push_back({0, 1, 0, 1});
       }},
      {701, [](EffectTables& t) { t.emitters[2].givenCount = 0, t.given.clear(); }},
      {711, [](EffectTables& t) { t.tracks[1].flags = 0; }},
      {712, [](EffectTables& t) { t.emitters[1].track = 1; }},  // radii that it has no particles for
      {711,
       [](EffectTables& t) {
         replaceLastFrame(t, {2.5f, 1});
       }},
      {711,
       [](EffectTables& t) {
         replaceLastFrame(t, {-1, 1});
       }},
      {711, [](EffectTables& t) { replaceLastFrame(t, {}); }},
      {712, [](EffectTables& t) { t.emitters[2].track = kNoTrack; }},
      {712, [](EffectTables& t) { t.emitters[2].firstGiven = 1; }},
      {712, [](EffectTables& t) { t.emitters[2].givenCount = 3; }},
      {712, [](EffectTables& t) { t.emitters[2].givenCount = 0xffffffff; }},
      {712, [](EffectTables& t) { t.emitters[0].firstGiven = 1; }},
      {712, [](EffectTables& t) { t.given.emplace_back(); }},
      {713, [](EffectTables& t) { t.given[1].time = 0.1f; }},
      {713, [](EffectTables& t) { t.given[1].time = 1.5f; }},
      {713, [](EffectTables& t) { t.given[0].time = kNan; }},
      {713, [](EffectTables& t) { t.given[0].lifetime = 0; }},
      {713, [](EffectTables& t) { t.given[0].lifetime = 3; }},
      {713, [](EffectTables& t) { t.given[0].age = -1; }},
      {713, [](EffectTables& t) { t.given[0].life = 0; }},
      {713, [](EffectTables& t) { t.given[0].radius = kNan; }},
      {713, [](EffectTables& t) { t.given[0].colour[2] = 2; }},
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    EffectTables tables = fullEffects();
    faults[i].change(tables);
    const std::vector<std::byte> bytes = packBytes(tables);
    std::vector<int> ids = issueIds(bytes);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());  // of several frames each may tell
    EXPECT_EQ(ids, std::vector<int>{faults[i].rule}) << "fault " << i;
    const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
    ASSERT_FALSE(pack) << "fault " << i;
    EXPECT_EQ(pack.error().kind->id, faults[i].rule);
  }
}

void use(const EffectTables& tables) {
  const ParticleField field(tables);
  for (std::uint32_t e = 0; e < tables.effects.size(); ++e) {
    const double duration = static_cast<double>(tables.effects[e].duration);
    for (const double time : {0.0, 0.3 * duration, duration, 1e5}) {
      const auto particles = particlesAt(tables, e, time);
      ASSERT_LE(particles.size(), kMaxAlive);
      for (std::size_t p = 0; p < particles.size(); p += 1 + particles.size() / 16) {
        const Particle& particle = particles[p];
        ASSERT_TRUE(std::isfinite(particle.center[0] + particle.center[1] + particle.center[2]));
        std::array<float, 3> point{};
        for (std::size_t i = 0; i < 3; ++i) point[i] = particle.center[i] + 0.3f * particle.radius;
        const ParticleSample sample = field.sample(particle, point);
        ASSERT_GE(sample.density, 0);
        ASSERT_LE(sample.density, 1);
      }
    }
  }
}

// Bytes of the effects' sections changed at random, checksums made right: what opens can be used.
TEST(EffectRules, WhatOpensDoesNoHarm) {
  const std::vector<std::byte> sound = packBytes(fullEffects());
  const Result<Pack> pack = Pack::open(makeMemorySource(sound));
  ASSERT_TRUE(pack);
  std::mt19937 random(17);
  int opened = 0;
  for (int round = 0; round < 4000; ++round) {
    std::vector<std::byte> bytes = sound;
    constexpr std::size_t kSections[] = {8, 9, 10, 11, 12, 15, 15, 16, 17, 18, 18, 19};  // without ramps and maps
    const SectionEntry& section = pack->sections()[kSections[random() % std::size(kSections)]];
    for (int i = 0; i < 1 + round % 3; ++i) {
      bytes[section.offset + random() % section.size] = static_cast<std::byte>(random() & 255);
    }
    tests::sealAll(bytes);
    const Result<Pack> changed = Pack::open(makeMemorySource(bytes));
    if (!changed) continue;
    ++opened;
    use(changed->effects());
  }
  EXPECT_GT(opened, 500);
}

TEST(EffectRules, SectionsOfHalfARecordAreRefused) {
  std::vector<std::byte> bytes = packBytes(fullEffects());
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  ASSERT_TRUE(pack);
  const auto& sections = pack->sections();
  ASSERT_EQ(sections.back().type, kSectionSurfaces);
  bytes.pop_back();
  tests::putAt(bytes, 64 + (sections.size() - 1) * sizeof(SectionEntry) + offsetof(SectionEntry, size),
               sections.back().size - 1);
  tests::sealAll(bytes);
  EXPECT_EQ(issueIds(bytes), (std::vector<int>{201, 714}));  // and its points are not there
}

TEST(EffectRules, TheWriterNeedsToKnowOfEffects) {
  const std::string path = (std::filesystem::temp_directory_path() / "billow_no_room.blw").string();
  PackWriter writer(path, {});
  EXPECT_THROW(writer.close(packTables(fullEffects())), std::logic_error);
}

}  // namespace
}  // namespace billow
