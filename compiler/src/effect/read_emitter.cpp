#include <fmt/format.h>

#include <cmath>
#include <string>

#include "billow/format/exact_math.h"
#include "effect/particle_files.h"
#include "effect/read.h"

namespace billow::compiler {
namespace {

using json::Range;
using json::Value;

constexpr double kMost = static_cast<double>(format::kMaxMagnitude);
constexpr Range kAny{-kMost, kMost};
constexpr Range kPositive{0, kMost};
constexpr std::size_t kMostBursts = 64;
constexpr int kRateIntervals = 63;
static_assert(kMostBursts + kRateIntervals <= format::kMaxSpans);

void readVector(const Value& value, float (&into)[3]) {
  const auto numbers = value.singles<3>(kAny);
  std::copy(numbers.begin(), numbers.end(), into);
}

// Lengths that a pack may have.
void checkExtent(const MeshShape& mesh, const Value& value) {
  for (const Triangle& triangle : mesh.triangles) {
    for (const Vertex& vertex : triangle) {
      for (std::size_t i = 0; i < 3; ++i) {
        const double place = static_cast<double>(vertex[i]) * mesh.scale[i];
        if (std::abs(place) > kMost)
          value.fail(fmt::format("a mesh within {} of its origin; it goes to {}", kMost, place));
      }
    }
  }
}

MeshShape readMeshShape(const Value& value, const std::filesystem::path& folder) {
  static constexpr Range kScale{1e-6, kMost};
  value.requireKeys({"type", "file", "scale"});
  MeshShape mesh;
  if (const auto scale = value.find("scale")) {
    if (scale->isArray()) {
      mesh.scale = scale->numbers<3>(kScale);
    } else {
      mesh.scale.fill(scale->number(kScale));
    }
  }
  mesh.triangles = readMesh((folder / value.at("file").text("a mesh *.drc, *.obj, *.gltf or *.glb")).string());
  checkExtent(mesh, value);
  return mesh;
}

void readShape(const Value& value, const std::filesystem::path& folder, EmitterDescription& emitter) {
  format::EmitterRecord& record = emitter.record;
  const std::size_t type = value.at("type").word({"point", "sphere", "box", "mesh"});
  record.shape = static_cast<std::uint32_t>(type);
  switch (static_cast<format::EmitterShape>(type)) {
    case format::EmitterShape::point:
      return value.requireKeys({"type"});
    case format::EmitterShape::sphere:
      value.requireKeys({"type", "radius", "hollow"});
      record.extent[0] = value.at("radius").single(kPositive);
      if (const auto hollow = value.find("hollow")) record.extent[1] = hollow->single({0, 1});
      return;
    case format::EmitterShape::box: {
      value.requireKeys({"type", "halfSides"});
      const auto sides = value.at("halfSides").singles<3>(kPositive);
      std::copy(sides.begin(), sides.end(), record.extent);
      return;
    }
    case format::EmitterShape::mesh:
      emitter.mesh = readMeshShape(value, folder);
  }
}

// The vector at unit length; or "normal".
void readDirection(const Value& value, format::EmitterRecord& record) {
  if (value.isString()) {
    if (value.text("a direction") != "normal") value.fail("three numbers, or \"normal\"");
    if (record.shape != static_cast<std::uint32_t>(format::EmitterShape::mesh)) {
      value.fail("a shape of type \"mesh\" beside it, which has normals");
    }
    record.flags |= format::kEmitterNormal;
    return;
  }
  const auto v = value.numbers<3>(kAny);
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(length > 1e-6)) value.fail("a direction, which is not 0");
  for (std::size_t i = 0; i < 3; ++i) record.direction[i] = static_cast<float>(v[i] / length);
}

void readVelocity(const Value& value, format::EmitterRecord& record) {
  value.requireKeys({"direction", "speed", "spread"});
  if (const auto direction = value.find("direction")) readDirection(*direction, record);
  readSpan(value.at("speed"), kAny, record.speed);
  if (const auto spread = value.find("spread")) {
    record.spreadCosine = static_cast<float>(format::sineCosine(spread->number({0, 180}) / 360).cosine);
  }
}

CurlNoise readCurlNoise(const Value& value, const format::EmitterRecord& record) {
  value.requireKeys({"speed", "frequency", "seed"});
  if (!(record.drag > 0)) value.fail("a drag above 0 beside it: without drag, wind moves nothing");
  CurlNoise noise{value.at("speed").number({0, 1000}), value.at("frequency").number({1e-4, 1000}), 0};
  if (const auto seed = value.find("seed")) noise.seed = static_cast<std::uint32_t>(seed->integer(0, 0xffffffff));
  return noise;
}

Attractor readAttractor(const Value& value) {
  value.requireKeys({"position", "strength", "radius"});
  return {value.at("position").numbers<3>(kAny), value.at("strength").number({-1000, 1000}),
          value.at("radius").number({0.001, kMost})};
}

void readTracks(const Value& value, EmitterDescription& emitter) {
  value.requireKeys({"framesPerSecond", "error"});
  if (!needsTrack(emitter)) value.fail("forces.curlNoise or forces.attractor beside it: other motion needs no track");
  if (const auto rate = value.find("framesPerSecond")) {
    emitter.trackRate =
        rate->single({static_cast<double>(format::kMinTrackRate), static_cast<double>(format::kMaxTrackRate)});
  }
  if (const auto error = value.find("error")) emitter.trackError = error->number({1e-6, kMost});
}

void readForces(const Value& value, EmitterDescription& emitter) {
  value.requireKeys({"gravity", "drag", "wind", "curlNoise", "attractor"});
  format::EmitterRecord& record = emitter.record;
  if (const auto gravity = value.find("gravity")) readVector(*gravity, record.gravity);
  if (const auto drag = value.find("drag")) record.drag = drag->single({0, static_cast<double>(format::kMaxDrag)});
  if (const auto noise = value.find("curlNoise")) emitter.curlNoise = readCurlNoise(*noise, record);
  if (const auto attractor = value.find("attractor")) emitter.attractor = readAttractor(*attractor);
  const auto wind = value.find("wind");
  if (!wind) return;
  readVector(*wind, record.wind);
  if (!(record.drag > 0)) wind->fail("a drag above 0 beside it: without drag, wind moves nothing");
}

void addSpan(double begin, double end, std::uint64_t count, EmitterDescription& emitter, const Value& cause) {
  if (count == 0) return;
  const std::uint64_t before = emitter.spans.empty() ? 0 : emitter.spans.back().first + emitter.spans.back().count;
  if (before + count > format::kMaxCycleParticles) {
    cause.fail(fmt::format("no more than {} particles in one run of the effect; there are {} so far",
                           format::kMaxCycleParticles, before + count));
  }
  emitter.spans.push_back({static_cast<float>(begin), static_cast<float>(end), static_cast<std::uint32_t>(before),
                           static_cast<std::uint32_t>(count)});
}

std::uint64_t rounded(double count) {
  return static_cast<std::uint64_t>(std::floor(count + 0.5));
}

// A constant rate is one span. A curve becomes intervals of equal length, and the number born in each is that by which
// the rounded integral grows, so that nothing is lost between them.
void readRate(const Value& value, double duration, EmitterDescription& emitter) {
  const Keys rate = readCurve(value, {0, duration}, kPositive);
  if (!value.isArray()) return addSpan(0, duration, rounded(rate.values[0][0] * duration), emitter, value);
  const double before = rate.values[0][0] * rate.times[0];
  const auto born = [&](double time) {
    return time < rate.times[0] ? rate.values[0][0] * time : before + rate.integral(time);
  };
  std::uint64_t last = 0;
  for (int i = 0; i < kRateIntervals; ++i) {
    const double end = duration * (i + 1) / kRateIntervals;
    const std::uint64_t count = rounded(born(end));
    addSpan(duration * i / kRateIntervals, end, count - last, emitter, value);
    last = count;
  }
}

void readBursts(const Value& value, double duration, EmitterDescription& emitter) {
  const auto bursts = value.items("a list of bursts");
  if (bursts.size() > kMostBursts) value.fail(fmt::format("at most {} bursts", kMostBursts));
  for (const Value& burst : bursts) {
    burst.requireKeys({"time", "count"});
    const double time = burst.at("time").number({0, duration});
    const Value count = burst.at("count");
    addSpan(time, time, static_cast<std::uint64_t>(count.integer(1, format::kMaxCycleParticles)), emitter, count);
  }
}

// How many particles are born where and when, and how they move.
void readBirths(const Value& value, double duration, const std::filesystem::path& folder, EmitterDescription& emitter) {
  format::EmitterRecord& record = emitter.record;
  if (const auto shape = value.find("shape")) readShape(*shape, folder, emitter);
  if (const auto position = value.find("position")) emitter.position = readVectorCurve(*position, {0, duration}, kAny);
  if (const auto rate = value.find("rate")) readRate(*rate, duration, emitter);
  if (const auto bursts = value.find("bursts")) readBursts(*bursts, duration, emitter);
  if (emitter.spans.empty()) value.fail("a rate or bursts by which at least one particle is born, or particles");
  readSpan(value.at("lifetime"), {0.001, static_cast<double>(format::kMaxLifetime)}, record.lifetime);
  if (const auto velocity = value.find("velocity")) readVelocity(*velocity, record);
  if (const auto share = value.find("inheritedVelocity")) record.inheritance = share->single({-10, 10});
  if (const auto forces = value.find("forces")) readForces(*forces, emitter);
}

void refuseBirths(const Value& value) {
  for (const char* key :
       {"shape", "position", "rate", "bursts", "lifetime", "velocity", "inheritedVelocity", "forces", "tracks"}) {
    if (const auto member = value.find(key)) member->fail("none beside \"particles\", whose files say it");
  }
}

}  // namespace

EmitterDescription readEmitter(const Value& value, const EffectDescription& effect,
                               const std::filesystem::path& folder) {
  value.requireKeys({"name", "shape", "position", "rate", "bursts", "lifetime", "velocity", "inheritedVelocity",
                     "forces", "tracks", "particles", "primitive"});
  EmitterDescription emitter;
  format::EmitterRecord& record = emitter.record;
  emitter.name = value.at("name").name("an emitter's name");
  record.direction[1] = 1;
  record.spreadCosine = 1;
  const auto particles = value.find("particles");
  if (particles) {
    refuseBirths(value);
    readParticles(*particles, effect, folder, emitter);
  } else {
    readBirths(value, static_cast<double>(effect.duration), folder, emitter);
  }
  readPrimitive(value.at("primitive"), folder, emitter);
  // A hundredth of a typical radius is not seen.
  const double typical = greatestRadius(emitter);
  if (!(emitter.trackError > 0)) emitter.trackError = typical > 0 ? typical / 100 : 0.01;
  if (const auto tracks = value.find("tracks")) readTracks(*tracks, emitter);
  if (emitter.given) settleRadii(emitter);
  return emitter;
}

}  // namespace billow::compiler
