#include "effect/measure_effect.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>

#include "billow/format/particle_field.h"
#include "effect/bake_effect.h"
#include "effect/noise_map.h"
#include "effect/particle_files.h"
#include "effect/simulate.h"
#include "effect/surface_points.h"

namespace billow::compiler {
namespace {

using Vec3 = std::array<double, 3>;

// ---- Numbers.

struct Numbers {
  const char* name;
  std::size_t offset;  // in the record
  std::size_t count;   // of floats; 0: a u32
};
#define BILLOW_NUMBERS(member, count) \
  { #member, offsetof(format::EmitterRecord, member), count }
constexpr Numbers kNumbers[] = {
    BILLOW_NUMBERS(flags, 0),      BILLOW_NUMBERS(shape, 0),        BILLOW_NUMBERS(extent, 3),
    BILLOW_NUMBERS(position, 3),   BILLOW_NUMBERS(inheritance, 1),  BILLOW_NUMBERS(lifetime, 2),
    BILLOW_NUMBERS(direction, 3),  BILLOW_NUMBERS(spreadCosine, 1), BILLOW_NUMBERS(speed, 2),
    BILLOW_NUMBERS(gravity, 3),    BILLOW_NUMBERS(drag, 1),         BILLOW_NUMBERS(wind, 3),
    BILLOW_NUMBERS(kind, 0),       BILLOW_NUMBERS(radius, 2),       BILLOW_NUMBERS(proportions, 3),
    BILLOW_NUMBERS(extinction, 1), BILLOW_NUMBERS(diffuse, 3),      BILLOW_NUMBERS(emission, 3),
    BILLOW_NUMBERS(axis, 3),       BILLOW_NUMBERS(displacement, 1), BILLOW_NUMBERS(mapsPerSecond, 1),
};
#undef BILLOW_NUMBERS

template <class T>
std::span<const std::byte> bytesOf(const T& value, std::size_t offset = 0, std::size_t size = sizeof(T)) {
  return std::as_bytes(std::span(&value, 1)).subspan(offset, size);
}

std::string textOf(const format::EmitterRecord& record, const Numbers& numbers) {
  const auto bytes = bytesOf(record, numbers.offset, std::max<std::size_t>(numbers.count, 1) * 4);
  if (numbers.count == 0) {
    std::uint32_t value = 0;
    std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(&value, 1)).begin());
    return fmt::format("{}", value);
  }
  std::array<float, 3> values{};
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(values)).begin());
  return fmt::format("{}", fmt::join(std::span(values).first(numbers.count), " "));
}

// "" where the pack has the description's numbers.
std::string differingNumbers(const format::EmitterRecord& pack, const EmitterDescription& emitter) {
  const format::EmitterRecord described = numbersOf(emitter);
  for (const Numbers& numbers : kNumbers) {
    const std::size_t size = std::max<std::size_t>(numbers.count, 1) * 4;
    if (std::ranges::equal(bytesOf(pack, numbers.offset, size), bytesOf(described, numbers.offset, size))) continue;
    return fmt::format("{} is {} in the pack, {} in the description", numbers.name, textOf(pack, numbers),
                       textOf(described, numbers));
  }
  return "";
}

std::string differingSpans(std::span<const format::SpawnSpan> pack, std::span<const format::SpawnSpan> described) {
  const auto born = [](std::span<const format::SpawnSpan> spans) {
    return spans.empty() ? 0 : spans.back().first + spans.back().count;
  };
  if (born(pack) != born(described)) {
    return fmt::format("{} particles are born in a run in the pack, {} in the description", born(pack),
                       born(described));
  }
  const auto same = [](const auto& a, const auto& b) { return std::ranges::equal(bytesOf(a), bytesOf(b)); };
  return std::ranges::equal(pack, described, same) ? "" : "its particles are born at other times in the pack";
}

std::string differingGiven(std::span<const format::GivenParticle> pack, const EmitterDescription& emitter) {
  const auto files = emitter.given ? std::span<const format::GivenParticle>(emitter.given->particles)
                                   : std::span<const format::GivenParticle>();
  if (pack.size() != files.size()) {
    return fmt::format("{} particles are given in the pack, {} by the description's files", pack.size(), files.size());
  }
  for (std::size_t i = 0; i < pack.size(); ++i) {
    if (std::ranges::equal(bytesOf(pack[i]), bytesOf(files[i]))) continue;
    return fmt::format("particle {} (id {} in the pack, {} in its file) differs in time, radius or colour", i,
                       pack[i].id, files[i].id);
  }
  return "";
}

std::string differingMaterial(const format::ParticleMaterial& pack, const format::ParticleMaterial& described) {
  const auto same = pack.profile == described.profile && pack.erosion == described.erosion &&
                    pack.erosionFrequency == described.erosionFrequency && pack.occlusion == described.occlusion &&
                    pack.softness == described.softness;
  return same ? "" : "profile, erosion, occlusion or softness differ";
}

// ---- Errors.

struct Sums {
  double squares = 0, weight = 0, most = 0, largest = 0;

  void add(double error, double value, double share) {
    squares += error * error * share;
    weight += share;
    most = std::max(most, std::abs(error));
    largest = std::max(largest, std::abs(value));
  }
  void write(PartError& part) const {
    part.rmse = weight > 0 ? std::sqrt(squares / weight) : 0;
    part.maxError = most;
    part.largest = largest;
  }
};

// Places between which a table of `samples` over [0, 1] and a curve with these keys, over [0, end], are straight.
std::vector<double> cornersOf(const Keys& keys, double end, std::uint32_t samples) {
  std::vector<double> corners;
  for (std::uint32_t i = 0; i < samples; ++i) corners.push_back(static_cast<double>(i) / (samples - 1));
  for (const double time : keys.times) {
    if (time > 0 && time < end) corners.push_back(time / end);
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

class EmitterMeasurement {
 public:
  // Emitter `number` of the effect; `file` stands for the description in messages.
  EmitterMeasurement(const format::EffectTables& tables, const format::EffectRecord& effect, std::uint32_t number,
                     const EmitterDescription& emitter, const std::string& file)
      : tables_(tables),
        effect_(effect),
        number_(number),
        record_(tables.emitters[effect.firstEmitter + number]),
        material_(tables.materials[record_.material]),
        emitter_(emitter),
        file_(file) {}

  std::vector<PartError> run() {
    measureNumbers();
    const Keys way = emitter_.position.times.size() > 1 ? emitter_.position : Keys{};  // else a number
    measureKeys("position", record_.positionRow, 3, way, static_cast<double>(effect_.duration), 1);
    measureKeys("radius over life", record_.radiusRow, 1, emitter_.radius, 1, 1);
    measureKeys("opacity", record_.opacityRow, 1, emitter_.opacity, 1, 1);
    measureKeys("profile", material_.profileRow, 1, emitter_.profile, 1, 1);
    measureKeys("diffuse colour", record_.diffuseRow, 3, emitter_.diffuse, 1, 1);
    measureRamp("diffuse ramp", material_.diffuseRamp, emitter_.diffuseRamp);
    measureEmission(record_.emissionRow);
    measureRamp("emission ramp", material_.emissionRamp, emitter_.emissionRamp);
    measureKeys("rotation", record_.rotationRow, 1, emitter_.rotation, 1, 1);
    measureKeys("displacement", record_.displacementRow, 1, emitter_.displacement, 1,
                static_cast<double>(record_.displacement));
    measureMaps();
    measureTrack();
    measureRadii();
    return std::move(parts_);
  }

 private:
  PartError& add(const char* part) {
    parts_.emplace_back().emitter = emitter_.name;
    parts_.back().part = part;
    return parts_.back();
  }

  void measureNumbers() {
    PartError& numbers = add("numbers");
    const auto spans = std::span(tables_.spans).subspan(record_.firstSpan, record_.spanCount);
    const auto given = std::span(tables_.given).subspan(record_.firstGiven, record_.givenCount);
    for (const std::string& problem :
         {differingNumbers(record_, emitter_), differingSpans(spans, emitter_.spans), differingGiven(given, emitter_),
          differingMaterial(material_, emitter_.material), differingSurface()}) {
      if (numbers.problem.empty()) numbers.problem = problem;
    }
    alike_ = numbers.sound();
  }

  std::string differingSurface() const {
    if (!emitter_.mesh) return "";
    const auto pack = std::span(tables_.surfacePoints).subspan(record_.firstPoint, record_.pointCount);
    const auto described = placePoints(*emitter_.mesh, record_.pointCount).points;
    const bool same = std::ranges::equal(std::as_bytes(pack), std::as_bytes(std::span(described)));
    return same ? "" : "its mesh is another one in the pack";
  }

  // A part that both have; null where neither has it, or only one, which is a problem.
  PartError* both(const char* part, bool pack, bool described) {
    if (!pack && !described) return nullptr;
    PartError& result = add(part);
    if (pack && described) return &result;
    result.problem = pack ? "only the pack has it" : "only the description has it";
    return nullptr;
  }

  void measureKeys(const char* name, std::uint32_t row, std::uint32_t components, const Keys& keys, double end,
                   double factor) {
    PartError* part = both(name, row != format::kNoRow, !keys.empty());
    if (part == nullptr) return;
    measureCurve(*part, row, components, cornersOf(keys, end, format::kCurveSamples), factor,
                 [&](double x) { return keys.at(x * end); });
  }

  void measureEmission(std::uint32_t row) {
    const std::optional<Emission>& emission = emitter_.emission;
    PartError* part = both("emission", row != format::kNoRow, emission.has_value());
    if (part == nullptr) return;
    Keys all = emission->colour;
    for (const Keys* keys : {&emission->strength, &emission->temperature}) {
      all.times.insert(all.times.end(), keys->times.begin(), keys->times.end());
    }
    // Products of curves bend between their corners.
    std::vector<double> corners = cornersOf(all, 1, format::kCurveSamples), finer;
    constexpr int kParts = 8;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      for (int p = 0; p < kParts; ++p) finer.push_back(corners[i] + (corners[i + 1] - corners[i]) * p / kParts);
    }
    finer.push_back(1);
    measureCurve(*part, row, 3, finer, 1, [&](double x) { return emission->at(x); });
  }

  // The mean by Simpson's rule between corners, which is exact where both are straight.
  template <class Curve>
  void measureCurve(PartError& part, std::uint32_t row, std::uint32_t components, const std::vector<double>& corners,
                    double factor, const Curve& curve) {
    Sums sums;
    const auto addAt = [&](double x, double share) {
      const Vec3 value = curve(x);
      for (std::uint32_t c = 0; c < components; ++c) {
        const auto kept = static_cast<double>(format::sampleCurve(tables_.curves[row + c], static_cast<float>(x)));
        sums.add((kept - value[c]) * factor, value[c] * factor, share);
      }
    };
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      const double length = corners[i + 1] - corners[i];
      addAt(corners[i], length / 6);
      addAt(corners[i] + length / 2, length * 4 / 6);
      addAt(corners[i + 1], length / 6);
    }
    sums.write(part);
  }

  // At all corners of both, between which both are straight along each axis; the mean is over these.
  void measureRamp(const char* name, std::uint32_t ramp, const std::vector<RampRow>& rows) {
    PartError* part = both(name, ramp != format::kNoRow, !rows.empty());
    if (part == nullptr) return;
    Keys ages, radii;
    for (const RampRow& row : rows) {
      ages.times.push_back(row.age);
      radii.times.insert(radii.times.end(), row.colour.times.begin(), row.colour.times.end());
    }
    Sums sums;
    for (const double age : cornersOf(ages, 1, format::kRampAges)) {
      for (const double radius : cornersOf(radii, 1, format::kRampRadii)) {
        const Vec3 value = rampColour(rows, radius, age);
        const auto kept = format::sampleRamp(tables_.ramps[ramp], static_cast<float>(radius), static_cast<float>(age));
        for (std::size_t c = 0; c < 3; ++c) sums.add(static_cast<double>(kept[c]) - value[c], value[c], 1);
      }
    }
    sums.write(*part);
  }

  void measureMaps() {
    PartError* part =
        both("displacement maps", record_.firstMap != format::kNoMap, emitter_.map.has_value() || emitter_.picture);
    if (part == nullptr) return;
    const auto sources =
        emitter_.picture ? std::vector<MapValues>{pictureValues(*emitter_.picture)} : noiseValues(*emitter_.map);
    if (sources.size() != record_.mapCount) {
      part->problem = fmt::format("{} maps in the pack, {} in the description", record_.mapCount, sources.size());
      return;
    }
    Sums sums;
    for (std::uint32_t m = 0; m < record_.mapCount; ++m) {
      const format::DecodedCube cube(tables_.maps[record_.firstMap + m]);
      for (std::uint32_t i = 0; i < sources[m].size(); ++i) {
        constexpr std::uint32_t kEdge = format::kCubeEdge;
        const auto kept = static_cast<double>(cube.texel(i / (kEdge * kEdge), i % kEdge, i / kEdge % kEdge));
        const auto value = static_cast<double>(sources[m][i]);
        sums.add(kept - value, value, 1);
      }
    }
    sums.write(*part);
  }

  void measureTrack() {
    const bool described = emitter_.given || needsTrack(emitter_);
    PartError* part = both("track", record_.track != format::kNoTrack, described);
    if (part == nullptr) return;
    if (!alike_ && !emitter_.given) {
      part->problem = "not simulated: its numbers differ";
      return;
    }
    part->asked = emitter_.trackError;
    const std::string where = fmt::format("{}: emitters[{}]", file_, number_);
    const TrackPoints points =
        emitter_.given ? emitter_.given->points : simulate(birthsOf(tables_, effect_, number_), emitter_, where);
    const float rate = emitter_.given ? emitter_.given->framesPerSecond : emitter_.trackRate;
    const format::TrackRecord& track = tables_.tracks[record_.track];
    if (track.frameCount != points.size() || track.framesPerSecond != rate) {
      part->problem = fmt::format("{} frames, {} a second, in the pack; {} and {} in the description", track.frameCount,
                                  track.framesPerSecond, points.size(), rate);
      return;
    }
    Sums sums;
    for (std::size_t f = 0; f < points.size() && part->sound(); ++f) {
      part->problem = addDistances(points[f], tables_.trackPoints[track.firstFrame + f], f, sums);
    }
    sums.write(*part);
    sameParticles_ = part->sound();
  }

  // Those of given particles that change, before curves: shares of their particle's, which are in the numbers.
  void measureRadii() {
    const bool pack = record_.track != format::kNoTrack && (tables_.tracks[record_.track].flags & format::kTrackRadii);
    PartError* part = both("radii", pack, emitter_.given && !emitter_.given->radii.empty());
    if (part == nullptr) return;
    if (!alike_ || !sameParticles_) {
      part->problem = "not measured: its numbers or its track differ";
      return;
    }
    part->asked = emitter_.trackError;
    const GivenParticles& given = *emitter_.given;
    const std::uint32_t first = tables_.tracks[record_.track].firstFrame;
    Sums sums;
    for (std::size_t f = 0; f < given.radii.size(); ++f) {
      const std::vector<float>& kept = tables_.trackRadii[first + f];
      for (std::size_t i = 0; i < kept.size(); ++i) {
        const auto whole = static_cast<double>(given.particles[given.points[f][i].number].radius) *
                           static_cast<double>(record_.radius[1]);
        const auto share = static_cast<double>(given.radii[f][i]);
        sums.add((static_cast<double>(kept[i]) - share) * whole, share * whole, 1);
      }
    }
    sums.write(*part);
  }

  // "" where both frames hold the same particles.
  static std::string addDistances(const std::vector<format::TrackPoint>& source,
                                  const std::vector<format::TrackPoint>& kept, std::size_t frame, Sums& sums) {
    if (source.size() != kept.size()) {
      return fmt::format("{} particles in frame {} in the pack, {} in the description", kept.size(), frame,
                         source.size());
    }
    for (std::size_t i = 0; i < source.size(); ++i) {
      if (source[i].number != kept[i].number) return fmt::format("other particles in frame {}", frame);
      double square = 0, away = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto at = static_cast<double>(source[i].position[c]);
        square += (static_cast<double>(kept[i].position[c]) - at) * (static_cast<double>(kept[i].position[c]) - at);
        away += at * at;
      }
      sums.add(std::sqrt(square), std::sqrt(away), 1);
    }
    return "";
  }

  const format::EffectTables& tables_;
  const format::EffectRecord& effect_;
  std::uint32_t number_;
  const format::EmitterRecord& record_;
  const format::ParticleMaterial& material_;
  const EmitterDescription& emitter_;
  const std::string& file_;
  bool alike_ = false;          // the numbers are
  bool sameParticles_ = false;  // in each of the track's frames
  std::vector<PartError> parts_;
};

// "" where the emitters can be held against each other.
std::string differingEffect(const format::Pack& pack, const format::EffectRecord& effect,
                            const EffectDescription& description) {
  const auto differs = [](const char* what, auto inPack, auto described) {
    return fmt::format("{} is {} in the pack, {} in the description", what, inPack, described);
  };
  if (effect.duration != description.duration) return differs("duration", effect.duration, description.duration);
  if (effect.seed != description.seed) return differs("seed", effect.seed, description.seed);
  if (effect.flags != description.flags) return "loop or prewarm differ";
  if (effect.emitterCount != description.emitters.size()) {
    return differs("the number of emitters", effect.emitterCount, description.emitters.size());
  }
  for (std::uint32_t e = 0; e < effect.emitterCount; ++e) {
    const std::string_view name = pack.string(pack.effects().emitters[effect.firstEmitter + e].name);
    if (name == description.emitters[e].name) continue;
    return fmt::format("emitter {} is '{}' in the pack, '{}' in the description", e, name,
                       description.emitters[e].name);
  }
  return "";
}

}  // namespace

std::vector<PartError> measureEffect(const format::Pack& pack, const format::EffectRecord& effect,
                                     const EffectDescription& description) {
  if (const std::string problem = differingEffect(pack, effect, description); !problem.empty()) {
    PartError part;
    part.part = "numbers";
    part.problem = problem;
    return {part};
  }
  std::vector<PartError> parts;
  for (std::uint32_t e = 0; e < effect.emitterCount; ++e) {
    const auto measured =
        EmitterMeasurement(pack.effects(), effect, e, description.emitters[e], description.file).run();
    parts.insert(parts.end(), measured.begin(), measured.end());
  }
  return parts;
}

}  // namespace billow::compiler
