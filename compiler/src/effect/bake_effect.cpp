#include "effect/bake_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "effect/noise_map.h"
#include "effect/particle_files.h"
#include "effect/simulate.h"
#include "effect/surface_points.h"
#include "stages.h"

namespace billow::compiler {
namespace {

class Baker {
 public:
  explicit Baker(format::PackTables& tables) : tables_(tables), effects_(tables.effects) {}

  void add(const EffectDescription& effect) {
    format::EffectRecord record{};
    record.name = tables_.addString(effect.name);
    record.firstEmitter = static_cast<std::uint32_t>(effects_.emitters.size());
    record.emitterCount = static_cast<std::uint32_t>(effect.emitters.size());
    record.flags = effect.flags;
    record.seed = effect.seed;
    record.duration = effect.duration;
    for (std::uint32_t e = 0; e < record.emitterCount; ++e) {
      const EmitterDescription& emitter = effect.emitters[e];
      const std::string where = fmt::format("{}: emitters[{}]", effect.file, e);
      addEmitter(emitter, effect.duration, where);
      if (emitter.given) addGiven(emitter, where);
      if (!needsTrack(emitter)) continue;
      const TrackPoints points = simulate(birthsOf(effects_, record, e), emitter, where);
      effects_.emitters.back().track =
          addTrack({points, {}, emitter.trackRate, emitter.trackError, 0}, where, effects_);
    }
    effects_.effects.push_back(record);
  }

 private:
  void addEmitter(const EmitterDescription& emitter, float duration, const std::string& where) {
    format::EmitterRecord record = numbersOf(emitter);
    record.name = tables_.addString(emitter.name);
    record.firstSpan = static_cast<std::uint32_t>(effects_.spans.size());
    record.spanCount = static_cast<std::uint32_t>(emitter.spans.size());
    effects_.spans.insert(effects_.spans.end(), emitter.spans.begin(), emitter.spans.end());
    const bool moves = emitter.position.times.size() > 1;
    record.positionRow = moves ? rows(emitter.position, 3, static_cast<double>(duration)) : format::kNoRow;
    if (emitter.mesh) addSurface(*emitter.mesh, emitter.spans.back(), where, record);
    record.radiusRow = rows(emitter.radius, 1, 1);
    record.opacityRow = rows(emitter.opacity, 1, 1);
    record.diffuseRow = rows(emitter.diffuse, 3, 1);
    const auto emission = [&](double time) { return emitter.emission->at(time); };
    record.emissionRow = emitter.emission ? rowsOf(emission, 3, 1) : format::kNoRow;
    record.rotationRow = rows(emitter.rotation, 1, 1);
    record.displacementRow = rows(emitter.displacement, 1, 1);
    record.firstMap = emitter.map ? maps(*emitter.map) : format::kNoMap;
    record.mapCount = emitter.map ? emitter.map->frames : 0;
    if (emitter.picture) {
      record.firstMap = shared(effects_.maps, std::vector{makePictureMap(*emitter.picture)});
      record.mapCount = 1;
    }
    record.material = material(emitter);
    record.track = format::kNoTrack;
    effects_.emitters.push_back(record);
  }

  void addSurface(const MeshShape& mesh, const format::SpawnSpan& last, const std::string& where,
                  format::EmitterRecord& record) {
    const auto points = placePoints(mesh, pointsFor(std::uint64_t{last.first} + last.count)).points;
    record.firstPoint = shared(effects_.surfacePoints, points);
    record.pointCount = static_cast<std::uint32_t>(points.size());
    for (const float middle : record.position) {
      if (std::abs(middle) <= format::kMaxMagnitude) continue;
      throw Error(Fault::input, fmt::format("{}.position: its mesh's middle would be at {}; expected at most {}", where,
                                            middle, format::kMaxMagnitude));
    }
  }

  void addGiven(const EmitterDescription& emitter, const std::string& where) {
    const GivenParticles& given = *emitter.given;
    format::EmitterRecord& record = effects_.emitters.back();
    record.firstGiven = static_cast<std::uint32_t>(effects_.given.size());
    record.givenCount = static_cast<std::uint32_t>(given.particles.size());
    effects_.given.insert(effects_.given.end(), given.particles.begin(), given.particles.end());
    // Shares are as exact as the greatest radius that they make.
    const double greatest = greatestRadius(emitter);
    const double radiusError = greatest > 0 ? emitter.trackError / greatest : 1;
    record.track =
        addTrack({given.points, given.radii, given.framesPerSecond, emitter.trackError, radiusError}, where, effects_);
  }

  // The first of `count` consecutive rows, one a component, over [0, end].
  std::uint32_t rows(const Keys& keys, std::size_t count, double end) {
    return keys.empty() ? format::kNoRow : rowsOf([&](double time) { return keys.at(time); }, count, end);
  }

  template <class Curve>
  std::uint32_t rowsOf(const Curve& curve, std::size_t count, double end) {
    std::vector<format::CurveRow> wanted(count);
    for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
      const std::array<double, 3> value = curve(end * i / (format::kCurveSamples - 1));
      for (std::size_t c = 0; c < count; ++c) wanted[c].values[i] = static_cast<float>(value[c]);
    }
    return shared(effects_.curves, wanted);
  }

  std::uint32_t ramp(const std::vector<RampRow>& description) {
    if (description.empty()) return format::kNoRow;
    format::RampTable table{};
    for (std::uint32_t a = 0; a < format::kRampAges; ++a) {
      for (std::uint32_t r = 0; r < format::kRampRadii; ++r) {
        const auto colour = rampColour(description, static_cast<double>(r) / (format::kRampRadii - 1),
                                       static_cast<double>(a) / (format::kRampAges - 1));
        for (std::size_t c = 0; c < 3; ++c) table.values[a][r][c] = static_cast<float>(colour[c]);
      }
    }
    return shared(effects_.ramps, std::vector{table});
  }

  std::uint32_t maps(const NoiseMap& map) {
    for (const auto& [known, first] : madeMaps_) {
      if (known == map) return first;
    }
    const auto first = static_cast<std::uint32_t>(effects_.maps.size());
    const auto made = makeNoiseMaps(map);
    effects_.maps.insert(effects_.maps.end(), made.begin(), made.end());
    madeMaps_.emplace_back(map, first);
    return first;
  }

  std::uint32_t material(const EmitterDescription& emitter) {
    format::ParticleMaterial material = emitter.material;
    material.profileRow = rows(emitter.profile, 1, 1);
    material.diffuseRamp = ramp(emitter.diffuseRamp);
    material.emissionRamp = ramp(emitter.emissionRamp);
    return shared(effects_.materials, std::vector{material});
  }

  // Where these records stand in the table, one after another; they are appended where they don't.
  template <class T>
  static std::uint32_t shared(std::vector<T>& table, const std::vector<T>& records) {
    const auto equal = [](const T& a, const T& b) {
      return std::ranges::equal(std::as_bytes(std::span(&a, 1)), std::as_bytes(std::span(&b, 1)));
    };
    auto at = std::search(table.begin(), table.end(), records.begin(), records.end(), equal);
    const auto first = static_cast<std::uint32_t>(at - table.begin());
    if (at == table.end()) table.insert(table.end(), records.begin(), records.end());
    return first;
  }

  format::PackTables& tables_;
  format::EffectTables& effects_;
  std::vector<std::pair<NoiseMap, std::uint32_t>> madeMaps_;
};

}  // namespace

format::EmitterRecord numbersOf(const EmitterDescription& emitter) {
  format::EmitterRecord record = emitter.record;
  if (emitter.position.times.size() == 1) {
    for (std::size_t i = 0; i < 3; ++i) record.position[i] = static_cast<float>(emitter.position.values[0][i]);
  }
  if (!emitter.mesh) return record;
  // The shape's middle is that of the mesh, not the origin of its file.
  const MeshBox box = boxOf(*emitter.mesh);
  for (std::size_t i = 0; i < 3; ++i) {
    record.position[i] = static_cast<float>(static_cast<double>(record.position[i]) + box.middle[i]);
    record.extent[i] = box.halfSides[i];
  }
  return record;
}

std::array<double, 3> rampColour(std::span<const RampRow> ramp, double radius, double age) {
  Keys ages;
  for (const RampRow& row : ramp) {
    ages.times.push_back(row.age);
    ages.values.push_back(row.colour.at(radius));
  }
  return ages.at(age);
}

void bakeEffects(std::span<const EffectDescription> effects, format::PackTables& tables) {
  Baker baker(tables);
  for (const EffectDescription& effect : effects) baker.add(effect);
}

}  // namespace billow::compiler
