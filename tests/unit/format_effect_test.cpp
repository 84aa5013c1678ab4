// Motion, birth and shape of particles.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cmath>
#include <numbers>
#include <random>

#include "billow/format/exact_math.h"
#include "billow/format/noise.h"
#include "billow/format/particle_field.h"
#include "effect_tables.h"

namespace billow {
namespace {

using namespace format;
using tests::plainEffect;
using Vec3 = std::array<double, 3>;

// ---- Exact functions

TEST(ExactMath, AgreesWithTheLibrary) {
  for (int i = 0; i <= 4000; ++i) {
    const double x = i * 0.01;
    EXPECT_NEAR(decay(x) / std::exp(-x), 1, 1e-14) << x;
    EXPECT_NEAR(decayMean(x) * x, -std::expm1(-x), 1e-13) << x;
    EXPECT_NEAR(decayMeanSlope(x) * x * x, x + std::expm1(-x), 1e-13) << x;
    const double turns = i * 0.003 - 6;
    EXPECT_NEAR(sineCosine(turns).sine, std::sin(turns * 2 * std::numbers::pi), 1e-13) << turns;
    EXPECT_NEAR(sineCosine(turns).cosine, std::cos(turns * 2 * std::numbers::pi), 1e-13) << turns;
    const SineCosine angle = sineCosine(turns);
    EXPECT_NEAR(std::remainder(turnsOf(3 * angle.sine, 3 * angle.cosine) - turns, 1), 0, 1e-14) << turns;
    EXPECT_NEAR(cubeRoot(i / 4000.0), std::cbrt(i / 4000.0), 1e-12);
  }
  EXPECT_EQ(decayMean(0), 1);
  EXPECT_EQ(decayMeanSlope(0), 0.5);
  EXPECT_EQ(decay(1e9), 0);
  EXPECT_EQ(turnsOf(0, 0), 0);
  EXPECT_EQ(decayMean(1e9), 1e-9);
}

// ---- Motion

struct Forces {
  Vec3 gravity, wind;
  double drag;
};

// dv/dt = g + k (wind - v), by the classical Runge-Kutta method.
void integrate(Vec3& x, Vec3& v, const Forces& forces, double time) {
  constexpr int kSteps = 4000;
  const double h = time / kSteps;
  for (int s = 0; s < kSteps; ++s) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = [&](double speed) { return forces.gravity[i] + forces.drag * (forces.wind[i] - speed); };
      const double a1 = a(v[i]), v2 = v[i] + h / 2 * a1, a2 = a(v2), v3 = v[i] + h / 2 * a2, a3 = a(v3);
      const double v4 = v[i] + h * a3;
      x[i] += h / 6 * (v[i] + 2 * v2 + 2 * v3 + v4);
      v[i] += h / 6 * (a1 + 2 * a2 + 2 * a3 + a(v4));
    }
  }
}

TEST(Particles, MoveAsSmallStepsDo) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-10, 10);
  for (const float drag : {0.0f, 1e-6f, 0.01f, 0.2f, 1.0f, 6.0f}) {
    EffectTables tables = plainEffect();
    EmitterRecord& emitter = tables.emitters[0];
    tables.spans[0] = {0, 0, 0, 1};
    Forces forces{};
    for (std::size_t i = 0; i < 3; ++i) {
      forces.gravity[i] = static_cast<double>(emitter.gravity[i] = any(random));
      forces.wind[i] = static_cast<double>(emitter.wind[i] = any(random));
    }
    forces.drag = static_cast<double>(emitter.drag = drag);
    emitter.lifetime[0] = emitter.lifetime[1] = 5;
    emitter.speed[0] = emitter.speed[1] = 3;
    for (const double time : {0.0, 0.01, 0.7, 3.0, 4.9}) {
      const auto particles = particlesAt(tables, 0, time);
      ASSERT_EQ(particles.size(), 1u);
      Vec3 x{0, 0, 0}, v{0, 3, 0};
      integrate(x, v, forces, time);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(static_cast<double>(particles[0].center[i]), x[i], 1e-5 * (1 + std::abs(x[i]))) << drag << time;
      }
    }
  }
}

// ---- Birth

TEST(Particles, AreAsManyAsTheRateSays) {
  const EffectTables tables = plainEffect();  // 10 a second, each for 2 s
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 1).size()), 10, 1);
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 3).size()), 20, 1);
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 5).size()), 10, 1);
  EXPECT_TRUE(particlesAt(tables, 0, 6.001).empty());
  EXPECT_TRUE(particlesAt(tables, 0, -1).empty());
  EXPECT_TRUE(particlesAt(tables, 0, std::nan("")).empty());
}

TEST(Particles, LoopsRepeatWithOtherParticles) {
  EffectTables tables = plainEffect();
  tables.emitters[0].speed[1] = 1;
  tables.effects[0].flags = kEffectLoop;
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 0.5).size()), 5, 1);
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 400.5).size()), 20, 1);
  tables.effects[0].flags = kEffectLoop | kEffectPrewarm;
  EXPECT_NEAR(static_cast<double>(particlesAt(tables, 0, 0.5).size()), 20, 1);
  const auto now = particlesAt(tables, 0, 3), later = particlesAt(tables, 0, 7);
  EXPECT_NE(now[0].seed, later[0].seed);
}

TEST(Particles, KeepTheirCourse) {
  EffectTables tables = plainEffect();
  tables.effects[0].flags = kEffectLoop;
  tables.emitters[0].speed[0] = tables.emitters[0].speed[1] = 1;
  const auto now = particlesAt(tables, 0, 10), next = particlesAt(tables, 0, 10.25);
  std::size_t followed = 0;
  for (const Particle& before : now) {
    for (const Particle& after : next) {
      if (before.seed != after.seed) continue;
      ++followed;
      EXPECT_NEAR(after.center[1] - before.center[1], 0.25f, 1e-5f);
      EXPECT_NEAR(after.age - before.age, 0.125f, 1e-5f);
    }
  }
  EXPECT_GE(followed, 16u);
}

TEST(Particles, AreNeverMoreThanTheBound) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> share(0, 1);
  for (int round = 0; round < 300; ++round) {
    EffectTables tables = plainEffect();
    EffectRecord& effect = tables.effects[0];
    effect.seed = static_cast<std::uint32_t>(random());
    effect.duration = 0.05f + 3 * share(random);
    effect.flags = round % 3 == 0 ? 0 : round % 3 == 1 ? kEffectLoop : kEffectLoop | kEffectPrewarm;
    EmitterRecord& emitter = tables.emitters[0];
    emitter.lifetime[1] = 0.01f + 4 * share(random);
    emitter.lifetime[0] = emitter.lifetime[1] * (round % 2 == 0 ? 1 : share(random));
    tables.spans.clear();
    std::uint32_t born = 0;
    for (int s = 0; s < 1 + round % 5; ++s) {
      const float a = share(random) * effect.duration, b = round % 7 == 0 ? a : share(random) * effect.duration;
      tables.spans.push_back({std::min(a, b), std::max(a, b), born, 1 + static_cast<std::uint32_t>(random() % 20)});
      born += tables.spans.back().count;
    }
    emitter.spanCount = static_cast<std::uint32_t>(tables.spans.size());
    const std::uint64_t bound = mostAlive(tables, effect);
    std::size_t most = 0;
    for (int i = 0; i < 60; ++i) {
      most = std::max(most, particlesAt(tables, 0, static_cast<double>(share(random) * 9)).size());
    }
    EXPECT_LE(most, bound) << round;
    // Two too many a span and a run that meets the window.
    const double runs = std::floor(static_cast<double>(emitter.lifetime[1] / effect.duration)) + 2;
    EXPECT_LE(bound, static_cast<std::uint64_t>(runs) * born) << round;
  }
}

TEST(Particles, AreBornInTheirShapes) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.spans[0] = {0, 0, 0, 2000};
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::sphere);
  emitter.extent[0] = 2;
  emitter.extent[1] = 0.5f;
  Vec3 sum{};
  for (const Particle& p : particlesAt(tables, 0, 0)) {
    const float r = std::sqrt(p.center[0] * p.center[0] + p.center[1] * p.center[1] + p.center[2] * p.center[2]);
    EXPECT_LE(r, 2.0001f);
    EXPECT_GE(r, 0.9999f);
    for (std::size_t i = 0; i < 3; ++i) sum[i] += static_cast<double>(p.center[i]) / 2000;
  }
  for (const double middle : sum) EXPECT_NEAR(middle, 0, 0.1);
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::box);
  emitter.extent[2] = 3;
  float widest = 0;
  for (const Particle& p : particlesAt(tables, 0, 0)) {
    EXPECT_LE(std::abs(p.center[1]), 0.5f);
    widest = std::max(widest, std::abs(p.center[2]));
  }
  EXPECT_NEAR(widest, 3, 0.05f);
}

// Every point is as likely as another; its particle is born there.
TEST(Particles, AreBornOnPointsOfASurface) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.spans[0] = {0, 0, 0, 8000};
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::mesh);
  emitter.extent[0] = 1;
  emitter.extent[1] = 2;
  emitter.position[0] = 10;
  emitter.firstPoint = 1;
  emitter.pointCount = 4;
  tables.surfacePoints.resize(6);
  for (std::int16_t i = 0; i < 6; ++i) tables.surfacePoints[static_cast<std::size_t>(i)].place[0] = i;
  tables.surfacePoints[2].place[1] = -32768;
  std::array<int, 6> born{};
  for (const Particle& p : particlesAt(tables, 0, 0)) {
    const auto point = static_cast<std::size_t>(std::lround((p.center[0] - 10) * 32767));
    ASSERT_LT(point, 6u);
    ++born[point];
    EXPECT_EQ(p.center[1], point == 2 ? -2.0f : 0.0f);
    EXPECT_EQ(p.center[2], 0.0f);
  }
  EXPECT_EQ(born[0] + born[5], 0);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_NEAR(born[i], 2000, 150) << i;  // four deviations
}

// The octahedron's corners, faces and folded edges; then all patterns have length 1.
TEST(Particles, SetOutAlongNormals) {
  EXPECT_EQ(normalOf({{}, {0, 0}}), (Vec3{0, 0, 1}));
  EXPECT_EQ(normalOf({{}, {127, 0}}), (Vec3{1, 0, 0}));
  EXPECT_EQ(normalOf({{}, {0, -128}}), (Vec3{0, -1, 0}));
  for (const int corner : {-127, 127}) {
    EXPECT_EQ(normalOf({{}, {static_cast<std::int8_t>(corner), 127}}), (Vec3{0, 0, -1}));
  }
  for (int pattern = 0; pattern < 65536; ++pattern) {
    const Vec3 n = normalOf({{}, {static_cast<std::int8_t>(pattern & 255), static_cast<std::int8_t>(pattern >> 8)}});
    ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-12) << pattern;
  }
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.spans[0] = {0, 0, 0, 200};
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::mesh);
  emitter.pointCount = 1;
  emitter.speed[0] = emitter.speed[1] = 3;
  emitter.spreadCosine = 0.9f;
  tables.surfacePoints = {{{}, {0, -127}}};
  for (const std::uint32_t flags : {0u, kEmitterNormal}) {
    emitter.flags = flags;
    const float up = flags == 0 ? 1.0f : -1.0f;  // `direction`, or the normal
    for (const Particle& p : particlesAt(tables, 0, 1)) {
      EXPECT_GE(p.center[1] * up, 0.8999f * 3);
      EXPECT_NEAR(p.center[0] * p.center[0] + p.center[1] * p.center[1] + p.center[2] * p.center[2], 9, 1e-3f);
    }
  }
}

TEST(Particles, SpreadFillsItsCone) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.spans[0] = {0, 0, 0, 2000};
  emitter.spreadCosine = 0.5f;
  emitter.speed[0] = emitter.speed[1] = 1;
  double least = 1, sum = 0;
  for (const Particle& p : particlesAt(tables, 0, 1)) {
    least = std::min(least, static_cast<double>(p.center[1]));
    sum += static_cast<double>(p.center[1]);
  }
  EXPECT_GE(least, 0.4999);
  EXPECT_NEAR(sum / 2000, 0.75, 0.02);  // uniform over the cap: the height is uniform
}

TEST(Particles, InheritTheEmittersVelocity) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.curves.resize(3);
  for (std::uint32_t i = 0; i < kCurveSamples; ++i) {
    tables.curves[0].values[i] = 8 * static_cast<float>(i) / (kCurveSamples - 1);  // 2 units a second
  }
  emitter.positionRow = 0;
  emitter.inheritance = 0.5f;
  tables.spans[0] = {1, 1, 0, 1};
  const auto particles = particlesAt(tables, 0, 2.5);
  ASSERT_EQ(particles.size(), 1u);
  EXPECT_NEAR(particles[0].center[0], 2 + 1.5f, 1e-4f);
}

TEST(Particles, AlignedOnesLieAlongTheirVelocity) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  tables.spans[0] = {0, 0, 0, 100};
  emitter.flags = kEmitterAlign | kEmitterRandomStart;
  emitter.spreadCosine = -1;
  emitter.speed[0] = emitter.speed[1] = 1;
  for (const Particle& p : particlesAt(tables, 0, 1)) {  // they have gone 1 unit from the origin
    const float x = p.rotation[0], y = p.rotation[1], z = p.rotation[2], w = p.rotation[3];
    EXPECT_NEAR(x * x + y * y + z * z + w * w, 1, 1e-5f);
    EXPECT_NEAR(1 - 2 * (y * y + z * z), p.center[0], 1e-5f);
    EXPECT_NEAR(2 * (x * y + w * z), p.center[1], 1e-5f);
    EXPECT_NEAR(2 * (x * z - w * y), p.center[2], 1e-5f);
  }
}

// What `extract` writes rests on these bits: another compiler, machine or build must give the same.
TEST(Particles, HaveTheSameBitsEverywhere) {
  EffectTables tables = plainEffect();
  EmitterRecord& emitter = tables.emitters[0];
  emitter.spreadCosine = 0.3f;
  emitter.speed[1] = 3;
  emitter.drag = 0.7f;
  emitter.gravity[1] = -9.81f;
  emitter.shape = static_cast<std::uint32_t>(EmitterShape::sphere);
  emitter.extent[0] = 1;
  emitter.flags = kEmitterRandomStart;
  tables.effects[0].flags = kEffectLoop;
  const auto particles = particlesAt(tables, 0, 123.4);
  EXPECT_EQ(XXH3_64bits(particles.data(), particles.size() * sizeof(Particle)), 5282702975499632248u);
}

// ---- Shape

Particle unitParticle(std::uint32_t kind) {
  Particle particle{};
  particle.radius = 2;
  particle.rotation[3] = 1;
  particle.kind = kind;
  particle.map = kNoMap;
  particle.extinction = 1;
  return particle;
}

TEST(ParticleField, KindsHaveTheirShapes) {
  const EffectTables tables = plainEffect();
  const ParticleField field(tables);
  const auto inside = [&](const Particle& p, float x, float y, float z) {
    return field.sample(p, {x, y, z}).density > 0;
  };
  const Particle sphere = unitParticle(kKindSphere);
  EXPECT_EQ(field.sample(sphere, {0, 0, 0}).density, 1);
  EXPECT_TRUE(inside(sphere, 1.1f, 1.1f, 1.1f));
  EXPECT_FALSE(inside(sphere, 1.2f, 1.2f, 1.2f));
  Particle ellipsoid = unitParticle(kKindEllipsoid);
  ellipsoid.shape[0] = 2;
  ellipsoid.shape[1] = ellipsoid.shape[2] = 1;
  EXPECT_TRUE(inside(ellipsoid, 1.9f, 0, 0));
  EXPECT_FALSE(inside(ellipsoid, 0, 1.1f, 0));
  ellipsoid.rotation[2] = ellipsoid.rotation[3] = std::sqrt(0.5f);  // a quarter turn about z: long along y
  EXPECT_TRUE(inside(ellipsoid, 0, 1.9f, 0));
  EXPECT_FALSE(inside(ellipsoid, 1.1f, 0, 0));
  Particle capsule = unitParticle(kKindCapsule);
  capsule.shape[0] = 1.5f;
  EXPECT_TRUE(inside(capsule, 1.95f, 0, 0));
  EXPECT_TRUE(inside(capsule, 1.0f, 0.45f, 0));
  EXPECT_FALSE(inside(capsule, 1.0f, 0.55f, 0));
  Particle box = unitParticle(kKindBox);
  box.shape[0] = box.shape[1] = box.shape[2] = 1;
  EXPECT_TRUE(inside(box, 0.9f, -0.9f, 0.9f));
  EXPECT_FALSE(inside(box, 0, 1.1f, 0));
}

// The same value, in 255ths, in all directions.
CubeMap evenMap(std::uint8_t value) {
  CubeMap map{};
  for (std::size_t b = 0; b < kCubeBytes; b += kBc4Bytes) map.blocks[b] = map.blocks[b + 1] = std::byte{value};
  return map;
}

TEST(ParticleField, MapsPushTheSurfaceInward) {
  EffectTables tables = plainEffect();
  tables.maps.push_back(evenMap(51));  // 0.2
  const ParticleField field(tables);
  Particle particle = unitParticle(kKindSphere);
  particle.map = 0;
  particle.displacement = 0.5f;  // surface at 2 * (1 - 0.5 * 0.8) = 1.2
  EXPECT_GT(field.sample(particle, {0, 1.19f, 0}).density, 0);
  EXPECT_EQ(field.sample(particle, {0, 1.21f, 0}).density, 0);
}

TEST(ParticleField, BetweenTwoMapsTheSurfaceIsBetweenTheirs) {
  EffectTables tables = plainEffect();
  tables.maps = {evenMap(0), evenMap(51), evenMap(255)};
  const ParticleField field(tables);
  Particle particle = unitParticle(kKindSphere);
  particle.displacement = 0.5f;
  particle.map = 1u | 2u << 16;
  for (const float share : {0.0f, 0.25f, 0.5f, 0.999f, 1.0f}) {
    particle.kind = kindWithShare(kKindSphere, share);
    const float surface = 2 * (1 - 0.5f * (1 - (0.2f + 0.8f * share)));
    EXPECT_GT(field.sample(particle, {0, surface - 0.001f, 0}).density, 0) << share;
    EXPECT_EQ(field.sample(particle, {0, surface + 0.001f, 0}).density, 0) << share;
  }
}

// Over a whole circle of maps, forward and backward, density changes no faster than the maps differ.
TEST(ParticleField, MapsOfAnEmitterChangeSmoothly) {
  for (const float speed : {1.5f, -1.5f}) {
    EffectTables tables = plainEffect();
    tables.maps = {evenMap(200), evenMap(0), evenMap(255), evenMap(100)};
    tables.spans[0] = {0, 0, 0, 1};
    tables.materials[0].softness = 1;
    EmitterRecord& emitter = tables.emitters[0];
    emitter.mapCount = 3;
    emitter.firstMap = 1;
    emitter.mapsPerSecond = speed;
    emitter.displacement = 0.5f;
    const ParticleField field(tables);
    constexpr double kStep = 0.001;
    double before = -1, least = 1, most = 0;
    for (double time = 0; time < 1.999; time += kStep) {
      const auto particles = particlesAt(tables, 0, time);
      ASSERT_EQ(particles.size(), 1u);
      EXPECT_GE(firstMapIn(particles[0].map), 1u);
      EXPECT_GE(secondMapIn(particles[0].map), 1u);
      const double density = static_cast<double>(field.sample(particles[0], {0.4f, 0, 0}).density);
      // r = 0.4 / (0.5 + m / 2), so |dr / dm| is at most 0.8, and m changes by at most 1.5 a second.
      const double change = before >= 0 ? std::abs(density - before) : 0;
      EXPECT_LE(change, 0.8 * 1.5 * kStep + 1e-5) << time;
      before = density;
      least = std::min(least, density);
      most = std::max(most, density);
    }
    EXPECT_NEAR(least, 1 - 0.4 / 0.5, 0.01) << "the darkest map was passed";
    EXPECT_NEAR(most, 1 - 0.4, 0.01) << "the brightest map was passed";
  }
}

TEST(ParticleField, ProfilesRampsAndErosion) {
  EffectTables tables = plainEffect();
  ParticleMaterial& material = tables.materials[0];
  Particle particle = unitParticle(kKindSphere);
  particle.diffuse[0] = particle.emission[1] = 1;
  particle.age = 0.5f;
  material.profile = kProfileRadial;
  EXPECT_NEAR(ParticleField(tables).sample(particle, {1, 0, 0}).density, 0.75f, 1e-6f);
  material.softness = 1;
  EXPECT_NEAR(ParticleField(tables).sample(particle, {1, 0, 0}).density, 0.375f, 1e-6f);
  tables.ramps.emplace_back();
  for (auto& row : tables.ramps[0].values) {
    for (std::uint32_t i = 0; i < kRampRadii; ++i) row[i][0] = row[i][1] = static_cast<float>(i) / (kRampRadii - 1);
  }
  material.diffuseRamp = material.emissionRamp = 0;
  const ParticleSample sample = ParticleField(tables).sample(particle, {0, 1, 0});
  EXPECT_NEAR(sample.diffuse[0], 0.5f, 1e-6f);
  EXPECT_NEAR(sample.emission[1], 0.5f * 0.375f, 1e-6f);
  material.erosion = 1;
  material.erosionFrequency = 3;
  const float eroded = ParticleField(tables).sample(particle, {0, 1, 0}).density;
  EXPECT_NEAR(eroded, 0.375f * erosionNoise(0, 1.5f, 0, particle.seed), 1e-6f);
}

// ---- Cube maps

TEST(CubeMap, DirectionsAndPointsAgree) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    const std::array<float, 3> direction{any(random), any(random), any(random)};
    const CubePoint point = cubePoint(direction);
    ASSERT_LT(point.face, kCubeFaces);
    const auto back = cubeDirection(point);
    const float scale = std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(back[a] * scale, direction[a], 1e-5f);
  }
  EXPECT_EQ(cubePoint({0, 0, 2}).face, 4u);
  EXPECT_EQ(cubePoint({0, -1, 0}).face, 3u);
}

TEST(CubeMap, BlocksAreThoseOfTheStandard) {
  std::array<std::byte, 8> block{std::byte{210}, std::byte{70}};
  block[2] = std::byte{0b10001000};  // texels 0, 1: indices 0, 1; 2: the low two bits 2
  std::array<float, 16> texels{};
  decodeBc4(block, texels);
  EXPECT_FLOAT_EQ(texels[0], 210.0f / 255);
  EXPECT_FLOAT_EQ(texels[1], 70.0f / 255);
  EXPECT_FLOAT_EQ(texels[2], (6 * 210.0f + 70) / 7 / 255);
  std::swap(block[0], block[1]);
  block[2] = std::byte{0b00110111};  // indices 7, 6
  decodeBc4(block, texels);
  EXPECT_FLOAT_EQ(texels[0], 1);
  EXPECT_FLOAT_EQ(texels[1], 0);
}

// Across an edge of the cube nothing jumps.
TEST(CubeMap, EdgesAreSeamless) {
  CubeMap map{};
  std::mt19937 random(9);
  for (std::byte& byte : map.blocks) byte = static_cast<std::byte>(random() & 255);
  const DecodedCube cube(map);
  for (float y = -0.95f; y < 0.95f; y += 0.0137f) {
    EXPECT_NEAR(cube.sample({1, y, 0.9999f}), cube.sample({0.9999f, y, 1}), 0.02f);
    EXPECT_NEAR(cube.sample({y, -1, 0.9999f}), cube.sample({y, -0.9999f, 1}), 0.02f);
    EXPECT_NEAR(cube.sample({-1, y, -0.9999f}), cube.sample({-0.9999f, y, -1}), 0.02f);
  }
}

}  // namespace
}  // namespace billow
