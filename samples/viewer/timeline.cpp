#include "timeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace billow::viewer {

Timeline::Timeline(std::vector<Tick> ticks, double end)
    : ticks_(std::move(ticks)), end_(end), time_(ticks_.front().time) {}

void Timeline::advance(double seconds) {
  if (playing_) wrap(std::min(time_, last()) + seconds * velocity());
}

// Takes a time that may lie outside back to where the loop leads.
void Timeline::wrap(double time) {
  const double length = last() - begin();
  if (time >= begin() && time < last()) {
    time_ = time;
    return;
  }
  ++jumps_;
  if (loop_ == Loop::once) {
    playing_ = false;
    time_ = time < begin() ? begin() : ticks_.back().time;
    return;
  }
  const double period = loop_ == Loop::loop ? length : 2 * length;
  double offset = period > 0 ? std::fmod(time - begin(), period) : 0;
  if (offset < 0) offset += period;
  if (offset > length) {  // of ping-pong alone: on the way back
    offset = 2 * length - offset;
    forward_ = !forward_;
  }
  // The end itself belongs to the next round.
  time_ = std::min(begin() + offset, std::nextafter(end_, begin()));
}

void Timeline::play() {
  playing_ = true;
  if (loop_ != Loop::once) return;
  if (speed_ > 0 && time_ >= ticks_.back().time) seek(begin());
  if (speed_ < 0 && time_ <= begin()) seek(ticks_.back().time);
}

void Timeline::seek(double time) {
  time_ = std::clamp(time, begin(), std::nextafter(end_, begin()));
  ++jumps_;
  ++seeks_;
}

void Timeline::step(int ticks) {
  const auto count = static_cast<std::int64_t>(ticks_.size());
  std::int64_t to = static_cast<std::int64_t>(tick()) + ticks;
  to = loop_ == Loop::once ? std::clamp<std::int64_t>(to, 0, count - 1) : ((to % count) + count) % count;
  pause();
  seek(ticks_[static_cast<std::size_t>(to)].time);
}

void Timeline::setSpeed(double speed) {
  speed_ = std::clamp(speed, -kMostSpeed, kMostSpeed);
}

void Timeline::setLoop(Loop loop) {
  loop_ = loop;
  forward_ = true;
  ++jumps_;
  ++seeks_;
}

void Timeline::goOnAs(const Timeline& other) {
  speed_ = other.speed_;
  loop_ = other.loop_;
  playing_ = other.playing_;
  forward_ = other.forward_;
  jumps_ = other.jumps_;
  seeks_ = other.seeks_;
  seek(other.time_);
}

std::size_t Timeline::tick() const {
  // What rounding takes away must not cost a tick.
  const double now = time_ + 1e-6 * (end_ - begin()) / static_cast<double>(ticks_.size());
  const auto next = std::upper_bound(ticks_.begin(), ticks_.end(), now,
                                     [](double time, const Tick& tick) { return time < tick.time; });
  return next == ticks_.begin() ? 0 : static_cast<std::size_t>(next - ticks_.begin() - 1);
}

}  // namespace billow::viewer
