// Where an instance must be in its sequence, by what stream.h says, kept apart from the code that it judges. Where
// that leaves it open (which way a ping-pong goes), there are several places.
#ifndef BILLOW_TESTS_SOAK_CLOCK_H
#define BILLOW_TESTS_SOAK_CLOCK_H

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "billow/runtime/stream.h"
#include "soak_packs.h"

namespace billow::tests {

class SoakClock {
 public:
  using Loop = runtime::Loop;

  SoakClock(const SoakPack& pack, const runtime::Playback& playback, double time)
      : last_(pack.last), length_(pack.length), playback_(playback) {
    place(time);
  }

  const runtime::Playback& playback() const { return playback_; }

  void seek(double time) { place(time); }
  void set(const runtime::Playback& playback) {
    const bool turns = playback_.loop != playback.loop;
    const std::vector<double> before = times();
    playback_ = playback;
    if (!turns) return;
    phases_.clear();
    for (const double time : before) add(time);
  }
  void advance(double seconds) {
    for (double& phase : phases_) phase = wrapped(phase + seconds * playback_.speed);
  }
  // From some moment on the sequence may be another one: nothing is known any more.
  void forget() { unsure_ = true; }

  // Whether that time may be shown now. Places that it excludes are forgotten.
  bool agrees(double time) {
    if (unsure_) return time >= 0;
    std::vector<double> left;
    for (const double phase : phases_) {
      if (near(timeOf(phase), time)) left.push_back(phase);
    }
    if (left.empty()) return false;
    phases_ = left;
    return true;
  }
  std::vector<double> times() const {
    std::vector<double> all;
    for (const double phase : phases_) all.push_back(timeOf(phase));
    return all;
  }

 private:
  void place(double time) {
    phases_.clear();
    add(time);
  }
  void add(double time) {
    if (playback_.loop != Loop::pingPong) return phases_.push_back(wrapped(time));
    const double inside = std::clamp(time, 0.0, last_);
    phases_.push_back(inside);
    phases_.push_back(2 * last_ - inside);
  }
  double wrapped(double phase) const {
    if (playback_.loop == Loop::once) return std::clamp(phase, 0.0, last_);
    const double period = playback_.loop == Loop::loop ? length_ : 2 * last_;
    if (period <= 0) return 0;
    const double rest = std::fmod(phase, period);
    return rest < 0 ? rest + period : rest;
  }
  double timeOf(double phase) const {
    return playback_.loop == Loop::pingPong && phase > last_ ? 2 * last_ - phase : phase;
  }
  bool near(double a, double b) const {
    const double apart = std::abs(a - b);
    return apart < 1e-6 || (playback_.loop == Loop::loop && length_ - apart < 1e-6);
  }

  double last_, length_;
  runtime::Playback playback_;
  std::vector<double> phases_;
  bool unsure_ = false;
};

// What must be drawn of a moment in full detail.
struct SoakMoment {
  std::uint32_t a = 0, b = 0;
  double share = 0;      // of b
  bool certain = false;  // not so near to a frame's begin that rounding decides
};

inline SoakMoment soakMoment(const SoakPack& pack, const runtime::Playback& playback, double time) {
  SoakMoment moment;
  const double frames = time * kSoakRate;
  moment.a = std::min(static_cast<std::uint32_t>(std::max(frames, 0.0)), pack.frames - 1);
  const bool ends = moment.a + 1 == pack.frames;
  moment.b = !ends ? moment.a + 1 : playback.loop == runtime::Loop::loop ? 0 : moment.a;
  moment.share = frames - moment.a;
  moment.certain = moment.share > 1e-4 && moment.share < 1 - 1e-4;
  if (moment.b == moment.a || playback.interpolation == runtime::Interpolation::hold) {
    moment.b = moment.a;
    moment.certain = moment.certain || (moment.a == 0 && pack.frames == 1) || ends;
  }
  return moment;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SOAK_CLOCK_H
