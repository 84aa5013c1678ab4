// What the frame thread and planning tell each other: whole batches, swapped under a lock that is held for no longer.
#ifndef BILLOW_RUNTIME_STREAM_EXCHANGE_H
#define BILLOW_RUNTIME_STREAM_EXCHANGE_H

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "clip.h"

namespace billow::runtime {

// What one instance draws, in items of its clip.
struct Shown {
  std::array<std::uint32_t, kMostLayers> items{};
  std::array<float, kMostLayers> weights{};
  std::array<float, kMostLayers> advect{};
  double time = 0;
  std::uint8_t count = 0;
  bool held = false;
  bool coarse = false;
};

// What of an instance is another in each update().
struct InstanceMoment {
  double phase = 0;
  std::array<std::uint32_t, kMostLayers> drawn{};  // items
  std::uint32_t drawnCount = 0;
  std::uint32_t seeks = 0;  // how often it was sent elsewhere
  bool held = false;
};

// One instance, as planning needs it.
struct InstanceView : InstanceMoment {
  InstanceId id = {};
  std::uint32_t clip = 0;
  std::uint32_t successor = format::kNone;  // the clip that is to take its place
  Playback playback = {};
  float priority = 1;
  std::array<double, 3> centre{};  // in the world
  double radius = 0;
  double scale = 1;  // of the volume's own world
};

// Where the instance is in the clip that is to take the place of its own.
inline double successorPhase(const Clip& clip, const Clip& successor, const InstanceView& view) {
  const double time = momentAt(clip.timeline, view.playback.loop, view.phase, 0).time;
  const bool back = view.playback.loop == Loop::pingPong && view.phase > clip.timeline.last();
  const double phase = phaseAt(successor.timeline, view.playback.loop, time, 0);
  return back && phase > 0 ? 2 * successor.timeline.last() - phase : phase;
}

// From the frame thread: what happened to clips and items since the last batch.
struct Notice {
  enum class Kind { opened, closed, retired, refused } kind = Kind::opened;
  std::uint32_t clip = 0;
  std::uint32_t item = 0;
  std::shared_ptr<const Clip> opened = {};
};

// Seconds that an update() counts for at least, in what is not play: a game that stands still gets its detail too.
inline constexpr double kLeastPassing = 1.0 / 240;
// And at most, in what waits for loads: while a game hangs, nothing it wants is loaded either.
inline constexpr double kLongestUpdate = 0.1;

// What an update() leaves behind, but for the instances.
struct Situation {
  double now = 0;  // real seconds, the sum of what update() was told
  std::uint64_t update = 0;
  std::optional<View> view = {};
  std::uint32_t pixelsHigh = 1080;
  std::uint64_t gpuBudget = 0;
};

// From the frame thread: all that planning does not know yet.
struct Report : Situation {
  struct Placed {
    std::uint32_t index = 0;
    InstanceView view;  // but for its moment
  };
  std::vector<InstanceMoment> moments;  // of all instances
  std::vector<Placed> changed;          // in the order in which they did
  std::vector<Notice> notices;
};

// What planning knows.
struct Snapshot : Situation {
  std::vector<InstanceView> instances;
  std::vector<Notice> notices;  // not dealt with yet
  // Empties the report. Throws std::bad_alloc, and may be called again then.
  void take(Report& report);
};

// From planning: what the frame thread takes in at its next update.
struct Change {
  enum class Kind {
    none,     // it has been taken
    arrive,   // `frame` is resident, in place of what the item had before
    evict,    // give the item's frame back unless it is drawn; a Notice says which
    force,    // give it back though it is drawn, unless an instance has nothing else
    seize,    // give it back whatever it is drawn for
    discard,  // nobody wants `frame` any more
    level,    // the instance is to be drawn at this level, while the picture asks for `ideal`
    fail,     // the item will not come
    closed,   // nothing more comes for the clip's number
  } kind = Kind::arrive;
  std::uint32_t clip = 0;
  std::uint32_t item = 0;  // of `level`: the level
  std::uint32_t ideal = 0;
  InstanceId instance = {};
  std::unique_ptr<ResidentFrame> frame = {};
};

// What planning adds to StreamStats.
struct PlanStats {
  std::uint64_t gpuBytes = 0;
  std::uint32_t framesResident = 0;
  std::uint32_t framesLoaded = 0;  // since the planner was made
  std::uint32_t loadsQueued = 0, loadsReading = 0, loadsDecoding = 0, loadsUploading = 0;
  std::array<std::uint64_t, kMissingCount> missingBricks{};
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_EXCHANGE_H
