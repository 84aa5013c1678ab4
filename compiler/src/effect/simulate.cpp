#include "effect/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effect/gradient_noise.h"
#include "parallel.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using Vec3 = std::array<double, 3>;

constexpr int kStepsAFrame = 8;

Vec3 vec(const float (&v)[3]) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// Free of divergence, so it never gathers: the curl of three noises, by differences (Bridson, Houriham and Nordenstam
// 2007, "Curl-Noise for Procedural Fluid Flow"). Its typical length is 1.
Vec3 curlNoise(const Vec3& p, double frequency, std::uint32_t seed) {
  constexpr double kStep = 1e-3, kTypical = 1.5;
  const auto potential = [&](std::uint32_t component, std::size_t axis, double shift) {
    Vec3 q{p[0] * frequency, p[1] * frequency, p[2] * frequency};
    q[axis] += shift;
    return gradientNoise(q, seed + component);
  };
  const auto slope = [&](std::uint32_t component, std::size_t axis) {
    return (potential(component, axis, kStep) - potential(component, axis, -kStep)) / (2 * kStep * kTypical);
  };
  return {slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1)};
}

class Simulation {
 public:
  explicit Simulation(const EmitterDescription& emitter)
      : emitter_(emitter),
        gravity_(vec(emitter.record.gravity)),
        wind_(vec(emitter.record.wind)),
        drag_(static_cast<double>(emitter.record.drag)) {}

  // Drag is taken at the step's end, which is stable at any size.
  void step(Vec3& place, Vec3& velocity, double seconds) const {
    const Vec3 pull = attraction(place), wind = windAt(place);
    for (std::size_t i = 0; i < 3; ++i) {
      const double push = gravity_[i] + pull[i] + drag_ * wind[i];
      velocity[i] = (velocity[i] + seconds * push) / (1 + seconds * drag_);
      place[i] += velocity[i] * seconds;
    }
  }

 private:
  Vec3 windAt(const Vec3& place) const {
    Vec3 wind = wind_;
    if (!emitter_.curlNoise) return wind;
    const CurlNoise& noise = *emitter_.curlNoise;
    // Coordinates that no lattice holds are far outside of any picture.
    if (std::max({std::abs(place[0]), std::abs(place[1]), std::abs(place[2])}) * noise.frequency > 1e9) return wind;
    const Vec3 curl = curlNoise(place, noise.frequency, noise.seed);
    for (std::size_t i = 0; i < 3; ++i) wind[i] += noise.speed * curl[i];
    return wind;
  }

  // strength r / (d^2 + r^2), toward the attractor: greatest at the distance r, falling like 1 / d beyond.
  Vec3 attraction(const Vec3& place) const {
    if (!emitter_.attractor) return {0, 0, 0};
    const Attractor& attractor = *emitter_.attractor;
    Vec3 way{};
    double square = attractor.radius * attractor.radius;
    for (std::size_t i = 0; i < 3; ++i) {
      way[i] = attractor.position[i] - place[i];
      square += way[i] * way[i];
    }
    for (double& component : way) component *= attractor.strength * attractor.radius / square;
    return way;
  }

  const EmitterDescription& emitter_;
  Vec3 gravity_, wind_;
  double drag_;
};

struct Way {
  std::uint64_t firstFrame = 0;
  std::vector<std::array<float, 3>> places;  // by frame
};

Way follow(const format::Birth& birth, const Simulation& simulation, double rate) {
  Way way;
  Vec3 place{birth.position[0], birth.position[1], birth.position[2]};
  Vec3 velocity{birth.velocity[0], birth.velocity[1], birth.velocity[2]};
  way.firstFrame = static_cast<std::uint64_t>(std::ceil(birth.time * rate));
  const auto lastFrame = static_cast<std::uint64_t>(std::ceil((birth.time + birth.lifetime) * rate));
  double seconds = static_cast<double>(way.firstFrame) / rate - birth.time;  // to the next frame
  for (std::uint64_t frame = way.firstFrame; frame <= lastFrame; ++frame) {
    for (int s = 0; s < kStepsAFrame; ++s) simulation.step(place, velocity, seconds / kStepsAFrame);
    way.places.push_back({static_cast<float>(place[0]), static_cast<float>(place[1]), static_cast<float>(place[2])});
    seconds = 1 / rate;
  }
  return way;
}

}  // namespace

TrackPoints simulate(std::span<const format::Birth> births, const EmitterDescription& emitter,
                     const std::string& where) {
  const auto rate = static_cast<double>(emitter.trackRate);
  std::uint64_t frames = 0;
  double points = 0;
  for (const format::Birth& birth : births) {
    frames = std::max(frames, static_cast<std::uint64_t>(std::ceil((birth.time + birth.lifetime) * rate)) + 1);
    points += birth.lifetime * rate + 2;
  }
  if (frames > format::kMaxTrackFrames || points > format::kMaxTrackPoints) {
    throw Error(Fault::input,
                fmt::format("{}: its track would have {} frames and about {:.0f} points; expected at most {} and {}: "
                            "lower tracks.framesPerSecond, lifetime or rate",
                            where, frames, points, format::kMaxTrackFrames, format::kMaxTrackPoints));
  }
  const Simulation simulation(emitter);
  std::vector<Way> ways(births.size());
  parallelRanges(births.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ways[i] = follow(births[i], simulation, rate);
  });
  TrackPoints track(frames);
  for (std::size_t i = 0; i < births.size(); ++i) {
    for (std::size_t f = 0; f < ways[i].places.size(); ++f) {
      const auto& place = ways[i].places[f];
      track[ways[i].firstFrame + f].push_back({births[i].number, {place[0], place[1], place[2]}});
    }
  }
  return track;
}

}  // namespace billow::compiler
