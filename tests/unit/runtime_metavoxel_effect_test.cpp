// Effects evaluated on the GPU: the CPU's particles, transformed as wholes, within the limits that a draw has.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "billow/format/similarity.h"
#include "effect_tables.h"
#include "metavoxel_fixture.h"
#include "same_particles.h"

namespace billow::tests {
namespace {

using format::EmitterRecord;
using runtime::MetavoxelEffect;

// A quarter turn about y, twice as large, far from the origin.
constexpr std::array<double, 12> kElsewhere{0, 0, 2, 10, 0, 2, 0, -3, -2, 0, 0, 5};

std::uint32_t addRow(format::EffectTables& tables, float from, float to) {
  format::CurveRow row{};
  for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
    const float t = static_cast<float>(i) / (format::kCurveSamples - 1);
    row.values[i] = from + (to - from) * t * (2 - t);
  }
  tables.curves.push_back(row);
  return static_cast<std::uint32_t>(tables.curves.size() - 1);
}

// An emitter with everything that the closed form and the looks have.
EmitterRecord everything(format::EffectTables& tables) {
  EmitterRecord emitter = plainEmitter();
  emitter.shape = format::kShapeSphere;
  emitter.extent[0] = 1.5f;
  emitter.extent[1] = 0.4f;
  emitter.position[0] = 3;
  emitter.positionRow = addRow(tables, -1, 1);
  addRow(tables, 0, 2);
  addRow(tables, 0, -1);
  emitter.inheritance = 0.5f;
  emitter.lifetime[0] = 0.5f;
  emitter.lifetime[1] = 3;
  emitter.direction[1] = 0.6f;
  emitter.direction[2] = -0.8f;
  emitter.spreadCosine = 0.3f;
  emitter.speed[0] = 1;
  emitter.speed[1] = 4;
  emitter.gravity[1] = -5;
  emitter.drag = 0.8f;
  emitter.wind[0] = 2;
  emitter.kind = format::kKindEllipsoid;
  emitter.radius[0] = 0.2f;
  emitter.radiusRow = addRow(tables, 0.1f, 1);
  const float proportions[3] = {1, 0.5f, 0.25f};
  std::copy(proportions, proportions + 3, emitter.proportions);
  emitter.opacityRow = addRow(tables, 1, 0);
  emitter.diffuseRow = addRow(tables, 0.2f, 1);
  addRow(tables, 1, 0.5f);
  addRow(tables, 0.5f, 2);
  std::fill_n(emitter.emission, 3, 7.0f);
  emitter.emissionRow = addRow(tables, 3, -1);
  addRow(tables, 2, 0);
  addRow(tables, 1, 0);
  emitter.rotationRow = addRow(tables, 0, 2.5f);
  emitter.flags = format::kEmitterRandomStart;
  emitter.displacement = 0.7f;
  emitter.displacementRow = addRow(tables, 0, 2);
  emitter.firstMap = 1;
  emitter.mapCount = 5;
  emitter.mapsPerSecond = -3.5f;
  return emitter;
}

// Particles that come from files: some appear between two frames, some are there before or after their points are, and
// all rest in the run's last half second, which has no frames. The later half end with the run.
void addGiven(EmitterRecord emitter, format::EffectTables& tables) {
  constexpr std::uint32_t kCount = 90, kFrames = 36;
  constexpr float kRate = 10;
  emitter.firstSpan = static_cast<std::uint32_t>(tables.spans.size());
  emitter.spanCount = 0;
  emitter.givenCount = kCount;
  emitter.track = static_cast<std::uint32_t>(tables.tracks.size());
  emitter.lifetime[0] = 0.5f;
  emitter.lifetime[1] = 2.5f;
  tables.emitters.push_back(emitter);
  for (std::uint32_t n = 0; n < kCount; ++n) {
    const float share = static_cast<float>(n) / kCount;
    const float time = 3.9f * share, lifetime = std::min(0.5f + 2 * share * share, 4 - time);
    tables.given.push_back(
        {time, lifetime, 0.3f * share, 2 + share, 0.5f + share, {1, share, 1 - share}, n * 2654435761u, 0});
  }
  tables.tracks.push_back({static_cast<std::uint32_t>(tables.trackFrames.size()), kFrames, kRate, format::kTrackRadii});
  for (std::uint32_t f = 0; f < kFrames; ++f) {
    tables.trackPoints.emplace_back();
    tables.trackRadii.emplace_back();
    const float time = static_cast<float>(f) / kRate;
    for (std::uint32_t n = 0; n < kCount; ++n) {
      const format::GivenParticle& given = tables.given[n];
      const float late = n % 5 == 0 ? 0.2f : 0, early = n % 7 == 0 ? 0.3f : 0;
      if (time < given.time + late || time > given.time + given.lifetime - early) continue;
      const float turn = 0.7f * time + static_cast<float>(n);
      tables.trackPoints.back().push_back({n, {4 * std::cos(turn), 2 * time, 4 * std::sin(turn)}});
      tables.trackRadii.back().push_back(0.5f + 0.4f * std::cos(turn));
    }
    tables.trackFrames.push_back({0, 0, static_cast<std::uint32_t>(tables.trackPoints.back().size())});
  }
}

// An effect with five emitters: the above; boxes along their velocity; one whose points go round in a track; one on a
// mesh, along its normals; and given particles.
format::EffectTables richEffect() {
  format::EffectTables tables;
  tables.materials = plainTables().materials;
  tables.maps.resize(6);
  format::EffectRecord effect{};
  effect.emitterCount = 5;
  effect.seed = 99;
  effect.duration = 4;
  effect.flags = format::kEffectLoop | format::kEffectPrewarm;
  tables.effects.push_back(effect);
  tables.emitters.push_back(everything(tables));
  tables.spans = {{0, 4, 0, 300}, {1, 1, 300, 40}, {2, 2.5f, 340, 60}, {0, 4, 0, 100}, {0, 0.5f, 0, 50}, {0, 4, 0, 80}};
  tables.emitters[0].spanCount = 3;
  EmitterRecord aligned = everything(tables);
  aligned.firstSpan = 3;
  aligned.shape = format::kShapeBox;
  aligned.extent[2] = 0.5f;
  aligned.flags |= format::kEmitterAlign;
  aligned.kind = format::kKindBox;
  aligned.drag = 0;
  tables.emitters.push_back(aligned);
  EmitterRecord round = aligned;
  round.firstSpan = 4;
  round.track = 0;
  round.lifetime[0] = 1;
  round.lifetime[1] = 5;
  tables.emitters.push_back(round);
  EmitterRecord mesh = aligned;
  mesh.firstSpan = 5;
  mesh.shape = format::kShapeMesh;
  mesh.flags |= format::kEmitterNormal;
  mesh.firstPoint = 2;
  mesh.pointCount = 60;
  tables.emitters.push_back(mesh);
  for (int i = 0; i < 62; ++i) {
    const auto place = static_cast<std::int16_t>(i * 1057 - 32768);
    const auto slope = static_cast<std::int8_t>(i * 4 - 128);
    tables.surfacePoints.push_back(
        {{place, static_cast<std::int16_t>(~place), place}, {slope, static_cast<std::int8_t>(i * 7)}});
  }
  tables.tracks.push_back({0, 100, 25, 0});
  tables.trackFrames.resize(100);
  tables.trackPoints.resize(100);
  tables.trackRadii.resize(100);
  for (std::uint32_t f = 0; f < 100; ++f) {
    // Some are born late, some are gone early.
    for (std::uint32_t n = f < 12 ? 50 - 4 * f : 0; n < (f > 80 ? 30u : 50u); ++n) {
      const float turn = 0.05f * static_cast<float>(f) + static_cast<float>(n);
      tables.trackPoints[f].push_back({n, {3 + 2 * std::cos(turn), 0.1f * static_cast<float>(f), 2 * std::sin(turn)}});
    }
  }
  addGiven(aligned, tables);
  return tables;
}

class MetavoxelEffects : public MetavoxelTest {
 protected:
  MetavoxelEffects() {
    config_.tables = &tables_;
    config_.maxParticles = 4096;
    draw_.width = draw_.height = 8;
    draw_.view = runtime::lookAt({0, 0, 50}, {0, 0, 100}, {0, 1, 0}, 36);  // away: only particles are asked for
  }
  // What the GPU made of the draw's particles and effects.
  std::vector<Particle> particlesOf(runtime::Metavoxels& metavoxels) {
    render(metavoxels, draw_);
    return valueOf(gpu().readParticles(*renderer_, metavoxels), "particles");
  }

  format::EffectTables tables_ = richEffect();
  MetavoxelConfig config_ = smallConfig();
  MetavoxelDraw draw_ = smallDraw();
};

TEST_F(MetavoxelEffects, AreWhatTheCpuMakesOfThem) {
  SameParticles same;
  for (const std::uint32_t flags : {format::kEffectLoop | format::kEffectPrewarm, format::kEffectLoop, 0u}) {
    tables_.effects[0].flags = flags;
    const auto made = make(config_);
    for (const double time : {0.0, 0.02, 0.9, 1.0, 2.2, 3.99, 4.0, 4.5, 6.0, 8.0, 9.3}) {
      const MetavoxelEffect effect{.effect = 0, .time = time};
      draw_.effects = {&effect, 1};
      same.expect(format::particlesAt(tables_, 0, time), particlesOf(*made));
      ASSERT_FALSE(HasFailure()) << flags << ", " << time << " s";
    }
  }
  EXPECT_GT(same.compared(), 3000u);
  EXPECT_LE(same.atEnds(), 10u);
}

// Days after an effect began its particles are as exact as in its first seconds.
TEST_F(MetavoxelEffects, AreExactAfterDays) {
  const auto made = make(config_);
  SameParticles same;
  for (const double time : {123456.789, 999999.5}) {
    const MetavoxelEffect effect{.effect = 0, .time = time};
    draw_.effects = {&effect, 1};
    same.expect(format::particlesAt(tables_, 0, time), particlesOf(*made));
  }
  EXPECT_GT(same.compared(), 300u);
}

TEST_F(MetavoxelEffects, GoWithTheirTransformsBehindTheHostsParticles) {
  const auto metavoxels = make(config_);
  const std::vector<Particle> own{ball({0, 1, 0}, 0.5f, 1)};
  const std::vector<MetavoxelEffect> effects{{.effect = 0, .time = 2},
                                             {.effect = 0, .time = 7, .objectToWorld = kElsewhere}};
  draw_.particles = own;
  draw_.effects = effects;
  draw_.center = {1000.25, 0, -77};  // their places are relative to it on the GPU
  const std::vector<Particle> all = particlesOf(*metavoxels);
  ASSERT_FALSE(all.empty());
  EXPECT_NEAR(all[0].center[1], 1, 1e-4f);
  EXPECT_EQ(all[0].radius, 0.5f);
  std::vector<Particle> expected = format::particlesAt(tables_, 0, 2);
  const format::Similarity elsewhere = format::similarityOf(kElsewhere).value();
  for (const Particle& particle : format::particlesAt(tables_, 0, 7)) {
    expected.push_back(format::transformed(particle, elsewhere));
  }
  SameParticles same({.place = 1e-4});
  same.expect(expected, {all.begin() + 1, all.end()});
  EXPECT_GT(same.compared(), 300u);
}

// A picture of an effect is that of its particles.
TEST_F(MetavoxelEffects, LookLikeTheirParticles) {
  const auto metavoxels = make(config_);
  draw_ = smallDraw();
  const MetavoxelEffect effect{.effect = 0, .time = 5.5};
  draw_.effects = {&effect, 1};
  const headless::Picture gpus = render(*metavoxels, draw_);
  const std::vector<Particle> particles = format::particlesAt(tables_, 0, effect.time);
  draw_.effects = {};
  draw_.particles = particles;
  EXPECT_GT(pictureDecibels(render(*metavoxels, draw_), gpus), 60);
  draw_.particles = {};
  EXPECT_LT(pictureDecibels(render(*metavoxels, draw_), gpus), 30) << "nothing was drawn";
}

TEST_F(MetavoxelEffects, KeepTheLimitOfParticles) {
  std::size_t most = 0;
  for (const auto& candidates : format::candidatesAt(tables_, 0, 3)) most += candidates.last - candidates.first;
  const std::vector<Particle> own{ball({0, 0, 0}, 1, 1)};
  const MetavoxelEffect effect{.effect = 0, .time = 3};
  draw_.particles = own;
  draw_.effects = {&effect, 1};
  config_.maxParticles = static_cast<std::uint32_t>(most) + 1;
  const auto enough = make(config_);
  EXPECT_EQ(particlesOf(*enough).size(), most + 1);
  config_.maxParticles = static_cast<std::uint32_t>(most);
  const auto tooFew = make(config_);
  const auto refused = gpu().render(*renderer_, *tooFew, draw_, {});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, runtime::ErrorCode::argument);
  EXPECT_NE(refused.error().message.find(std::to_string(most + 1) + " particles"), std::string::npos)
      << refused.error().message;
  gpu().waitIdle();
}

TEST_F(MetavoxelEffects, CountTheirTracksInTheBudget) {
  std::uint64_t bytes = tables_.given.size() * sizeof(format::GivenParticle);
  for (const auto& frame : tables_.trackPoints) bytes += frame.size() * (sizeof(format::TrackPoint) + sizeof(float));
  const std::uint64_t with = make(config_)->bytesAllocated();
  tables_.emitters[2].track = format::kNoTrack;
  tables_.emitters.pop_back();
  --tables_.effects[0].emitterCount;
  tables_.given.clear();
  tables_.tracks.clear();
  tables_.trackFrames.clear();
  tables_.trackPoints.clear();
  tables_.trackRadii.clear();
  EXPECT_GE(with, make(config_)->bytesAllocated() + bytes);
  EXPECT_GT(bytes, 60000u);
}

TEST_F(MetavoxelEffects, NameWhatIsWrong) {
  const auto metavoxels = make(config_);
  const auto broken = [&](const MetavoxelEffect& effect) {
    const std::vector<MetavoxelEffect> effects{{.effect = 0, .time = 1}, effect};
    draw_.effects = effects;
    const auto picture = gpu().render(*renderer_, *metavoxels, draw_, {});
    gpu().waitIdle();
    return picture ? std::string() : picture.error().message;
  };
  EXPECT_EQ(broken({.effect = 0, .time = 2}), "");
  EXPECT_EQ(broken({.effect = 0, .time = -1}), "") << "it is not there";
  EXPECT_EQ(broken({.effect = 0, .time = 1e300}), "");
  EXPECT_NE(broken({.effect = 1, .time = 2}).find("effects[1].effect"), std::string::npos);
  EXPECT_NE(broken({.effect = 0, .time = std::nan("")}).find("effects[1].time"), std::string::npos);
  EXPECT_NE(broken({.effect = 0, .time = 2, .objectToWorld = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0}})
                .find("effects[1].objectToWorld"),
            std::string::npos);
}

}  // namespace
}  // namespace billow::tests
