// The frame thread's part: instances, the frames that are resident, and what is drawn of them. Chooses among what is
// there; what ought to be there is the planner's business.
#ifndef BILLOW_RUNTIME_STREAM_PLAYERS_H
#define BILLOW_RUNTIME_STREAM_PLAYERS_H

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "detail.h"
#include "exchange.h"

namespace billow::runtime {

// From a level of detail to another at most: what was seen for less, as after a seek, goes as fast as it came.
inline constexpr float kFadeSeconds = 0.2f;

// The frames of a clip that are resident, by item.
struct Track {
  struct Slot {
    std::unique_ptr<ResidentFrame> frame;
    std::uint64_t drawn = 0;  // the last giveBack() that found it drawn
    bool failed = false;
  };
  std::shared_ptr<const Clip> clip;  // null: closed
  std::vector<Slot> slots;
  std::uint64_t version = 1;  // another one when a slot gets another frame
};

// A frame that is drawn, on its way from one level to another.
struct Fade {
  std::uint32_t frame = format::kNone;
  std::uint8_t from = 0, to = 0;
  float progress = 1;
  float length = 0;  // seconds of the fade
  float seen = 0;    // seconds since it was drawn first
};

// Phases, without their ends, within which nothing that is drawn changes but weights: most updates of most instances.
struct Steady {
  double from = 0, until = 0;
  std::uint64_t version = 0;  // of the track; 0: there are none
  bool carries = false;
};

// What an instance remembers from update to update.
struct Player {
  Steady steady;
  Fade fades[2];
  double passed = 0;                   // volume seconds since something of the moment was drawn, or since a seek
  std::uint32_t near = format::kNone;  // the frame that began last
  std::uint8_t level = 0;              // that planning chose
  std::uint8_t ideal = 0;              // that the picture's size asks for
};

// Decides what `view` draws at its phase. `moved`: volume seconds since the last time; `seconds`: real ones.
void chooseLayers(const Track& track, const InstanceView& view, Player& player, Shown& shown, double moved,
                  float seconds);
// The same in short where it can be, else false.
bool goOn(const Track& track, const InstanceView& view, Player& player, Shown& shown, float seconds);

// A clip, and the one that is to take its place.
struct Succession {
  std::uint32_t clip = 0, successor = format::kNone;
};

struct RetiredCount {
  std::uint32_t frames = 0;
  std::uint64_t bytes = 0;
};

// Of instances with priority.
struct InstanceCount {
  std::uint32_t all = 0, held = 0, coarse = 0, empty = 0;
  std::uint32_t late = 0;  // a frame of the volume has begun, and nothing of the moment is drawn
};

class Players {
 public:
  std::uint32_t openClip(std::shared_ptr<const Clip> clip);
  void closeClip(std::uint32_t clip);
  const Track& track(std::uint32_t clip) const { return tracks_[clip]; }

  Result<InstanceId> add(const InstanceInfo& info, std::uint32_t clip);
  void remove(InstanceId id);
  void removeOf(AssetId asset);
  // Null where there is no such instance.
  const InstanceView* find(InstanceId id) const;
  void setPriority(InstanceId id, float priority);
  void setTransform(InstanceId id, const std::array<double, 12>& objectToWorld);
  void setPlayback(InstanceId id, const Playback& playback);
  void seek(InstanceId id, double time);
  Drawable drawable(InstanceId id) const;
  std::span<const InstanceView> views() const { return views_; }

  // By frame, as Streamer::residency() has it.
  void residency(InstanceId id, std::span<std::uint8_t> frames) const;
  // Whether an instance plays the clip.
  bool plays(std::uint32_t clip) const;

  // The instances of an asset get successors of their clips, and lose those that they had.
  void setSuccessors(AssetId asset, std::span<const Succession> successions);
  // Whether each instance of the asset could draw something of its moment from its successor; they then take their
  // place.
  bool succeed(AssetId asset);
  bool successorFailed(AssetId asset) const;

  // The parts of an update(), in this order.
  // Gives how many of the changes it took: what follows a frame that may not be drawn yet waits with it.
  std::size_t take(std::span<Change> changes, Transport& transport);
  void advance(double seconds);
  void giveBack(Transport& transport);
  // Adds what planning does not know to what of a report it has not taken.
  void fill(Report& report);

  RetiredCount retired() const { return retired_; }  // since it was made
  InstanceCount count() const { return count_; }     // at the last advance()
  // Forgets every frame and notice; each clip is announced anew.
  void dropFrames();

 private:
  struct Handle {
    std::uint32_t generation = 1;
    std::uint32_t index = format::kNone;
  };
  std::uint32_t indexOf(InstanceId id) const;
  void touch(std::uint32_t index);
  void touchAll();
  // All but the levels that planning chose.
  void forgetDrawn(std::uint32_t index);
  // What depends on transform and clip.
  void place(std::uint32_t index);
  void removeAt(std::uint32_t index);
  bool isLast(std::uint32_t clip, std::uint32_t item) const;
  void retire(std::unique_ptr<ResidentFrame>&& frame, Transport& transport);

  std::vector<Track> tracks_;
  std::vector<std::uint32_t> freeTracks_;  // closed, and planning knows
  // Parallel, in no order.
  std::vector<InstanceView> views_;
  std::vector<Player> players_;
  std::vector<Shown> shown_;
  std::vector<std::array<double, 12>> transforms_;
  std::vector<std::uint8_t> touched_;   // views that planning does not know: but for their moments, which it is told
  std::vector<std::uint32_t> touches_;  // of these, some of which may be gone
  std::vector<Handle> handles_;
  std::vector<std::uint32_t> freeHandles_;
  std::vector<Notice> notices_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> asked_;  // clip and item that planning asks back
  std::uint64_t givenBack_ = 0;                                 // times
  RetiredCount retired_;
  InstanceCount count_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PLAYERS_H
