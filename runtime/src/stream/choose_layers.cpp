#include <algorithm>
#include <cmath>

#include "players.h"

namespace billow::runtime {
namespace {

constexpr std::uint32_t kFarthestBack = 16;  // frames that are looked at for a moment that has just passed

// The level to draw of a frame: the one that is asked for, else the nearest finer, else the nearest coarser one.
std::uint32_t bestLevel(const Track& track, std::uint32_t frame, std::uint32_t level) {
  const std::uint32_t levels = track.clip->levelCount();
  const Track::Slot* slots = &track.slots[std::size_t{frame} * levels];
  for (std::uint32_t l = level + 1; l-- > 0;) {
    if (slots[l].frame != nullptr) return l;
  }
  for (std::uint32_t l = level + 1; l < levels; ++l) {
    if (slots[l].frame != nullptr) return l;
  }
  return format::kNone;
}

class Chooser {
 public:
  Chooser(const Track& track, Player& player, Shown& shown, float seconds)
      : track_(track),
        player_(player),
        shown_(shown),
        seconds_(seconds),
        levels_(track.clip->levelCount()),
        level_(std::min<std::uint32_t>(player.level, levels_ - 1)) {}

  // The level of the frame that can be drawn, or kNone.
  std::uint32_t best(std::uint32_t frame) const { return bestLevel(track_, track_.clip->same[frame], level_); }

  void begin() {
    shown_.count = 0;
    shown_.coarse = false;
    fades_ = 0;
  }

  // Layers of a frame whose best level is `best`.
  void add(std::uint32_t frame, std::uint32_t best, float weight, double carried) {
    Fade fade = fadeOf(track_.clip->same[frame], best);
    if (fade.progress < 1) {
      addLayer(fade.frame, fade.from, weight * (1 - fade.progress), carried);
      addLayer(fade.frame, fade.to, weight * fade.progress, carried);
    } else {
      addLayer(fade.frame, fade.to, weight, carried);
    }
    const std::uint32_t ideal = player_.ideal;
    shown_.coarse = shown_.coarse || fade.to > ideal || (fade.progress < 1 && fade.from > ideal);
    if (fades_ < 2) next_[fades_++] = fade;
  }

  void end() {
    for (std::uint32_t i = 0; i < 2; ++i) player_.fades[i] = i < fades_ ? next_[i] : Fade{};
  }

 private:
  bool resident(std::uint32_t frame, std::uint32_t level) const {
    return track_.slots[std::size_t{frame} * levels_ + level].frame != nullptr;
  }

  Fade fadeOf(std::uint32_t frame, std::uint32_t best) const {
    Fade fade{.frame = frame, .from = static_cast<std::uint8_t>(best), .to = static_cast<std::uint8_t>(best)};
    for (const Fade& known : player_.fades) {
      if (known.frame != frame) continue;
      fade = known;
      fade.seen = std::min(fade.seen + seconds_, kFadeSeconds);
    }
    if (fade.to != best) turn(fade, best);
    if (fade.progress < 1) {
      fade.progress = fade.length > seconds_ ? std::min(fade.progress + seconds_ / fade.length, 1.0f) : 1;
      if (!resident(frame, fade.from)) fade.progress = 1;
    }
    return fade;
  }

  void turn(Fade& fade, std::uint32_t best) const {
    if (fade.progress < 1 && fade.from == best) {
      std::swap(fade.from, fade.to);
      fade.progress = 1 - fade.progress;
      return;
    }
    // Of three levels at once the one that is drawn most goes on.
    if (fade.progress >= 0.5f || !resident(fade.frame, fade.from)) fade.from = fade.to;
    fade.to = static_cast<std::uint8_t>(best);
    fade.length = fade.seen;
    fade.progress = 0;
  }

  void addLayer(std::uint32_t frame, std::uint32_t level, float weight, double carried) {
    const std::uint32_t item = frame * levels_ + level;
    shown_.items[shown_.count] = item;
    shown_.weights[shown_.count] = weight;
    shown_.advect[shown_.count] = static_cast<float>(carried);
    ++shown_.count;
  }

  const Track& track_;
  Player& player_;
  Shown& shown_;
  float seconds_;
  std::uint32_t levels_;
  std::uint32_t level_;
  Fade next_[2];
  std::uint32_t fades_ = 0;
};

// A frame that the play has just passed and that is nearer to the moment than what was drawn last.
std::uint32_t passedFrame(const Track& track, const InstanceView& view, Player& player, const Chooser& chooser) {
  if (view.playback.speed == 0) return format::kNone;
  Walk back(track.clip->timeline, view.playback.loop, view.phase, !(view.playback.speed > 0));
  for (std::uint32_t i = 0; i < kFarthestBack && back.next(); ++i) {
    if (back.until() >= player.passed) return format::kNone;
    const std::uint32_t frame = back.forward() ? back.b() : back.a();
    if (chooser.best(frame) == format::kNone) continue;
    player.passed = back.until();
    return frame;
  }
  return format::kNone;
}

// Keeps what was drawn, as far as it is resident. Where it is given up, a coarser level of the same moment may be left.
void hold(const Track& track, Shown& shown, Player& player) {
  Shown kept = shown;
  kept.count = 0;
  kept.held = true;
  kept.coarse = false;
  float sum = 0;
  for (std::uint32_t i = 0; i < shown.count; ++i) {
    std::uint32_t item = shown.items[i];
    if (track.slots[item].frame == nullptr) {
      const std::uint32_t frame = track.clip->frameOf(item);
      const std::uint32_t level = bestLevel(track, frame, track.clip->levelOf(item));
      if (level == format::kNone) continue;
      item = frame * track.clip->levelCount() + level;
    }
    kept.coarse = kept.coarse || track.clip->levelOf(item) > player.ideal;
    kept.items[kept.count] = item;
    kept.weights[kept.count] = shown.weights[i];
    kept.advect[kept.count] = shown.advect[i];
    ++kept.count;
    sum += shown.weights[i];
  }
  for (std::uint32_t i = 0; i < kept.count; ++i) {
    kept.weights[i] = sum > 0 ? kept.weights[i] / sum : 1.0f / static_cast<float>(kept.count);
  }
  for (Fade& fade : player.fades) fade = {};
  shown = kept;
}

}  // namespace

void chooseLayers(const Track& track, const InstanceView& view, Player& player, Shown& shown, double moved,
                  float seconds) {
  player.steady.version = 0;
  const Moment moment = momentAt(track.clip->timeline, view.playback.loop, view.phase, player.near);
  player.near = moment.a;
  Chooser chooser(track, player, shown, seconds);
  const bool hold_ = view.playback.interpolation == Interpolation::hold;
  const bool one = hold_ || moment.fraction <= 0 || track.clip->same[moment.a] == track.clip->same[moment.b];
  const std::uint32_t bestA = chooser.best(moment.a);
  const std::uint32_t bestB = one ? format::kNone : chooser.best(moment.b);
  if (bestA == format::kNone && bestB == format::kNone) {
    player.passed += std::abs(moved);
    const std::uint32_t frame = passedFrame(track, view, player, chooser);
    if (frame == format::kNone) return hold(track, shown, player);
    chooser.begin();
    chooser.add(frame, chooser.best(frame), 1, 0);
    chooser.end();
    shown.time = track.clip->timeline.start(frame);
    shown.held = true;
    return;
  }
  const bool advect = view.playback.interpolation == Interpolation::advect && track.clip->velocity;
  const float fraction = bestB == format::kNone ? 0 : bestA == format::kNone ? 1 : moment.fraction;
  chooser.begin();
  if (bestA != format::kNone) chooser.add(moment.a, bestA, 1 - fraction, advect ? moment.sinceA : 0);
  if (bestB != format::kNone) chooser.add(moment.b, bestB, fraction, advect ? -moment.untilB : 0);
  chooser.end();
  shown.time = moment.time;
  shown.held = false;
  player.passed = 0;
  // On the way back of a ping-pong time and phase go apart; a fade changes weights by itself, and ends.
  const std::uint32_t all = one ? 1 : 2;
  const bool back = view.playback.loop == Loop::pingPong && view.phase >= track.clip->timeline.last();
  if (back || shown.count != all || player.fades[0].progress < 1 || player.fades[1].progress < 1) return;
  if (!hold_ && moment.fraction <= 0) return;
  player.steady = {.from = track.clip->timeline.start(moment.a),
                   .until = track.clip->timeline.start(moment.a + 1),
                   .version = track.version,
                   .carries = advect};
}

bool goOn(const Track& track, const InstanceView& view, Player& player, Shown& shown, float seconds) {
  const Steady& steady = player.steady;
  if (steady.version != track.version || !(view.phase > steady.from) || !(view.phase < steady.until)) return false;
  const double since = view.phase - steady.from;
  if (shown.count == 2) {
    const float fraction = std::min(static_cast<float>(since / (steady.until - steady.from)), 0.99999994f);
    if (fraction <= 0) return false;
    shown.weights[0] = 1 - fraction;
    shown.weights[1] = fraction;
  }
  if (steady.carries) {
    shown.advect[0] = static_cast<float>(since);
    if (shown.count == 2) shown.advect[1] = -static_cast<float>(steady.until - view.phase);
  }
  for (Fade& fade : player.fades) fade.seen = std::min(fade.seen + seconds, kFadeSeconds);
  shown.time = view.phase;
  return true;
}

}  // namespace billow::runtime
