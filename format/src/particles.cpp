#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "billow/format/effect.h"
#include "billow/format/exact_math.h"
#include "billow/format/noise.h"
#include "quaternion.h"

namespace billow::format {
namespace {

using Vec3 = std::array<double, 3>;

// The random numbers of one particle.
class Dice {
 public:
  Dice(std::uint32_t effectSeed, std::uint32_t emitter, std::uint32_t number)
      : seed_(hashInteger(hashInteger(hashInteger(effectSeed) + emitter) + number)) {}

  std::uint32_t seed() const { return seed_; }
  double draw(std::uint32_t what) const { return static_cast<double>(unitOf(hashInteger(seed_ + what))); }
  double between(std::uint32_t what, const float (&range)[2]) const {
    const double low = static_cast<double>(range[0]);
    return low + (static_cast<double>(range[1]) - low) * draw(what);
  }

 private:
  std::uint32_t seed_;
};

Vec3 vec(const float (&v)[3]) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// Uniform over the part of the unit sphere within the cone around the z axis: Archimedes.
Vec3 coneDirection(double cosine, double a, double b) {
  const double z = 1 - a * (1 - cosine);
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  const SineCosine turn = sineCosine(b);
  return {r * turn.cosine, r * turn.sine, z};
}

// The vector in a frame whose z axis is `axis`, of unit length (Duff et al. 2017, "Building an Orthonormal Basis,
// Revisited").
Vec3 around(const Vec3& axis, const Vec3& v) {
  const double sign = axis[2] < 0 ? -1 : 1;
  const double a = -1 / (sign + axis[2]);
  const double b = axis[0] * axis[1] * a;
  const Vec3 x{1 + sign * axis[0] * axis[0] * a, sign * b, -sign * axis[0]};
  const Vec3 y{b, sign + axis[1] * axis[1] * a, -axis[1]};
  Vec3 result{};
  for (std::size_t i = 0; i < 3; ++i) result[i] = x[i] * v[0] + y[i] * v[1] + axis[i] * v[2];
  return result;
}

Quaternion turned(const Vec3& axis, double turns) {
  const SineCosine half = sineCosine(turns / 2);
  return {axis[0] * half.sine, axis[1] * half.sine, axis[2] * half.sine, half.cosine};
}

// The shortest turn of the x axis to the velocity's direction; none where it is at rest.
Quaternion alongVelocity(const Vec3& velocity) {
  const double length = std::sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]);
  if (!(length > 0)) return {0, 0, 0, 1};
  const Vec3 d{velocity[0] / length, velocity[1] / length, velocity[2] / length};
  const double w = 1 + d[0];
  const double norm = std::sqrt(d[2] * d[2] + d[1] * d[1] + w * w);
  if (!(norm > 1e-6)) return {0, 0, 1, 0};  // backward: any half turn
  return {0, -d[2] / norm, d[1] / norm, w / norm};
}

// One emitter in one run, ready to be asked for its particles.
class EmitterRun {
 public:
  EmitterRun(const EffectTables& tables, const EffectRecord& effect, std::uint32_t number, double time)
      : tables_(tables),
        emitter_(tables.emitters[effect.firstEmitter + number]),
        spans_(std::span(tables.spans).subspan(emitter_.firstSpan, emitter_.spanCount)),
        given_(std::span(tables.given).subspan(emitter_.firstGiven, emitter_.givenCount)),
        duration_(static_cast<double>(effect.duration)),
        seed_(effect.seed),
        number_(number),
        time_(time) {}

  // Those of the candidates that are alive.
  void append(const Candidates& candidates, std::vector<Particle>& into) const {
    const double now = time_ - static_cast<double>(candidates.run) * duration_;
    if (!given_.empty()) return appendGiven(candidates, now, into);
    const std::uint32_t total = spans_.empty() ? 0 : spans_.back().first + spans_.back().count;
    // With a track, all runs are alike.
    const std::uint32_t run = emitter_.track == kNoTrack ? static_cast<std::uint32_t>(candidates.run) : 0;
    const SpawnSpan& span = spans_[candidates.span];
    for (std::uint32_t i = candidates.first; i < candidates.last; ++i) {
      const Dice dice(seed_, number_, run * total + span.first + i);
      const Birth birth = birthOf(dice, span, i);
      const double age = now - birth.time;
      if (age >= 0 && age < birth.lifetime) into.push_back(particle(dice, birth, age));
    }
  }

  std::vector<Birth> births() const {
    std::vector<Birth> all;
    for (std::uint32_t i = 0; i < given_.size(); ++i) all.push_back(givenBirth(i));
    for (const SpawnSpan& span : spans_) {
      for (std::uint32_t i = 0; i < span.count; ++i) {
        const Dice dice(seed_, number_, span.first + i);
        all.push_back(birthOf(dice, span, i));
        setOut(dice, all.back());
      }
    }
    return all;
  }

 private:
  Birth givenBirth(std::uint32_t i) const {
    return {i, static_cast<double>(given_[i].time), static_cast<double>(given_[i].lifetime), {}, {}};
  }
  void appendGiven(const Candidates& candidates, double now, std::vector<Particle>& into) const {
    for (std::uint32_t i = candidates.first; i < candidates.last; ++i) {
      const Birth birth = givenBirth(i);
      const double age = now - birth.time;
      if (age >= 0 && age < birth.lifetime) into.push_back(givenParticle(given_[i], birth, age));
    }
  }

  // All of it but place and velocity.
  Birth birthOf(const Dice& dice, const SpawnSpan& span, std::uint32_t i) const {
    const double share = (i + dice.draw(kDrawBirth)) / span.count;
    const double from = static_cast<double>(span.begin);
    return {span.first + i,
            from + (static_cast<double>(span.end) - from) * share,
            dice.between(kDrawLifetime, emitter_.lifetime),
            {},
            {}};
  }
  void setOut(const Dice& dice, Birth& birth) const {
    birth.position = place(birth.time);
    const Vec3 shift = offset(dice);
    for (std::size_t i = 0; i < 3; ++i) birth.position[i] += shift[i];
    birth.velocity = startVelocity(dice, birth.time);
  }

  double row(std::uint32_t index, double x, double absent) const {
    return index == kNoRow ? absent : static_cast<double>(sampleCurve(tables_.curves[index], static_cast<float>(x)));
  }

  // Where the emitter is, and how fast it goes, `seconds` into the run.
  Vec3 place(double seconds) const {
    Vec3 at = vec(emitter_.position);
    if (emitter_.positionRow == kNoRow) return at;
    for (std::uint32_t i = 0; i < 3; ++i) at[i] += row(emitter_.positionRow + i, seconds / duration_, 0);
    return at;
  }
  Vec3 velocity(double seconds) const {
    if (emitter_.positionRow == kNoRow) return {0, 0, 0};
    const double step = duration_ / (kCurveSamples - 1);
    const auto sample = static_cast<std::size_t>(std::clamp<double>(std::floor(seconds / step), 0, kCurveSamples - 2));
    Vec3 speed{};
    for (std::uint32_t i = 0; i < 3; ++i) {
      const float(&values)[kCurveSamples] = tables_.curves[emitter_.positionRow + i].values;
      speed[i] = (static_cast<double>(values[sample + 1]) - static_cast<double>(values[sample])) / step;
    }
    return speed;
  }

  // In the shape, relative to its middle.
  Vec3 offset(const Dice& dice) const {
    const double a = dice.draw(kDrawPlace), b = dice.draw(kDrawPlace + 1), c = dice.draw(kDrawPlace + 2);
    const Vec3 extent = vec(emitter_.extent);
    switch (static_cast<EmitterShape>(emitter_.shape)) {
      case EmitterShape::point:
        return {0, 0, 0};
      case EmitterShape::sphere: {
        const double hollow = extent[1] * extent[1] * extent[1];
        const double r = extent[0] * cubeRoot(hollow + (1 - hollow) * c);
        const Vec3 d = coneDirection(-1, a, b);
        return {d[0] * r, d[1] * r, d[2] * r};
      }
      case EmitterShape::box:
        return {extent[0] * (2 * a - 1), extent[1] * (2 * b - 1), extent[2] * (2 * c - 1)};
      case EmitterShape::mesh:
        return placeOf(surfacePoint(dice), emitter_.extent);
    }
    return {0, 0, 0};
  }

  // On which a particle of a mesh is born.
  const SurfacePoint& surfacePoint(const Dice& dice) const {
    const auto index = static_cast<std::uint32_t>(dice.draw(kDrawPlace) * emitter_.pointCount);
    return tables_.surfacePoints[emitter_.firstPoint + index];
  }

  Vec3 startVelocity(const Dice& dice, double born) const {
    const Vec3 cone = coneDirection(static_cast<double>(emitter_.spreadCosine), dice.draw(kDrawDirection),
                                    dice.draw(kDrawDirection + 1));
    const bool outward = (emitter_.flags & kEmitterNormal) != 0;
    Vec3 start = around(outward ? normalOf(surfacePoint(dice)) : vec(emitter_.direction), cone);
    const double speed = dice.between(kDrawSpeed, emitter_.speed);
    const Vec3 own = velocity(born);
    for (std::size_t i = 0; i < 3; ++i)
      start[i] = start[i] * speed + own[i] * static_cast<double>(emitter_.inheritance);
    return start;
  }

  Quaternion rotation(const Dice& dice, double share, const Vec3& speed) const {
    double turns = row(emitter_.rotationRow, share, 0);
    if ((emitter_.flags & kEmitterRandomStart) != 0) turns += dice.draw(kDrawAngle);
    if ((emitter_.flags & kEmitterAlign) != 0) return product(alongVelocity(speed), turned({1, 0, 0}, turns));
    Vec3 axis = vec(emitter_.axis);
    if (axis == Vec3{0, 0, 0}) axis = coneDirection(-1, dice.draw(kDrawAxis), dice.draw(kDrawAxis + 1));
    return turned(axis, turns);
  }

  // The two maps between which the particle's displacement is.
  void fillMaps(const Dice& dice, double age, Particle& result) const {
    const std::uint32_t first = emitter_.firstMap, count = emitter_.mapCount;
    result.kind = emitter_.kind;
    result.map = first;
    if (first == kNoMap || count <= 1) return;
    const double at = dice.draw(kDrawMap) * count + age * static_cast<double>(emitter_.mapsPerSecond);
    const double whole = std::floor(at);
    const auto index = static_cast<std::uint32_t>(whole - std::floor(whole / count) * count) % count;
    result.kind = kindWithShare(emitter_.kind, static_cast<float>(at - whole));
    result.map = (first + index) | (first + (index + 1) % count) << 16;
  }

  struct Motion {
    Vec3 place, velocity;
    double radius;  // factor
  };

  Motion closedForm(const Birth& birth, double age) const {
    Motion motion{{}, {}, 1};
    const double drag = static_cast<double>(emitter_.drag);
    const double mean = decayMean(drag * age), slope = decayMeanSlope(drag * age), left = decay(drag * age);
    for (std::size_t i = 0; i < 3; ++i) {
      const double pull = static_cast<double>(emitter_.gravity[i]) + drag * static_cast<double>(emitter_.wind[i]);
      motion.velocity[i] = birth.velocity[i] * left + pull * age * mean;
      motion.place[i] = birth.position[i] + birth.velocity[i] * age * mean + pull * age * age * slope;
    }
    return motion;
  }

  struct FramePoint {
    bool found;
    Vec3 place;
    double radius;
  };
  FramePoint pointIn(const TrackRecord& track, double frame, std::uint32_t number) const {
    if (!(frame < track.frameCount)) return {};
    const std::size_t index = track.firstFrame + static_cast<std::size_t>(frame);
    const auto& points = tables_.trackPoints[index];
    const auto point = std::lower_bound(points.begin(), points.end(), number,
                                        [](const TrackPoint& one, std::uint32_t n) { return one.number < n; });
    if (point == points.end() || point->number != number) return {};
    const auto& radii = tables_.trackRadii[index];
    const double radius =
        radii.empty() ? 1 : static_cast<double>(radii[static_cast<std::size_t>(point - points.begin())]);
    return {true, vec(point->position), radius};
  }

  // On the straight line between two frames, the first of which may be the birth. Given particles rest before their
  // first frame and after their last.
  Motion sampled(const Birth& birth, double age) const {
    const TrackRecord& track = tables_.tracks[emitter_.track];
    const double rate = static_cast<double>(track.framesPerSecond), now = birth.time + age;
    const double last = given_.empty() ? track.frameCount : track.frameCount - 1.0;
    const double frame = std::min(std::floor(now * rate), last);
    const FramePoint before = pointIn(track, frame, birth.number), after = pointIn(track, frame + 1, birth.number);
    Motion motion{before.found ? before.place : birth.position, {}, before.found ? before.radius : 1};
    if (!after.found) return motion;
    if (!before.found && !given_.empty()) return {after.place, {}, after.radius};
    const double begin = before.found ? frame / rate : birth.time;
    const double length = (frame + 1) / rate - begin;
    if (!(length > 0)) return motion;
    const double share = (now - begin) / length;
    for (std::size_t i = 0; i < 3; ++i) {
      motion.velocity[i] = (after.place[i] - motion.place[i]) / length;
      motion.place[i] += motion.velocity[i] * (now - begin);
    }
    motion.radius += (after.radius - motion.radius) * share;
    return motion;
  }

  Particle particle(const Dice& dice, Birth birth, double age) const {
    setOut(dice, birth);
    const Motion motion = emitter_.track == kNoTrack ? closedForm(birth, age) : sampled(birth, age);
    return particle(dice, motion, age, age / birth.lifetime);
  }

  Particle givenParticle(const GivenParticle& given, const Birth& birth, double age) const {
    const double share = (static_cast<double>(given.age) + age) / static_cast<double>(given.life);
    Motion motion = sampled(birth, age);
    motion.radius *= static_cast<double>(given.radius);
    Particle result = particle(Dice(seed_, number_, given.id), motion, age, std::min(share, 1.0));
    for (std::size_t i = 0; i < 3; ++i) result.diffuse[i] *= given.colour[i];
    return result;
  }

  // `share` of its life.
  Particle particle(const Dice& dice, const Motion& motion, double age, double share) const {
    Particle result{};
    for (std::size_t i = 0; i < 3; ++i) result.center[i] = static_cast<float>(motion.place[i]);
    const Quaternion turn = rotation(dice, share, motion.velocity);
    for (std::size_t i = 0; i < 4; ++i) result.rotation[i] = static_cast<float>(turn[i]);
    fillLook(dice, share, motion.radius, result);
    fillMaps(dice, age, result);
    return result;
  }

  void fillLook(const Dice& dice, double share, double factor, Particle& result) const {
    const double radius = dice.between(kDrawRadius, emitter_.radius) * factor * row(emitter_.radiusRow, share, 1);
    const double opacity = row(emitter_.opacityRow, share, 1);
    result.radius = static_cast<float>(std::max(0.0, radius));
    result.extinction = static_cast<float>(static_cast<double>(emitter_.extinction) * std::max(0.0, opacity));
    for (std::uint32_t i = 0; i < 3; ++i) {
      result.shape[i] = emitter_.proportions[i] * result.radius;
      const std::uint32_t diffuse = emitter_.diffuseRow == kNoRow ? kNoRow : emitter_.diffuseRow + i;
      const std::uint32_t emission = emitter_.emissionRow == kNoRow ? kNoRow : emitter_.emissionRow + i;
      const double albedo = static_cast<double>(emitter_.diffuse[i]) * row(diffuse, share, 1);
      const double glow = static_cast<double>(emitter_.emission[i]) * row(emission, share, 1);
      result.diffuse[i] = static_cast<float>(std::clamp(albedo, 0.0, 1.0));
      result.emission[i] = static_cast<float>(std::max(0.0, glow));
    }
    const double taken = static_cast<double>(emitter_.displacement) * row(emitter_.displacementRow, share, 1);
    result.displacement = std::clamp(static_cast<float>(taken), 0.0f, 0.95f);
    result.age = static_cast<float>(share);
    result.material = emitter_.material;
    result.seed = dice.seed();
  }

  const EffectTables& tables_;
  const EmitterRecord& emitter_;
  std::span<const SpawnSpan> spans_;
  std::span<const GivenParticle> given_;
  double duration_;
  std::uint32_t seed_;
  std::uint32_t number_;
  double time_;
};

}  // namespace

std::vector<Birth> birthsOf(const EffectTables& tables, const EffectRecord& effect, std::uint32_t emitter) {
  return EmitterRun(tables, effect, emitter, 0).births();
}

std::vector<Particle> particlesAt(const EffectTables& tables, std::uint32_t effect, double time) {
  std::vector<Particle> particles;
  const EffectRecord& record = tables.effects[effect];
  for (const Candidates& candidates : candidatesAt(tables, effect, time)) {
    EmitterRun(tables, record, candidates.emitter, time).append(candidates, particles);
  }
  return particles;
}

}  // namespace billow::format
