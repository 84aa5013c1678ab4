#include <algorithm>
#include <cmath>

#include "planner.h"

namespace billow::runtime {

bool Planner::anyLevel(const PlannedClip& clip, std::uint32_t frame) const {
  const std::uint32_t levels = clip.clip->levelCount();
  for (std::uint32_t level = 0; level < levels; ++level) {
    const Item& item = clip.items[clip.clip->item(frame, level)];
    if (item.resident && !item.leaving) return true;
  }
  return false;
}

// The finest level that can be had, at `level` or coarser; finer ones where those are corrupt.
static std::uint32_t soundLevel(const PlannedClip& clip, std::uint32_t frame, std::uint32_t level) {
  const std::uint32_t levels = clip.clip->levelCount();
  for (std::uint32_t l = level; l < levels; ++l) {
    if (!clip.items[clip.clip->item(frame, l)].corrupt) return l;
  }
  for (std::uint32_t l = level; l-- > 0;) {
    if (!clip.items[clip.clip->item(frame, l)].corrupt) return l;
  }
  return levels;
}

void Planner::want(std::uint32_t number, std::uint32_t frame, std::uint32_t level, Tier tier, double seconds,
                   double importance) {
  PlannedClip& clip = clips_[number];
  level = soundLevel(clip, frame, level);
  if (level == clip.clip->levelCount()) return;
  const std::uint32_t index = clip.clip->item(frame, level);
  Item& item = clip.items[index];
  if (item.wanted == passes_) {
    Want& known = wants_[item.want];
    known.tier = std::min<std::uint32_t>(known.tier, tier);
    known.seconds = std::min(known.seconds, seconds);
    known.importance = std::max(known.importance, importance);
    return;
  }
  item.wanted = passes_;
  item.want = static_cast<std::uint32_t>(wants_.size());
  wants_.push_back(
      {.clip = number, .item = index, .tier = tier, .seconds = seconds, .importance = importance, .fits = false});
}

void Planner::gatherNow(const InstanceView& instance, std::uint32_t number, double phase, double importance,
                        std::uint32_t level) {
  PlannedClip& clip = clips_[number];
  const Moment moment = momentAt(clip.clip->timeline, instance.playback.loop, phase, 0);
  const std::uint32_t last = clip.clip->levelCount() - 1;
  const bool hold = instance.playback.interpolation == Interpolation::hold;
  level = std::min(level, last);
  const bool one = hold || moment.b == moment.a || (instance.playback.speed == 0 && moment.fraction <= 0);
  const bool nothing = !anyLevel(clip, moment.a) && (one || !anyLevel(clip, moment.b));
  const double speed = std::max(std::abs(instance.playback.speed), 1e-9);
  const bool forward = goesForward(clip.clip->timeline, instance.playback.loop, phase, instance.playback.speed >= 0);
  // A frame that is gone before it can arrive is left for later ones, save where nothing at all was ever drawn.
  const auto late = [&](std::uint32_t frame) {
    if (forward != (frame == moment.a) || moment.b == moment.a || instance.drawnCount == 0) return false;
    const Item& item = clip.items[clip.clip->item(frame, level)];
    const double stays = (forward ? moment.untilB : moment.sinceA) / speed;
    return !item.resident && item.ticket == 0 && stays < latency_;
  };
  const std::uint32_t quick =
      one || (moment.fraction < 0.5f && !late(moment.a)) || late(moment.b) ? moment.a : moment.b;
  for (int i = 0; i < (one ? 1 : 2); ++i) {
    const std::uint32_t frame = i == 0 ? moment.a : moment.b;
    if (nothing && frame == quick && !late(frame)) want(number, frame, last, kQuick, 0, importance);
    want(number, frame, level, late(frame) ? kLate : kNow, 0, importance);
  }
}

void Planner::gatherComing(const InstanceView& instance, std::uint32_t number, double phase, double importance,
                           std::uint32_t level) {
  const Clip& clip = *clips_[number].clip;
  level = std::min(level, clip.levelCount() - 1);
  const double latency = std::min(latency_, kLongestLatency);
  const double horizon = config_.prefetchSeconds + latency;
  comingFrames(clip.timeline, instance.playback, phase, horizon, [&](std::uint32_t frame, double seconds) {
    const Item& item = clips_[number].items[clip.item(frame, level)];
    const bool late = !item.resident && item.ticket == 0 && seconds < 0.8 * latency;
    want(number, frame, level, late ? kLate : kSoon, seconds, importance);
  });
}

void Planner::gather(const Snapshot& snapshot) {
  wants_.clear();
  for (const Detail::Ranked& ranked : detail_.ranked()) {
    const InstanceView& instance = snapshot.instances[ranked.instance];
    if (clips_[instance.clip].clip == nullptr) continue;
    const auto importance = static_cast<double>(ranked.importance);
    gatherNow(instance, instance.clip, instance.phase, importance, ranked.level);
    if (instance.successor != format::kNone && clips_[instance.successor].clip != nullptr) {
      const double phase = successorPhase(*clips_[instance.clip].clip, *clips_[instance.successor].clip, instance);
      gatherNow(instance, instance.successor, phase, importance, ranked.level);
      gatherComing(instance, instance.successor, phase, importance, ranked.level);
    }
    gatherComing(instance, instance.clip, instance.phase, importance, ranked.level);
  }
  if (shrunkFrom_) {
    // Held ones are of no moment, but drawn.
    for (const Resident& resident : residents_) {
      const PlannedClip& clip = clips_[resident.clip];
      const Item& item = clip.items[resident.item];
      if (!item.moving || item.leaving || item.drawn != passes_) continue;
      want(resident.clip, clip.clip->frameOf(resident.item), clip.clip->levelOf(resident.item), kNow, 0, 0);
    }
  }
  const double step = std::max(config_.prefetchSeconds, 0.01) / 32;
  const auto steps = [&](double seconds) { return static_cast<int>(std::min(seconds / step, 1e6)); };
  std::sort(wants_.begin(), wants_.end(), [&](const Want& x, const Want& y) {
    if (x.tier != y.tier) return x.tier < y.tier;
    // In steps of time, and where that is the same the larger in the picture first.
    const int s = steps(x.seconds), t = steps(y.seconds);
    if (s != t) return s < t;
    if (x.importance != y.importance) return x.importance > y.importance;
    return x.clip != y.clip ? x.clip < y.clip : x.item < y.item;
  });
  for (std::uint32_t i = 0; i < wants_.size(); ++i) {
    Item& item = clips_[wants_[i].clip].items[wants_[i].item];
    item.want = i;
    item.used = snapshot.now;
  }
}

void Planner::markDrawn(const Snapshot& snapshot) {
  for (const InstanceView& instance : snapshot.instances) {
    PlannedClip& clip = clips_[instance.clip];
    if (clip.clip == nullptr) continue;
    for (std::uint32_t i = 0; i < instance.drawnCount; ++i) {
      clip.items[instance.drawn[i]].drawn = passes_;
      clip.items[instance.drawn[i]].used = snapshot.now;
      if (instance.drawnCount == 1) clip.items[instance.drawn[i]].alone = passes_;
    }
  }
}

}  // namespace billow::runtime
