#include "next_use.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::runtime {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Coming {
  double seconds = kNever;
  double speed = 1;
  Loop loop = Loop::once;
};

// Who comes to each frame first, going forward and backward.
struct Paths {
  std::vector<Coming> forward, backward;
};

void seed(const Clip& clip, const InstanceView& instance, double phase, Paths& paths) {
  const Moment moment = momentAt(clip.timeline, instance.playback.loop, phase, 0);
  const double speed = std::abs(instance.playback.speed);
  const auto offer = [&](Coming& to, double seconds) {
    if (seconds < to.seconds) to = {seconds, speed, instance.playback.loop};
  };
  // What stands needs nothing but what it draws.
  if (speed == 0) return;
  if (goesForward(clip.timeline, instance.playback.loop, phase, instance.playback.speed > 0)) {
    offer(paths.forward[moment.a], 0);
    offer(paths.forward[moment.b], moment.untilB / speed);
  } else {
    offer(paths.backward[moment.b], 0);
    offer(paths.backward[moment.a], moment.sinceA / speed);
  }
}

void pass(const Coming& from, Coming& to, double length) {
  const double seconds = from.seconds + length / from.speed;
  if (seconds < to.seconds) to = {seconds, from.speed, from.loop};
}

void sweep(const Timeline& timeline, Paths& paths) {
  const std::uint32_t last = timeline.frames() - 1;
  const auto length = [&](std::uint32_t frame) { return timeline.start(frame + 1) - timeline.start(frame); };
  for (std::uint32_t f = 0; f < last; ++f) pass(paths.forward[f], paths.forward[f + 1], length(f));
  if (paths.forward[last].loop == Loop::loop) pass(paths.forward[last], paths.forward[0], length(last));
  if (paths.forward[last].loop == Loop::pingPong) pass(paths.forward[last], paths.backward[last], 0);
  for (std::uint32_t f = last; f > 0; --f) pass(paths.backward[f], paths.backward[f - 1], length(f - 1));
  if (paths.backward[0].loop == Loop::loop) pass(paths.backward[0], paths.backward[last], length(last));
  if (paths.backward[0].loop == Loop::pingPong) pass(paths.backward[0], paths.forward[0], 0);
}

}  // namespace

void findNextUses(const Snapshot& snapshot, std::vector<PlannedClip>& clips, std::uint64_t number) {
  std::vector<Paths> paths(clips.size());
  for (const InstanceView& instance : snapshot.instances) {
    if (clips[instance.clip].clip == nullptr || !(instance.priority > 0)) continue;
    const Clip& clip = *clips[instance.clip].clip;
    const auto add = [&](std::uint32_t which, double phase) {
      Paths& path = paths[which];
      if (path.forward.empty()) {
        path.forward.resize(clips[which].clip->frames());
        path.backward.resize(clips[which].clip->frames());
      }
      seed(*clips[which].clip, instance, phase, path);
    };
    add(instance.clip, instance.phase);
    if (instance.successor == format::kNone || clips[instance.successor].clip == nullptr) continue;
    add(instance.successor, successorPhase(clip, *clips[instance.successor].clip, instance));
  }
  for (std::size_t i = 0; i < clips.size(); ++i) {
    if (paths[i].forward.empty()) continue;
    const Clip& clip = *clips[i].clip;
    // Twice: what goes over an end reaches every frame behind it.
    for (int round = 0; round < 2; ++round) sweep(clip.timeline, paths[i]);
    clips[i].nextUse.assign(clip.frames(), kNever);
    for (std::uint32_t f = 0; f < clip.frames(); ++f) {
      double& use = clips[i].nextUse[clip.same[f]];
      use = std::min({use, paths[i].forward[f].seconds, paths[i].backward[f].seconds});
    }
    clips[i].usesKnown = number;
  }
}

}  // namespace billow::runtime
