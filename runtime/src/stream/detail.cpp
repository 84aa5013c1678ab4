#include "detail.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::runtime {
namespace {

constexpr float kLevelPause = 1;     // seconds between changes of an instance's level to finer ones
constexpr float kLongestPause = 16;  // where the budget takes the finer level back again and again
constexpr double kFull = 0.95;       // of the budget, for what must be there at one time
constexpr double kFinerOnlyBelow = 0.75;
constexpr double kCoarserBelow = 0.8;  // pixels a voxel of the coarser level
constexpr double kFinerAbove = 1.25;   // pixels a voxel of the present level
// Seconds, beyond those of a load, after a change of level or a seek in which frames may still be coming.
constexpr double kSettles = 0.5;
constexpr double kStarved = 0.25;          // seconds without its level, of late, after which a coarser one is taken
constexpr double kForgets = 0.25;          // of each second in which it was there
constexpr double kLongestPass = 0.1;       // seconds between passes that are counted; a game may hang for more
constexpr std::uint32_t kMostNeeded = 32;  // frames, each way

// Distance along the view to the nearest of it, at least a voxel.
double distanceTo(const View& view, const InstanceView& instance, double least) {
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = instance.centre[i] - view.eye[i];
    square += d * d;
  }
  return std::max({std::sqrt(square) - instance.radius, least, 1e-30});
}

bool behind(const View& view, const InstanceView& instance) {
  double along = 0;
  for (std::size_t i = 0; i < 3; ++i)
    along += (instance.centre[i] - view.eye[i]) * static_cast<double>(view.forward[i]);
  return along < -instance.radius;
}

double importanceOf(const Snapshot& snapshot, const InstanceView& instance) {
  double size = 1;
  if (snapshot.view) {
    size = instance.radius / distanceTo(*snapshot.view, instance, instance.radius / 100);
    if (behind(*snapshot.view, instance)) size /= 16;
  }
  return size * static_cast<double>(instance.priority);
}

// The coarsest level whose voxels are about a pixel wide, near the one that was chosen before.
std::uint32_t idealLevel(const Snapshot& snapshot, const InstanceView& instance, const Clip& clip,
                         std::uint32_t before) {
  const std::uint32_t last = clip.levelCount() - 1;
  std::uint32_t level = std::min(before, last);
  const auto pixels = [&](std::uint32_t l) { return pixelsOf(snapshot, instance, clip.levels[l].voxel); };
  while (level > 0 && pixels(level) > kFinerAbove) --level;
  while (level < last && pixels(level + 1) < kCoarserBelow) ++level;
  return level;
}

}  // namespace

double pixelsOf(const Snapshot& snapshot, const InstanceView& instance, double voxel) {
  if (!snapshot.view) return 1e30;
  const double distance = distanceTo(*snapshot.view, instance, voxel * instance.scale);
  return voxel * instance.scale / distance * snapshot.pixelsHigh /
         (2 * static_cast<double>(snapshot.view->tanHalfHeight));
}

std::uint64_t bytesOf(const Transport& transport, PlannedClip& clip, std::uint32_t item) {
  PlannedItem& planned = clip.items[item];
  if (planned.bytes == 0) {
    planned.bytes = std::max<std::uint64_t>(transport.cost(clip.clip->order(item, clip.velocity)).gpu, 1);
  }
  return planned.bytes;
}

Detail::State& Detail::stateOf(const InstanceView& instance) {
  const std::uint32_t slot = instance.id.value & kHandleSlotMask;
  if (slot >= states_.size()) states_.resize(slot + 1);
  State& state = states_[slot];
  if (state.id != instance.id.value) state = {.id = instance.id.value};
  return state;
}

// The frames that must be there at one time for it to play on: of its moment, one more that comes at least, those that
// come before a load that begins now would, and those that were drawn until just now. Each once.
void Detail::gatherNeeded(const InstanceView& instance, const Clip& clip, const Pace& pace, Ranked& ranked) {
  const auto begin = static_cast<std::ptrdiff_t>(needed_.size());
  const auto add = [&](std::uint32_t frame) {
    if (std::find(needed_.begin() + begin, needed_.end(), clip.same[frame]) != needed_.end()) return;
    needed_.push_back(clip.same[frame]);
  };
  const Playback& playback = instance.playback;
  const bool hold = playback.interpolation == Interpolation::hold;
  const Moment moment = momentAt(clip.timeline, playback.loop, instance.phase, 0);
  add(moment.a);
  if (!hold) add(moment.b);
  const double speed = std::abs(playback.speed);
  for (const bool back : {false, true}) {
    if (stands(clip.timeline, playback, instance.phase)) break;
    Walk walk(clip.timeline, playback.loop, instance.phase, (playback.speed > 0) != back);
    for (std::uint32_t i = 0; i < kMostNeeded && walk.next(); ++i) {
      const bool always = !back && i == 0;
      if (!always && walk.until() > (back ? pace.behind : pace.ahead) * speed) break;
      add(hold || !walk.forward() ? walk.a() : walk.b());
    }
  }
  ranked.firstNeeded = static_cast<std::uint32_t>(begin);
  ranked.needed = static_cast<std::uint32_t>(needed_.size()) - ranked.firstNeeded;
}

// Whether its level does not come in time, though there is room for it.
bool Detail::starves(const Snapshot& snapshot, const InstanceView& instance, const PlannedClip& clip, const Pace& pace,
                     State& state) const {
  const double passed = std::clamp(snapshot.now - state.seen, 0.0, kLongestPass);
  state.seen = snapshot.now;
  if (state.seeks != instance.seeks) state.sought = snapshot.now;
  state.seeks = instance.seeks;
  bool missing = instance.held;
  for (std::uint32_t i = 0; i < instance.drawnCount; ++i) {
    const std::uint32_t wanted = clip.clip->item(clip.clip->frameOf(instance.drawn[i]), state.level);
    // What is damaged will not come, however coarse the others are.
    missing = missing || (clip.clip->levelOf(instance.drawn[i]) > state.level && !clip.items[wanted].corrupt);
  }
  const double since = snapshot.now - std::max(state.changed, state.sought);
  if (since < kSettles + pace.ahead || stands(clip.clip->timeline, instance.playback, instance.phase)) {
    missing = false;
  }
  state.starved = std::clamp(state.starved + (missing ? passed : -kForgets * passed), 0.0, 2 * kStarved);
  if (state.starved < kStarved) return false;
  state.starved = 0;
  return true;
}

void Detail::rank(const Snapshot& snapshot) {
  ranked_.clear();
  for (std::uint32_t i = 0; i < snapshot.instances.size(); ++i) {
    const InstanceView& instance = snapshot.instances[i];
    if (!(instance.priority > 0)) continue;
    // Sorting wants numbers that can be compared.
    const double importance = importanceOf(snapshot, instance);
    constexpr double kMost = std::numeric_limits<float>::max();
    const double sound = std::isnan(importance) ? 0 : std::clamp(importance, 0.0, kMost);
    ranked_.push_back({.instance = i, .level = 0, .importance = static_cast<float>(sound)});
  }
  std::sort(ranked_.begin(), ranked_.end(), [&](const Ranked& a, const Ranked& b) {
    // In steps, so that what is about as large keeps its order.
    const float x = std::round(std::log2(a.importance) * 2), y = std::round(std::log2(b.importance) * 2);
    if (x != y) return x > y;
    return snapshot.instances[a.instance].id.value < snapshot.instances[b.instance].id.value;
  });
}

void Detail::choose(const Snapshot& snapshot, std::vector<PlannedClip>& clips, const Transport& transport,
                    const Pace& pace, std::uint64_t pass, std::vector<Change>& changes) {
  rank(snapshot);
  needed_.clear();
  if (snapshot.gpuBudget > budget_) {
    for (State& state : states_) state.pause = kLevelPause;
  }
  budget_ = snapshot.gpuBudget;
  const auto budget = static_cast<double>(pace.room);
  double taken = 0;
  // What is counted once is marked: with an even number at its coarsest, with an odd one at the level that is chosen.
  const auto add = [&](PlannedClip& clip, const Ranked& ranked, std::uint32_t level, std::uint64_t mark, bool keep) {
    double bytes = 0;
    for (std::uint32_t i = 0; i < ranked.needed; ++i) {
      const std::uint32_t item = clip.clip->item(needed_[ranked.firstNeeded + i], level);
      if (clip.items[item].marked >= mark) continue;
      bytes += static_cast<double>(bytesOf(transport, clip, item));
      if (keep) clip.items[item].marked = mark;
    }
    return bytes;
  };
  for (Ranked& ranked : ranked_) {
    const InstanceView& instance = snapshot.instances[ranked.instance];
    PlannedClip& clip = clips[instance.clip];
    if (clip.clip == nullptr) continue;
    const std::uint32_t last = clip.clip->levelCount() - 1;
    gatherNeeded(instance, *clip.clip, pace, ranked);
    taken += add(clip, ranked, last, 2 * pass, true);
  }
  for (Ranked& ranked : ranked_) {
    const InstanceView& instance = snapshot.instances[ranked.instance];
    PlannedClip& clip = clips[instance.clip];
    if (clip.clip == nullptr) continue;
    State& state = stateOf(instance);
    const bool fresh = state.changed < 0;
    const std::uint32_t last = clip.clip->levelCount() - 1;
    const std::uint32_t ideal = idealLevel(snapshot, instance, *clip.clip, state.ideal);
    const auto finest = [&](double limit) {
      std::uint32_t level = ideal;
      while (level < last && taken + add(clip, ranked, level, 2 * pass + (level == last ? 0 : 1), false) > limit) {
        ++level;
      }
      return level;
    };
    std::uint32_t fitting = finest(kFull * budget);
    std::uint32_t level = std::min<std::uint32_t>(state.level, last);
    if (starves(snapshot, instance, clip, pace, state)) fitting = std::max(fitting, std::min(level + 1, last));
    if (fresh || fitting > level) {
      // Taken back soon after it was given: the next try waits for longer.
      if (!fresh && snapshot.now - state.changed < 4.0 * static_cast<double>(state.pause)) {
        state.pause = std::min(2 * state.pause, kLongestPause);
      }
      level = fitting;
    } else if (snapshot.now - state.changed >= static_cast<double>(state.pause)) {
      const std::uint32_t finer = finest(kFinerOnlyBelow * budget);
      if (finer < level) level = finer;
      if (ideal > level) level = ideal;
      if (level == state.level && snapshot.now - state.changed > 60) state.pause = kLevelPause;
    }
    if (fresh || level != state.level || ideal != state.ideal) {
      changes.push_back({.kind = Change::Kind::level, .item = level, .ideal = ideal, .instance = instance.id});
      state.ideal = static_cast<std::uint8_t>(ideal);
    }
    if (fresh || level != state.level) {
      state.level = static_cast<std::uint8_t>(level);
      state.changed = std::max(snapshot.now, 0.0);
    }
    ranked.level = level;
    if (level < last) taken += add(clip, ranked, level, 2 * pass + 1, true);
  }
}

}  // namespace billow::runtime
