// Where a playback is and where it goes. No window and no pack, so that it can be tested alone.
#ifndef BILLOW_VIEWER_TIMELINE_H
#define BILLOW_VIEWER_TIMELINE_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "billow/runtime/stream.h"

namespace billow::viewer {

using runtime::Loop;

// A moment that can be stepped to.
struct Tick {
  double time;          // seconds
  std::int32_t number;  // of the frame, as the user counts
  bool operator==(const Tick&) const = default;
};

inline constexpr double kMostSpeed = 4;

class Timeline {
 public:
  // Ticks ascend and there is at least one; the last lasts until `end`, which lies after it.
  Timeline(std::vector<Tick> ticks, double end);

  // Moves on by seconds of real time, 0 or more; nothing happens while paused.
  void advance(double seconds);
  void play();  // once more from the beginning, where `once` has come to its end
  void pause() { playing_ = false; }
  void seek(double time);       // clamped to what there is
  void step(int ticks);         // pauses; round the end, but for `once`
  void setSpeed(double speed);  // clamped to [-kMostSpeed, kMostSpeed]
  void setLoop(Loop loop);
  // Plays as the other does, from where it is.
  void goOnAs(const Timeline& other);
  // Whether it has the same ticks.
  bool sameTicks(const Timeline& other) const { return ticks_ == other.ticks_ && end_ == other.end_; }

  bool playing() const { return playing_; }
  double time() const { return time_; }
  double begin() const { return ticks_.front().time; }
  double end() const { return end_; }
  double speed() const { return speed_; }
  // The speed with the direction in which ping-pong, which turns at the last tick, now goes; 0 while paused.
  double velocity() const { return playing_ ? speed_ * (forward_ ? 1 : -1) : 0; }
  Loop loop() const { return loop_; }
  const std::vector<Tick>& ticks() const { return ticks_; }
  // The tick that began last.
  std::size_t tick() const;
  // Counts seeks, steps and turns: what cannot be foreseen from velocity().
  std::uint32_t jumps() const { return jumps_; }
  // Of those, what does not come of the loop either.
  std::uint32_t seeks() const { return seeks_; }

 private:
  void wrap(double time);
  // The end of what the loop plays.
  double last() const { return loop_ == Loop::pingPong ? ticks_.back().time : end_; }

  std::vector<Tick> ticks_;
  double end_;
  double time_;
  double speed_ = 1;
  Loop loop_ = Loop::loop;
  bool playing_ = true;
  bool forward_ = true;
  std::uint32_t jumps_ = 0, seeks_ = 0;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_TIMELINE_H
