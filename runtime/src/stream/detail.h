// How finely each instance is drawn: by its size in the picture, and as the budget allows.
#ifndef BILLOW_RUNTIME_STREAM_DETAIL_H
#define BILLOW_RUNTIME_STREAM_DETAIL_H

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "exchange.h"

namespace billow::runtime {

// What planning knows of an item.
struct PlannedItem {
  const ResidentFrame* frame = nullptr;  // while it is resident; the frame thread's
  std::uint64_t bytes = 0;               // on the device: what it takes, or may take at most; 0: not asked yet
  std::uint64_t ticket = 0;              // of its load; 0: none
  std::uint64_t marked = 0;              // the pass in which it was counted last
  std::uint64_t wanted = 0;              // the pass in which it was wanted last
  std::uint64_t drawn = 0;               // the pass in which an instance drew it last
  std::uint64_t alone = 0;               // and in which one drew nothing else
  std::uint32_t want = 0;                // its place in the pass's list
  std::uint32_t place = 0;               // among the residents
  double used = 0;                       // seconds, when it was wanted last
  double retryAt = 0;
  float backOff = 0;  // seconds; 0: nothing failed
  bool resident = false;
  bool leaving = false;   // the frame thread was asked to give it back
  bool corrupt = false;   // will never come
  bool moving = false;    // it lies in memory that must go, and is drawn: to be loaded anew
  bool velocity = false;  // resident with the grids that Interpolation::advect needs
  bool scratch = false;   // its load waits for memory of the CPU
};

struct PlannedClip {
  std::shared_ptr<const Clip> clip;  // null: closed
  std::vector<PlannedItem> items;
  std::vector<double> nextUse;  // by frame, seconds: scratch of eviction
  std::uint64_t usesKnown = 0;  // the pass of which nextUse is
  bool velocity = false;        // an instance advects
};

// The bytes of an item on the device, asked of the transport where they are not known yet.
std::uint64_t bytesOf(const Transport& transport, PlannedClip& clip, std::uint32_t item);

// What frames have room in, and how long they take it beside those that are drawn, in real seconds.
struct Pace {
  std::uint64_t room = 0;  // bytes: the budget but for gaps that nothing fits into
  double ahead = 0;        // from the order of a load to the update() that can draw it
  double behind = 0;       // from the last update() that draws a frame until its memory is free
};

class Detail {
 public:
  struct Ranked {
    std::uint32_t instance = 0;  // in the snapshot
    std::uint32_t level = 0;
    float importance = 0;
    std::uint32_t firstNeeded = 0, needed = 0;  // of needed_
  };

  // Ranks instances by importance and chooses levels: of the finest that the picture's size asks for, the first of
  // which the frames that are drawn, come in time and are not given back yet all fit into the budget; or a coarser one,
  // for a while, where frames still come too late. Levels change seldom: at most once in kLevelPause seconds to finer
  // ones. Marks items with `pass`. Appends Change::level where one changes.
  void choose(const Snapshot& snapshot, std::vector<PlannedClip>& clips, const Transport& transport, const Pace& pace,
              std::uint64_t pass, std::vector<Change>& changes);
  // By importance, of instances with priority.
  const std::vector<Ranked>& ranked() const { return ranked_; }

 private:
  struct State {
    std::uint32_t id = 0;
    std::uint8_t level = 0;
    std::uint8_t ideal = 0;
    float pause = 1;        // seconds until it may become finer again
    double changed = -1e9;  // when it changed
    double seen = 0;        // when the pass before was
    double starved = 0;     // seconds of late in which its level was not there to be drawn
    double sought = -1e9;   // when it was sent elsewhere
    std::uint32_t seeks = 0;
  };
  State& stateOf(const InstanceView& instance);
  void rank(const Snapshot& snapshot);
  void gatherNeeded(const InstanceView& instance, const Clip& clip, const Pace& pace, Ranked& ranked);
  bool starves(const Snapshot& snapshot, const InstanceView& instance, const PlannedClip& clip, const Pace& pace,
               State& state) const;

  std::uint64_t budget_ = 0;   // of the pass before
  std::vector<State> states_;  // by handle slot
  std::vector<Ranked> ranked_;
  std::vector<std::uint32_t> needed_;  // frames, of one instance after the other
};

inline constexpr std::uint32_t kHandleSlotBits = 20;  // of an InstanceId; the rest counts the slot's uses
inline constexpr std::uint32_t kHandleSlotMask = (1u << kHandleSlotBits) - 1;

// Pixels that a voxel of this width covers at the instance, 1e30 without a view.
double pixelsOf(const Snapshot& snapshot, const InstanceView& instance, double voxel);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_DETAIL_H
