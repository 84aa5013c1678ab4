// The rules of effects: records against one another, numbers against their limits.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <string_view>

#include "billow/format/effect.h"
#include "rules.h"

namespace billow::format {
namespace {

bool within(float value, float low, float high) {
  return value >= low && value <= high;  // NaN is not
}

// Every value in [low, high].
bool allWithin(std::span<const float> values, float low, float high) {
  return std::all_of(values.begin(), values.end(), [&](float value) { return within(value, low, high); });
}

bool rangeWithin(const float (&range)[2], float low, float high) {
  return within(range[0], low, high) && within(range[1], range[0], high);
}

bool isUnit(const float (&v)[3]) {
  const float square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  return within(square, 0.999f, 1.001f);
}

bool isZero(const float (&v)[3]) {
  return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

bool allZero(std::span<const std::uint32_t> values) {
  return std::all_of(values.begin(), values.end(), [](std::uint32_t value) { return value == 0; });
}

class EffectRules {
 public:
  EffectRules(const TableView& view, IssueSink& sink) : view_(view), tables_(*view.effects), sink_(sink) {}

  void check() {
    checkTableValues();
    if (!checkRanges()) return;
    std::set<std::string_view> names;
    for (std::uint32_t e = 0; e < tables_.effects.size() && !sink_.stopped(); ++e) checkEffect(e, names);
  }

 private:
  template <class T>
  Place placeOf(std::uint32_t section, std::size_t record) const {
    return view_.place(section, record * sizeof(T));
  }

  void checkTableValues() {
    for (std::size_t i = 0; i < tables_.curves.size() && !sink_.stopped(); ++i) {
      if (allWithin(tables_.curves[i].values, -kMaxMagnitude, kMaxMagnitude)) continue;
      sink_.report(Rule::effectTable, placeOf<CurveRow>(kSectionCurves, i), "A curve has another.");
    }
    for (std::size_t i = 0; i < tables_.ramps.size() && !sink_.stopped(); ++i) {
      const std::span<const float> values(&tables_.ramps[i].values[0][0][0], sizeof(RampTable) / sizeof(float));
      if (allWithin(values, 0, kMaxMagnitude)) continue;
      sink_.report(Rule::effectTable, placeOf<RampTable>(kSectionRamps, i), "A ramp has another.");
    }
    for (std::size_t i = 0; i < tables_.materials.size() && !sink_.stopped(); ++i) checkMaterial(i);
  }

  void checkMaterial(std::size_t number) {
    const ParticleMaterial& material = tables_.materials[number];
    const Place place = placeOf<ParticleMaterial>(kSectionMaterials, number);
    const bool curve = material.profile == kProfileCurve;
    if (material.profile > kProfileCurve ||
        (curve ? material.profileRow >= tables_.curves.size() : material.profileRow != kNoRow)) {
      sink_.report(Rule::materialProfile, place,
                   fmt::format("Profile {} with curve {}.", material.profile, material.profileRow));
    }
    for (const std::uint32_t ramp : {material.diffuseRamp, material.emissionRamp}) {
      if (ramp == kNoRow || ramp < tables_.ramps.size()) continue;
      sink_.report(Rule::effectReference, place, fmt::format("Ramp {} of {}.", ramp, tables_.ramps.size()));
    }
    const bool sound = within(material.erosion, 0, 1) && within(material.occlusion, 0, 1) &&
                       within(material.erosionFrequency, 0, kMaxErosionFrequency) && material.softness > 0 &&
                       material.softness <= 1;
    if (sound) return;
    sink_.report(Rule::materialValues, place,
                 fmt::format("Erosion {} at {}, occlusion {}, softness {}.", material.erosion,
                             material.erosionFrequency, material.occlusion, material.softness));
  }

  // Whether effects divide the emitters, and these the spans, so that records may be found through them.
  bool checkRanges() {
    std::uint64_t emitters = 0, spans = 0;
    for (std::size_t e = 0; e < tables_.effects.size(); ++e) {
      const EffectRecord& effect = tables_.effects[e];
      const bool follows = effect.firstEmitter == emitters;
      emitters += effect.emitterCount;
      if (follows && effect.emitterCount <= kMaxEmitters && emitters <= tables_.emitters.size()) continue;
      sink_.report(Rule::effectRanges, placeOf<EffectRecord>(kSectionEffects, e),
                   fmt::format("Its {} emitters from {} do not.", effect.emitterCount, effect.firstEmitter));
      return false;
    }
    for (std::size_t i = 0; i < tables_.emitters.size(); ++i) {
      const EmitterRecord& emitter = tables_.emitters[i];
      const bool follows = emitter.firstSpan == spans;
      spans += emitter.spanCount;
      const bool number =
          emitter.givenCount > 0 ? emitter.spanCount == 0 : emitter.spanCount >= 1 && emitter.spanCount <= kMaxSpans;
      if (follows && number && spans <= tables_.spans.size()) continue;
      sink_.report(Rule::effectRanges, placeOf<EmitterRecord>(kSectionEmitters, i),
                   fmt::format("Its {} spans from {} do not.", emitter.spanCount, emitter.firstSpan));
      return false;
    }
    if (emitters == tables_.emitters.size() && spans == tables_.spans.size()) return checkGivenRanges();
    sink_.report(Rule::effectRanges, placeOf<EffectRecord>(kSectionEffects, 0),
                 fmt::format("Effects own {} of {} emitters, these {} of {} spans.", emitters, tables_.emitters.size(),
                             spans, tables_.spans.size()));
    return false;
  }

  bool checkGivenRanges() {
    std::uint64_t given = 0;
    for (std::size_t i = 0; i < tables_.emitters.size(); ++i) {
      const EmitterRecord& emitter = tables_.emitters[i];
      const bool follows = emitter.firstGiven == (emitter.givenCount > 0 ? given : 0);
      given += emitter.givenCount;
      const bool moved = emitter.givenCount > 0 ? emitter.track != kNoTrack : !hasRadii(emitter);
      if (follows && moved && emitter.givenCount <= kMaxCycleParticles && given <= tables_.given.size()) continue;
      sink_.report(Rule::givenRanges, placeOf<EmitterRecord>(kSectionEmitters, i),
                   fmt::format("{} from {}, with track {}.", emitter.givenCount, emitter.firstGiven, emitter.track));
      return false;
    }
    if (given == tables_.given.size()) return true;
    sink_.report(Rule::givenRanges, placeOf<GivenParticle>(kSectionGiven, 0),
                 fmt::format("The emitters own {} of {}.", given, tables_.given.size()));
    return false;
  }

  bool hasRadii(const EmitterRecord& emitter) const {
    return emitter.track < tables_.tracks.size() && (tables_.tracks[emitter.track].flags & kTrackRadii) != 0;
  }

  void checkEffect(std::uint32_t number, std::set<std::string_view>& names) {
    const EffectRecord& effect = tables_.effects[number];
    const Place place = placeOf<EffectRecord>(kSectionEffects, number);
    checkName(view_, effect.name, place, names, sink_);
    if (!allZero(effect.reserved)) sink_.report(Rule::tableReserved, place, "A reserved field of an effect is not.");
    const bool flags = (effect.flags & ~(kEffectLoop | kEffectPrewarm)) == 0 && effect.flags != kEffectPrewarm;
    const bool duration = within(effect.duration, kMinDuration, kMaxDuration);
    if (!flags || !duration) {
      sink_.report(Rule::effectValues, place, fmt::format("Flags {:#x}, {} s.", effect.flags, effect.duration));
    }
    bool countable = duration;
    std::set<std::string_view> emitterNames;
    for (std::uint32_t i = 0; i < effect.emitterCount && !sink_.stopped(); ++i) {
      const std::size_t emitter = std::size_t{effect.firstEmitter} + i;
      checkName(view_, tables_.emitters[emitter].name, placeOf<EmitterRecord>(kSectionEmitters, emitter), emitterNames,
                sink_);
      if (!checkEmitter(emitter, effect)) countable = false;
    }
    if (!countable || sink_.stopped()) return;
    if (const std::uint64_t alive = mostAlive(tables_, effect); alive > kMaxAlive) {
      sink_.report(Rule::effectAlive, place, fmt::format("{} may be.", alive));
    }
  }

  // Whether its particles can be counted.
  bool checkEmitter(std::size_t number, const EffectRecord& effect) {
    const EmitterRecord& emitter = tables_.emitters[number];
    const Place place = placeOf<EmitterRecord>(kSectionEmitters, number);
    if (!allZero(emitter.reserved)) {
      sink_.report(Rule::tableReserved, place, "A reserved field of an emitter is not.");
    }
    checkMotion(emitter, place);
    checkLook(emitter, place);
    checkReferences(emitter, place);
    const bool lifetime = emitter.lifetime[0] > 0 && rangeWithin(emitter.lifetime, 0, kMaxLifetime);
    if (!lifetime) {
      sink_.report(Rule::emitterValues, place,
                   fmt::format("Lifetime {} to {} s.", emitter.lifetime[0], emitter.lifetime[1]));
    }
    return checkSpans(emitter, effect) && checkGiven(emitter, effect) && lifetime;
  }

  void require(bool holds, std::string_view what, const Place& place) {
    if (!holds) sink_.report(Rule::emitterValues, place, fmt::format("Its {}.", what));
  }

  void checkMotion(const EmitterRecord& emitter, const Place& place) {
    const auto moderate = [](std::span<const float> values) {
      return allWithin(values, -kMaxMagnitude, kMaxMagnitude);
    };
    const bool mesh = emitter.shape == static_cast<std::uint32_t>(EmitterShape::mesh);
    const std::uint32_t known = kEmitterAlign | kEmitterRandomStart | (mesh ? kEmitterNormal : 0);
    require((emitter.flags & ~known) == 0, "flags", place);
    require(emitter.shape < kEmitterShapeCount && emitter.kind < kKindCount, "shape or kind", place);
    const bool ball = emitter.shape != static_cast<std::uint32_t>(EmitterShape::sphere) || emitter.extent[1] <= 1;
    require(allWithin(emitter.extent, 0, kMaxMagnitude) && ball, "extent", place);
    require(moderate(emitter.position), "position", place);
    require(within(emitter.inheritance, -10, 10), "inheritance", place);
    require(isUnit(emitter.direction) && within(emitter.spreadCosine, -1, 1), "direction or spread", place);
    require(rangeWithin(emitter.speed, -kMaxMagnitude, kMaxMagnitude), "speed", place);
    require(moderate(emitter.gravity) && moderate(emitter.wind) && within(emitter.drag, 0, kMaxDrag), "forces", place);
    require(isZero(emitter.axis) || isUnit(emitter.axis), "axis", place);
  }

  void checkLook(const EmitterRecord& emitter, const Place& place) {
    require(rangeWithin(emitter.radius, 0, kMaxMagnitude), "radius", place);
    require(allWithin(emitter.proportions, 0, 1), "proportions", place);
    require(within(emitter.extinction, 0, kMaxMagnitude), "extinction", place);
    require(allWithin(emitter.diffuse, 0, 1), "diffuse colour", place);
    require(allWithin(emitter.emission, 0, kMaxMagnitude), "emission", place);
    require(within(emitter.displacement, 0, 0.95f), "displacement", place);
    require(within(emitter.mapsPerSecond, -kMaxDrag, kMaxDrag), "map speed", place);
  }

  void checkReferences(const EmitterRecord& emitter, const Place& place) {
    const auto rows = [&](std::uint32_t first, std::uint64_t count) {
      return first == kNoRow || first + count <= tables_.curves.size();
    };
    const bool curves = rows(emitter.positionRow, 3) && rows(emitter.diffuseRow, 3) && rows(emitter.emissionRow, 3) &&
                        rows(emitter.radiusRow, 1) && rows(emitter.opacityRow, 1) && rows(emitter.rotationRow, 1) &&
                        rows(emitter.displacementRow, 1);
    if (!curves) sink_.report(Rule::effectReference, place, fmt::format("A curve of {}.", tables_.curves.size()));
    const std::uint64_t mapsEnd = std::uint64_t{emitter.firstMap} + emitter.mapCount;
    const bool maps = emitter.firstMap == kNoMap ? emitter.mapCount == 0
                                                 : emitter.mapCount >= 1 && emitter.mapCount <= kMaxAnimatedMaps &&
                                                       mapsEnd <= tables_.maps.size() && mapsEnd <= kMaxMaps;
    if (!maps) {
      sink_.report(Rule::effectReference, place,
                   fmt::format("{} maps from {} of {}.", emitter.mapCount, emitter.firstMap, tables_.maps.size()));
    }
    if (emitter.track != kNoTrack && emitter.track >= tables_.tracks.size()) {
      sink_.report(Rule::effectReference, place, fmt::format("Track {} of {}.", emitter.track, tables_.tracks.size()));
    }
    const std::uint64_t pointsEnd = std::uint64_t{emitter.firstPoint} + emitter.pointCount;
    const bool mesh = emitter.shape == static_cast<std::uint32_t>(EmitterShape::mesh);
    const bool points = mesh ? emitter.pointCount >= 1 && emitter.pointCount <= kMaxSurfacePoints &&
                                   pointsEnd <= tables_.surfacePoints.size()
                             : pointsEnd == 0;
    if (!points) {
      sink_.report(Rule::emitterSurface, place,
                   fmt::format("{} points from {} of {}.", emitter.pointCount, emitter.firstPoint,
                               tables_.surfacePoints.size()));
    }
    if (emitter.material >= tables_.materials.size()) {
      sink_.report(Rule::effectReference, place,
                   fmt::format("Material {} of {}.", emitter.material, tables_.materials.size()));
    }
  }

  bool checkSpans(const EmitterRecord& emitter, const EffectRecord& effect) {
    std::uint64_t born = 0;
    for (std::uint32_t i = 0; i < emitter.spanCount; ++i) {
      const std::size_t index = std::size_t{emitter.firstSpan} + i;
      const SpawnSpan& span = tables_.spans[index];
      const bool times = within(span.begin, 0, effect.duration) && within(span.end, span.begin, effect.duration);
      const bool counts = span.first == born && span.count >= 1 && born + span.count <= kMaxCycleParticles;
      born += span.count;
      if (times && counts) continue;
      sink_.report(
          Rule::emitterSpans, placeOf<SpawnSpan>(kSectionSpans, index),
          fmt::format("{} particles from {} between {} and {} s.", span.count, span.first, span.begin, span.end));
      return false;
    }
    return true;
  }

  bool checkGiven(const EmitterRecord& emitter, const EffectRecord& effect) {
    float before = 0;
    for (std::uint32_t i = 0; i < emitter.givenCount; ++i) {
      const std::size_t index = std::size_t{emitter.firstGiven} + i;
      const GivenParticle& given = tables_.given[index];
      const Place place = placeOf<GivenParticle>(kSectionGiven, index);
      const bool times = within(given.time, before, effect.duration) && given.lifetime > 0 &&
                         given.lifetime <= emitter.lifetime[1] && given.life > 0;
      before = given.time;
      const bool look = within(given.age, 0, kMaxMagnitude) && within(given.life, 0, kMaxMagnitude) &&
                        within(given.radius, 0, kMaxMagnitude) && allWithin(given.colour, 0, 1);
      if (given.reserved != 0) sink_.report(Rule::tableReserved, place, "A reserved field of a particle is not.");
      if (times && look) continue;
      sink_.report(
          Rule::givenValues, place,
          fmt::format("Born at {} s for {} s, {} of {} s old, radius {}, colour {} {} {}.", given.time, given.lifetime,
                      given.age, given.life, given.radius, given.colour[0], given.colour[1], given.colour[2]));
      return false;
    }
    return true;
  }

  const TableView& view_;
  const EffectTables& tables_;
  IssueSink& sink_;
};

}  // namespace

void checkEffects(const TableView& view, IssueSink& sink) {
  EffectRules(view, sink).check();
}

}  // namespace billow::format
