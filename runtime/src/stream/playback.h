// Where an instance is in its sequence, and what comes next: seconds, not frames.
#ifndef BILLOW_RUNTIME_STREAM_PLAYBACK_H
#define BILLOW_RUNTIME_STREAM_PLAYBACK_H

#include <cstdint>
#include <span>
#include <vector>

#include "billow/format/layout.h"
#include "billow/runtime/stream.h"

namespace billow::runtime {

// When the frames of a volume begin, in seconds. After the last frame follows one frame's time by the volume's rate.
class Timeline {
 public:
  Timeline() = default;
  Timeline(std::span<const format::FrameRecord> frames, float framesPerSecond);

  std::uint32_t frames() const { return static_cast<std::uint32_t>(starts_.size()) - 1; }  // 1 or more
  double start(std::uint32_t frame) const { return starts_[frame]; }                       // of frames(): the end
  double last() const { return starts_[starts_.size() - 2]; }
  double length() const { return starts_.back(); }
  // The frame that began last at `time`, 0 before the first. `near` is tried first.
  std::uint32_t frameAt(double time, std::uint32_t near) const;

 private:
  std::vector<double> starts_{0, 1};
};

// The phase says where in a period an instance is: Loop::loop plays from 0 to length(), Loop::once from 0 to last(),
// Loop::pingPong from 0 to last() and, as the phase goes on to twice that, back again. It is always wrapped, so that it
// is as exact after days as at first.
double wrapPhase(const Timeline& timeline, Loop loop, double phase);

// The phase at which `time` is shown, in the direction in which `phase` goes.
double phaseAt(const Timeline& timeline, Loop loop, double time, double phase);

struct Moment {
  std::uint32_t a = 0, b = 0;     // frames; b is a where nothing follows
  float fraction = 0;             // of the way from a to b, in [0, 1)
  double time = 0;                // volume seconds
  double sinceA = 0, untilB = 0;  // volume seconds
};
Moment momentAt(const Timeline& timeline, Loop loop, double phase, std::uint32_t near);

// Whether time goes forward there, at this sign of speed.
inline bool goesForward(const Timeline& timeline, Loop loop, double phase, bool positive) {
  const bool back = loop == Loop::pingPong && (positive ? phase >= timeline.last() : phase > timeline.last());
  return positive != back;
}

// Whether it draws the same moment until somebody changes that.
inline bool stands(const Timeline& timeline, const Playback& playback, double phase) {
  if (playback.speed == 0) return true;
  return playback.loop == Loop::once && (playback.speed > 0 ? phase >= timeline.last() : phase <= 0);
}

// A walk through the intervals between frames in playing order, from the one that a phase lies in.
class Walk {
 public:
  Walk(const Timeline& timeline, Loop loop, double phase, bool positive);
  // Into the next interval; false at an end where the first or last frame is held.
  bool next();
  std::uint32_t a() const { return interval_; }
  std::uint32_t b() const;
  bool forward() const { return forward_; }
  double until() const { return until_; }  // volume seconds from the phase until the interval begins

 private:
  const Timeline& timeline_;
  Loop loop_;
  bool forward_;
  std::uint32_t interval_;
  double until_ = 0;
  double rest_;  // of the interval, volume seconds
};

// Calls visit(frame, seconds) for frames in the order in which they are first needed, `seconds` of real time from now,
// up to `horizon`; not for those that the moment itself needs. Frames may come again.
inline constexpr std::uint32_t kMostComing = 96;
template <class Visit>
void comingFrames(const Timeline& timeline, const Playback& playback, double phase, double horizon,
                  const Visit& visit) {
  const double speed = playback.speed < 0 ? -playback.speed : playback.speed;
  if (!(speed > 0)) return;
  const bool hold = playback.interpolation == Interpolation::hold;
  Walk walk(timeline, playback.loop, phase, playback.speed > 0);
  for (std::uint32_t i = 0; i < kMostComing && walk.next(); ++i) {
    const double seconds = walk.until() / speed;
    if (!(seconds <= horizon)) return;
    visit(hold || !walk.forward() ? walk.a() : walk.b(), seconds);
  }
}

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PLAYBACK_H
