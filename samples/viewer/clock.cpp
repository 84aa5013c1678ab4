#include "clock.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace billow::viewer {
namespace {

constexpr double kSoon = 1;         // seconds before a volume shows at which its first frames are asked for
constexpr double kRounding = 1e-5;  // frames; what rounding takes away must not cost one

using Frames = std::span<const format::FrameRecord>;

// The beginning of a frame, where `time` is as good as that.
double snapped(const Frames& frames, double time, double rounding) {
  const auto next =
      std::lower_bound(frames.begin(), frames.end(), time - rounding,
                       [](const format::FrameRecord& frame, double before) { return frame.time < before; });
  return next != frames.end() && std::abs(next->time - time) <= rounding ? next->time : time;
}

Clock stillAt(const Frames& frames, std::uint32_t frame) {
  return {.time = frames[frame].time - frames[0].time,
          .playback = {.speed = 0, .loop = Loop::once, .interpolation = runtime::Interpolation::hold},
          .shown = true,
          .wanted = true};
}

}  // namespace

Clock clockOf(const command::PlacedVolume& volume, const command::RenderRequest& request, const Timeline& timeline) {
  const Frames frames = volume.pack->framesOf(volume.record());
  if (frames.empty()) return {};
  if (volume.still) return stillAt(frames, *volume.still);
  const double rate = double{volume.record().framesPerSecond}, frameTime = 1 / rate;
  const double factor = volume.request->framesPerSecond.value_or(rate) / rate;
  const double rounding = kRounding * frameTime;
  const double first = frames.front().time, last = frames.back().time;
  double time = (timeline.time() - volume.request->begin) * factor;
  if (request.scene && volume.request->after == command::AfterLast::loop && time > first) {
    time = first + std::fmod(time - first + rounding, last - first + frameTime) - rounding;
  }
  time = snapped(frames, time, rounding);

  Clock clock{.time = time - first, .playback = {.interpolation = request.interpolate}};
  if (request.scene) {
    clock.playback.speed = timeline.velocity() * factor;
    clock.playback.loop = volume.request->after == command::AfterLast::loop ? Loop::loop : Loop::once;
  } else {
    // The time line is the volume's own: it goes round as this does.
    clock.playback.speed = timeline.playing() ? timeline.speed() : 0;
    clock.playback.loop = timeline.loop();
  }
  if (time < first) clock.part = Clock::Part::before;
  if (time > last && clock.playback.loop == Loop::once) clock.part = Clock::Part::after;
  // What waits at an end goes on when the time line comes to it.
  if (clock.part != Clock::Part::within) clock.playback.speed = 0;
  clock.time = std::max(clock.time, 0.0);
  const bool gone = volume.request->after == command::AfterLast::vanish && time >= last + frameTime;
  clock.shown = clock.part != Clock::Part::before && !gone;
  clock.wanted = clock.shown || (clock.part == Clock::Part::before && first - time < kSoon * factor);
  return clock;
}

}  // namespace billow::viewer
