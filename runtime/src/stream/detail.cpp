#include "detail.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::runtime {
namespace {

constexpr float kLevelPause = 1;     // seconds between changes of an instance's level to finer ones
constexpr float kLongestPause = 16;  // where the budget takes the finer level back again and again
constexpr double kFull = 0.9;        // of the budget, for what is drawn now and next
constexpr double kFinerOnlyBelow = 0.75;
constexpr double kCoarserBelow = 0.8;  // pixels a voxel of the coarser level
constexpr double kFinerAbove = 1.25;   // pixels a voxel of the present level

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

// The frames that must be there for the instance to play: its moment's and the one after.
struct Needed {
  std::uint32_t frames[3];
  std::uint32_t count = 0;
};
Needed neededNow(const InstanceView& instance, const Clip& clip) {
  const Moment moment = momentAt(clip.timeline, instance.playback.loop, instance.phase, 0);
  Needed needed;
  needed.frames[needed.count++] = moment.a;
  if (moment.b != moment.a) needed.frames[needed.count++] = moment.b;
  if (instance.playback.speed == 0) return needed;
  Walk walk(clip.timeline, instance.playback.loop, instance.phase, instance.playback.speed > 0);
  if (walk.next()) needed.frames[needed.count++] = walk.forward() ? walk.b() : walk.a();
  return needed;
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
                    std::uint64_t pass, std::vector<Change>& changes) {
  rank(snapshot);
  if (snapshot.gpuBudget > budget_) {
    for (State& state : states_) state.pause = kLevelPause;
  }
  budget_ = snapshot.gpuBudget;
  const auto budget = static_cast<double>(snapshot.gpuBudget);
  double taken = 0;
  // What is counted once is marked: with an even number at its coarsest, with an odd one at the level that is chosen.
  const auto add = [&](PlannedClip& clip, const Needed& needed, std::uint32_t level, std::uint64_t mark, bool keep) {
    double bytes = 0;
    for (std::uint32_t i = 0; i < needed.count; ++i) {
      const std::uint32_t item = clip.clip->item(needed.frames[i], level);
      if (clip.items[item].marked >= mark) continue;
      bytes += static_cast<double>(bytesOf(transport, clip, item));
      if (keep) clip.items[item].marked = mark;
    }
    return bytes;
  };
  for (const Ranked& ranked : ranked_) {
    const InstanceView& instance = snapshot.instances[ranked.instance];
    PlannedClip& clip = clips[instance.clip];
    if (clip.clip == nullptr) continue;
    const std::uint32_t last = clip.clip->levelCount() - 1;
    taken += add(clip, neededNow(instance, *clip.clip), last, 2 * pass, true);
  }
  for (Ranked& ranked : ranked_) {
    const InstanceView& instance = snapshot.instances[ranked.instance];
    PlannedClip& clip = clips[instance.clip];
    if (clip.clip == nullptr) continue;
    State& state = stateOf(instance);
    const bool fresh = state.changed < 0;
    const std::uint32_t last = clip.clip->levelCount() - 1;
    const std::uint8_t before = state.ideal;
    state.ideal = static_cast<std::uint8_t>(idealLevel(snapshot, instance, *clip.clip, before));
    const Needed needed = neededNow(instance, *clip.clip);
    const auto finest = [&](double limit) {
      std::uint32_t level = state.ideal;
      while (level < last && taken + add(clip, needed, level, 2 * pass + (level == last ? 0 : 1), false) > limit) {
        ++level;
      }
      return level;
    };
    const std::uint32_t fitting = finest(kFull * budget);
    std::uint32_t level = std::min<std::uint32_t>(state.level, last);
    if (fresh || fitting > level) {
      // Taken back soon after it was given: the next try waits for longer.
      if (!fresh && snapshot.now - state.changed < 4.0 * static_cast<double>(state.pause)) {
        state.pause = std::min(2 * state.pause, kLongestPause);
      }
      level = fitting;
    } else if (snapshot.now - state.changed >= static_cast<double>(state.pause)) {
      const std::uint32_t finer = finest(kFinerOnlyBelow * budget);
      if (finer < level) level = finer;
      if (state.ideal > level) level = state.ideal;
      if (level == state.level && snapshot.now - state.changed > 60) state.pause = kLevelPause;
    }
    if (fresh || level != state.level || state.ideal != before) {
      changes.push_back({.kind = Change::Kind::level, .item = level, .ideal = state.ideal, .instance = instance.id});
    }
    if (fresh || level != state.level) {
      state.level = static_cast<std::uint8_t>(level);
      state.changed = std::max(snapshot.now, 0.0);
    }
    ranked.level = level;
    if (level < last) taken += add(clip, needed, level, 2 * pass + 1, true);
  }
}

}  // namespace billow::runtime
