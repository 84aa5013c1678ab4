// Planning: which frames are loaded, at what level of detail, and which are given up for them. Knows neither threads
// nor Vulkan; one pass at a time turns a snapshot of the instances into orders to the transport and changes for the
// frame thread, and costs about as much as there are instances and frames that they want.
//
// A pass, in its order:
//   1. notices of the frame thread and arrivals from the transport change what is resident;
//   2. instances are ranked by their size in the picture, and each gets the finest level that makes sense there and
//      fits into the budget beside the more important ones;
//   3. what each wants now and soon is gathered into one list, the most urgent first;
//   4. loads that nobody wants any more are cancelled, frames that are needed latest are evicted, as far as room is
//      needed, and what is missing is ordered.
#ifndef BILLOW_RUNTIME_STREAM_PLANNER_H
#define BILLOW_RUNTIME_STREAM_PLANNER_H

#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "detail.h"
#include "exchange.h"

namespace billow::runtime {

// Loads in flight: enough to keep a disk or network with latency busy, few enough that what becomes urgent does not
// wait for long.
inline constexpr std::size_t kMostLoads = 16;

// Longest time in seconds that a load is thought to take: what takes longer is fetched in order all the same.
inline constexpr double kLongestLatency = 2;

// Pages of open packs whose errors the host knows. It outlives planners, which come and go with devices.
class ToldPages {
 public:
  // Whether it is the first time: that a page cannot be read does not hide that it is damaged.
  bool insert(const std::shared_ptr<OpenPack>& pack, std::uint32_t page, bool damaged) {
    std::erase_if(told_, [](const auto& of) { return of.first.expired(); });
    return told_[pack].insert({page, damaged}).second;
  }

 private:
  std::map<std::weak_ptr<const OpenPack>, std::set<std::pair<std::uint32_t, bool>>, std::owner_less<>> told_;
};

class Planner {
 public:
  Planner(Transport& transport, const StreamConfig& config, ToldPages& told)
      : transport_(transport), config_(config), told_(told) {
    loads_.reserve(kMostLoads);
  }

  void pass(Snapshot& snapshot, std::vector<Change>& changes, std::vector<StreamError>& errors);
  const PlanStats& stats() const { return stats_; }
  // The device is lost: nothing more is ordered.
  bool lost() const { return lost_; }

 private:
  using Item = PlannedItem;
  enum Tier : std::uint32_t {
    kQuick,  // means of what is drawn now and has nothing resident
    kNow,
    kSoon,
    kLate,  // would arrive when it is no longer needed, by what loads took of late
  };
  struct Want {
    std::uint32_t clip, item;
    std::uint32_t tier;
    double seconds;  // until it is needed
    double importance;
    bool fits;
  };
  struct Load {
    std::uint64_t ticket;
    std::uint32_t clip, item;
    double since;
    std::uint64_t bytes;  // at most, on the device
    bool velocity;
    bool waited;  // for memory
  };
  struct Leaving {
    std::uint64_t update;
    std::uint64_t bytes;
  };
  struct Resident {
    std::uint32_t clip, item;
  };
  struct Victim {
    std::uint32_t clip, item;
    double score;  // the higher the sooner
  };

  // planner_residency.cpp: what is resident
  void takeNotices(Snapshot& snapshot, std::vector<Change>& changes);
  void takeArrivals(double now, std::vector<Change>& changes, std::vector<StreamError>& errors);
  void arrived(const Load& load, Arrival& arrival, std::vector<Change>& changes);
  void failed(const Load& load, const Arrival& arrival, double now, std::vector<Change>& changes,
              std::vector<StreamError>& errors);
  void closeClip(std::uint32_t clip);
  void setResident(std::uint32_t clip, std::uint32_t item, const ResidentFrame& frame);
  void setAbsent(std::uint32_t clip, std::uint32_t item);
  std::uint64_t leavingBytes() const;

  // planner_wants.cpp: what is wanted
  void gather(const Snapshot& snapshot);
  void gatherNow(const InstanceView& instance, std::uint32_t clip, double phase, double importance,
                 std::uint32_t level);
  void gatherComing(const InstanceView& instance, std::uint32_t clip, double phase, double importance,
                    std::uint32_t level);
  void want(std::uint32_t clip, std::uint32_t frame, std::uint32_t level, Tier tier, double seconds, double importance);
  bool anyLevel(const PlannedClip& clip, std::uint32_t frame) const;
  void markDrawn(const Snapshot& snapshot);

  // planner_room.cpp: what is given up
  void cancelUnwanted(double now);
  void cancel(Item& item);
  void makeRoom(const Snapshot& snapshot, std::vector<Change>& changes);
  std::uint64_t roomNeeded(double now);
  void findVictims(const Snapshot& snapshot);
  void forceRoom(const Snapshot& snapshot, std::vector<Change>& changes);
  void leaveBlocks(const Snapshot& snapshot, std::vector<Change>& changes);
  void measureSlack();
  void evict(std::uint32_t clip, std::uint32_t item, Change::Kind kind, std::vector<Change>& changes);

  // planner.cpp: what is ordered
  Pace pace(const Snapshot& snapshot);
  void findVelocity(const Snapshot& snapshot);
  void fit();
  bool absent(const Want& want, double now) const;
  std::uint64_t bytesToLoad(const Want& want);
  void order(const Snapshot& snapshot);
  bool submit(const Want& want, std::uint64_t bytes, double now);
  void count(double now);
  Missing whyMissing(const Want& want, double now) const;

  Transport& transport_;
  StreamConfig config_;
  std::vector<PlannedClip> clips_;
  Detail detail_;
  std::vector<Want> wants_;
  std::vector<Load> loads_;
  std::vector<Resident> residents_;
  std::vector<Victim> victims_;
  std::vector<Leaving> leaving_;  // retired; the device may still read them
  std::vector<Arrival> arrivals_;
  ToldPages& told_;
  std::uint64_t passes_ = 0;
  std::uint64_t update_ = 0;  // of the snapshot
  std::uint64_t nextTicket_ = 1;
  std::uint64_t budget_ = 0;
  std::uint64_t slack_ = 0;                  // bytes of the budget that lie in gaps too small for what is loading
  std::optional<std::uint64_t> shrunkFrom_;  // the update since which frames lie in memory that must go
  std::uint64_t resident_ = 0;               // bytes, without what the frame thread was asked to give back
  std::uint64_t asked_ = 0;                  // bytes of that
  std::uint64_t loading_ = 0;
  double latency_ = 0;              // seconds from order to arrival, of late
  std::optional<double> quickest_;  // and of those that waited least
  double paceNow_ = 0;              // of the snapshot from which the pace was measured last
  std::uint64_t paceUpdate_ = 0;
  double updateSeconds_ = 1.0 / 60;           // from one update() to the next, of late
  std::optional<std::uint64_t> blockedFrom_;  // the update since which something of now has no room
  bool lost_ = false;
  PlanStats stats_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PLANNER_H
