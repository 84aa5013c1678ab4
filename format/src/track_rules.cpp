// The rules of tracks: their frames' places first, then what Draco makes of their bytes.
#include <fmt/format.h>

#include <cmath>

#include "rules.h"

namespace billow::format {
namespace {

constexpr float kFarthest = 1e9f;

bool soundPoints(std::span<const TrackPoint> points, std::span<const float> radii) {
  for (const float radius : radii) {
    if (!(radius >= 0 && radius <= kMaxTrackRadius)) return false;
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0 && points[i].number <= points[i - 1].number) return false;
    for (const float coordinate : points[i].position) {
      if (!(std::abs(coordinate) <= kFarthest)) return false;
    }
  }
  return true;
}

bool checkFrames(const TableView& view, IssueSink& sink) {
  const EffectTables& tables = *view.effects;
  std::uint64_t bytes = 0, points = 0;
  for (std::size_t i = 0; i < tables.trackFrames.size(); ++i) {
    const TrackFrame& frame = tables.trackFrames[i];
    const bool follows = frame.offset == bytes;
    bytes += frame.size;
    points += frame.count;
    if (follows && bytes <= tables.trackBytes.size() && frame.size <= kTrackFrameBytes && points <= kMaxTrackPoints) {
      continue;
    }
    sink.report(Rule::trackRanges, view.place(kSectionTrackFrames, i * sizeof(TrackFrame)),
                fmt::format("{} points in {} bytes at {}.", frame.count, frame.size, frame.offset));
    return false;
  }
  if (bytes == tables.trackBytes.size()) return true;
  sink.report(Rule::trackRanges, view.place(kSectionTrackBytes, 0),
              fmt::format("The frames take {} of {} bytes.", bytes, tables.trackBytes.size()));
  return false;
}

}  // namespace

bool checkTracks(const TableView& view, IssueSink& sink) {
  const EffectTables& tables = *view.effects;
  std::uint64_t frames = 0;
  for (std::size_t i = 0; i < tables.tracks.size(); ++i) {
    const TrackRecord& track = tables.tracks[i];
    const bool follows = track.firstFrame == frames;
    frames += track.frameCount;
    const bool rate = track.framesPerSecond >= kMinTrackRate && track.framesPerSecond <= kMaxTrackRate;
    if (follows && rate && track.frameCount >= 1 && track.frameCount <= kMaxTrackFrames &&
        frames <= tables.trackFrames.size() && (track.flags & ~kTrackRadii) == 0) {
      continue;
    }
    sink.report(
        Rule::trackRanges, view.place(kSectionTracks, i * sizeof(TrackRecord)),
        fmt::format("{} frames from {} at {} a second.", track.frameCount, track.firstFrame, track.framesPerSecond));
    return false;
  }
  if (frames == tables.trackFrames.size()) return checkFrames(view, sink);
  sink.report(Rule::trackRanges, view.place(kSectionTrackFrames, 0),
              fmt::format("The tracks own {} of {} frames.", frames, tables.trackFrames.size()));
  return false;
}

void loadTracks(const TableView& view, EffectTables& tables, IssueSink& sink) {
  tables.trackPoints.resize(tables.trackFrames.size());
  tables.trackRadii.resize(tables.trackFrames.size());
  for (const TrackRecord& track : tables.tracks) {
    const bool hasRadii = (track.flags & kTrackRadii) != 0;
    for (std::uint32_t f = 0; f < track.frameCount && !sink.stopped(); ++f) {
      const std::size_t i = std::size_t{track.firstFrame} + f;
      const TrackFrame& frame = tables.trackFrames[i];
      const auto bytes = std::span(tables.trackBytes).subspan(frame.offset, frame.size);
      if (decodeTrackFrame(bytes, frame.count, hasRadii, tables.trackPoints[i], tables.trackRadii[i]) &&
          soundPoints(tables.trackPoints[i], tables.trackRadii[i])) {
        continue;
      }
      tables.trackPoints[i].clear();
      tables.trackRadii[i].clear();
      sink.report(Rule::trackData, view.place(kSectionTrackBytes, frame.offset),
                  fmt::format("Frame {} of {} points in {} bytes.", i, frame.count, frame.size));
    }
  }
}

}  // namespace billow::format
