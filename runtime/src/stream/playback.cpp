#include "playback.h"

#include <algorithm>
#include <cmath>

namespace billow::runtime {
namespace {

double periodOf(const Timeline& timeline, Loop loop) {
  return loop == Loop::loop ? timeline.length() : 2 * timeline.last();
}

}  // namespace

Timeline::Timeline(std::span<const format::FrameRecord> frames, float framesPerSecond) {
  if (frames.empty()) return;
  starts_.resize(frames.size() + 1);
  // A volume's seconds count from its first frame, whatever the record of that says.
  for (std::size_t i = 0; i < frames.size(); ++i) starts_[i] = frames[i].time - frames[0].time;
  starts_.back() = starts_[frames.size() - 1] + 1.0 / static_cast<double>(framesPerSecond);
}

std::uint32_t Timeline::frameAt(double time, std::uint32_t near) const {
  if (near < frames() && time >= starts_[near]) {
    if (time < starts_[near + 1]) return near;
    if (near + 1 < frames() && time < starts_[near + 2]) return near + 1;
  }
  const auto after = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, time);
  return static_cast<std::uint32_t>(after - starts_.begin()) - 1;
}

double wrapPhase(const Timeline& timeline, Loop loop, double phase) {
  if (loop == Loop::once) return std::clamp(phase, 0.0, timeline.last());
  const double period = periodOf(timeline, loop);
  if (phase >= 0 && phase < period) return phase;
  if (!(period > 0)) return 0;
  double wrapped = std::fmod(phase, period);
  if (wrapped < 0) wrapped += period;
  return wrapped < period ? wrapped : 0;
}

double phaseAt(const Timeline& timeline, Loop loop, double time, double phase) {
  if (loop != Loop::pingPong) return wrapPhase(timeline, loop, time);
  const double inside = std::clamp(time, 0.0, timeline.last());
  return wrapPhase(timeline, loop, phase > timeline.last() ? 2 * timeline.last() - inside : inside);
}

Moment momentAt(const Timeline& timeline, Loop loop, double phase, std::uint32_t near) {
  Moment moment;
  moment.time = loop == Loop::pingPong && phase > timeline.last() ? 2 * timeline.last() - phase : phase;
  moment.a = timeline.frameAt(moment.time, near);
  const double begin = timeline.start(moment.a);
  const double end = timeline.start(moment.a + 1);
  moment.b = moment.a + 1;
  if (moment.b == timeline.frames()) moment.b = loop == Loop::loop ? 0 : moment.a;
  if (moment.b == moment.a) return moment;
  moment.sinceA = std::max(moment.time - begin, 0.0);
  moment.untilB = std::max(end - moment.time, 0.0);
  const double length = end - begin;
  moment.fraction = length > 0 ? std::min(static_cast<float>(moment.sinceA / length), 0.99999994f) : 0;
  return moment;
}

Walk::Walk(const Timeline& timeline, Loop loop, double phase, bool positive)
    : timeline_(timeline), loop_(loop), forward_(goesForward(timeline, loop, phase, positive)) {
  const Moment moment = momentAt(timeline, loop, phase, 0);
  interval_ = moment.a;
  // The last frame of a ping-pong begins no interval: it is where the one before is turned round.
  if (loop == Loop::pingPong && interval_ + 1 == timeline.frames() && interval_ > 0) --interval_;
  rest_ = forward_ ? timeline.start(interval_ + 1) - moment.time : moment.time - timeline.start(interval_);
}

std::uint32_t Walk::b() const {
  if (interval_ + 1 < timeline_.frames()) return interval_ + 1;
  return loop_ == Loop::loop ? 0 : interval_;
}

bool Walk::next() {
  const std::uint32_t frames = timeline_.frames();
  const std::uint32_t last = loop_ == Loop::pingPong && frames > 1 ? frames - 2 : frames - 1;
  if (frames == 1) return false;
  until_ += std::max(rest_, 0.0);
  const bool atEnd = forward_ ? interval_ == last : interval_ == 0;
  if (!atEnd) {
    interval_ = forward_ ? interval_ + 1 : interval_ - 1;
  } else if (loop_ == Loop::loop) {
    interval_ = forward_ ? 0 : last;
  } else if (loop_ == Loop::pingPong) {
    forward_ = !forward_;
  } else {
    return false;
  }
  rest_ = timeline_.start(interval_ + 1) - timeline_.start(interval_);
  return true;
}

}  // namespace billow::runtime
