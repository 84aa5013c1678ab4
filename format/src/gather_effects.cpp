#include "billow/format/gather_effects.h"

#include <algorithm>
#include <span>
#include <vector>

namespace billow::format {
namespace {

static_assert(kNoRow == kNoMap && kNoRow == kNoTrack);

// Appends `count` records, unless the very same were appended before; what refers to nothing stays so.
template <class T, class Places>
std::uint32_t take(const std::vector<T>& from, std::uint32_t first, std::uint32_t count, Places& places,
                   std::vector<T>& to) {
  if (first == kNoRow) return kNoRow;
  const auto [place, isNew] = places.try_emplace({first, count}, static_cast<std::uint32_t>(to.size()));
  if (isNew) to.insert(to.end(), from.begin() + first, from.begin() + first + count);
  return place->second;
}

}  // namespace

std::uint32_t GatheredEffects::add(const EffectTables& source, std::uint32_t effect, float density, float fire) {
  Moved& moved = moved_[&source];
  const auto [place, isNew] =
      moved.effects.try_emplace({effect, density, fire}, static_cast<std::uint32_t>(tables_.effects.size()));
  if (!isNew) return place->second;
  EffectRecord record = source.effects[effect];
  const auto emitters = std::span(source.emitters).subspan(record.firstEmitter, record.emitterCount);
  record.name = {};
  record.firstEmitter = static_cast<std::uint32_t>(tables_.emitters.size());
  for (const EmitterRecord& emitter : emitters) {
    tables_.emitters.push_back(moveEmitter(source, moved, emitter));
    EmitterRecord& mine = tables_.emitters.back();
    mine.extinction = std::min(mine.extinction * density, kMaxMagnitude);
    for (float& radiance : mine.emission) radiance = std::min(radiance * fire, kMaxMagnitude);
  }
  tables_.effects.push_back(record);
  return place->second;
}

EmitterRecord GatheredEffects::moveEmitter(const EffectTables& source, Moved& moved, const EmitterRecord& emitter) {
  EmitterRecord record = emitter;
  record.name = {};
  const auto spans = std::span(source.spans).subspan(emitter.firstSpan, emitter.spanCount);
  record.firstSpan = static_cast<std::uint32_t>(tables_.spans.size());
  tables_.spans.insert(tables_.spans.end(), spans.begin(), spans.end());
  if (emitter.givenCount != 0) {
    const auto given = std::span(source.given).subspan(emitter.firstGiven, emitter.givenCount);
    record.firstGiven = static_cast<std::uint32_t>(tables_.given.size());
    tables_.given.insert(tables_.given.end(), given.begin(), given.end());
  }
  for (std::uint32_t* row : {&record.positionRow, &record.diffuseRow, &record.emissionRow}) {
    *row = take(source.curves, *row, 3, moved.curves, tables_.curves);
  }
  for (std::uint32_t* row : {&record.radiusRow, &record.opacityRow, &record.rotationRow, &record.displacementRow}) {
    *row = take(source.curves, *row, 1, moved.curves, tables_.curves);
  }
  record.firstMap = take(source.maps, record.firstMap, record.mapCount, moved.maps, tables_.maps);
  if (record.pointCount != 0) {
    record.firstPoint =
        take(source.surfacePoints, record.firstPoint, record.pointCount, moved.surfacePoints, tables_.surfacePoints);
  }
  record.material = addMaterial(source, moved, record.material);
  record.track = addTrack(source, moved, record.track);
  return record;
}

std::uint32_t GatheredEffects::addMaterial(const EffectTables& source, Moved& moved, std::uint32_t number) {
  const bool known = moved.materials.contains({number, 1});
  const std::uint32_t place = take(source.materials, number, 1, moved.materials, tables_.materials);
  if (known) return place;
  ParticleMaterial& material = tables_.materials.back();
  material.profileRow = take(source.curves, material.profileRow, 1, moved.curves, tables_.curves);
  material.diffuseRamp = take(source.ramps, material.diffuseRamp, 1, moved.ramps, tables_.ramps);
  material.emissionRamp = take(source.ramps, material.emissionRamp, 1, moved.ramps, tables_.ramps);
  return place;
}

std::uint32_t GatheredEffects::addTrack(const EffectTables& source, Moved& moved, std::uint32_t number) {
  const bool known = number == kNoTrack || moved.tracks.contains({number, 1});
  const std::uint32_t place = take(source.tracks, number, 1, moved.tracks, tables_.tracks);
  if (known) return place;
  TrackRecord& track = tables_.tracks.back();
  const std::uint32_t first = track.firstFrame;
  track.firstFrame = static_cast<std::uint32_t>(tables_.trackFrames.size());
  for (std::uint32_t f = first; f < first + track.frameCount; ++f) {
    TrackFrame frame = source.trackFrames[f];
    const auto bytes = std::span(source.trackBytes).subspan(frame.offset, frame.size);
    frame.offset = tables_.trackBytes.size();
    tables_.trackBytes.insert(tables_.trackBytes.end(), bytes.begin(), bytes.end());
    tables_.trackFrames.push_back(frame);
    tables_.trackPoints.push_back(source.trackPoints[f]);
    tables_.trackRadii.push_back(source.trackRadii[f]);
  }
  return place;
}

}  // namespace billow::format
