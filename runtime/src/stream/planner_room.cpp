#include <algorithm>
#include <cmath>
#include <limits>

#include "next_use.h"
#include "planner.h"

namespace billow::runtime {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kMeansWeigh = 16;         // small, and the first help after a seek: kept as if needed so much sooner
constexpr std::uint64_t kPatience = 4;     // updates that something of now waits for room before a drawn frame goes
constexpr std::uint64_t kNoPatience = 60;  // and before the last frame of an instance goes for a smaller budget

}  // namespace

void Planner::cancelUnwanted(double now) {
  std::erase_if(loads_, [&](const Load& load) {
    Item& item = clips_[load.clip].items[load.item];
    if (item.wanted == passes_ && wants_[item.want].fits) return false;
    // What has been read is worth the rest.
    const auto stage = transport_.stage(load.ticket);
    if (stage == LoadStage::decoding || stage == LoadStage::uploading) return false;
    if (stage == LoadStage::waitingForMemory && resident_ + loading_ <= budget_) return false;
    transport_.cancel(load.ticket);
    latency_ = std::max(latency_, now - load.since);
    loading_ -= load.bytes;
    item.ticket = 0;
    return true;
  });
}

std::uint64_t Planner::roomNeeded(double now) {
  std::uint64_t bytes = resident_ + loading_;
  std::size_t slots = kMostLoads > loads_.size() ? kMostLoads - loads_.size() : 0;
  for (const Want& want : wants_) {
    if (slots == 0) break;
    if (!want.fits || !absent(want, now)) continue;
    bytes += bytesToLoad(want);
    --slots;
  }
  std::uint64_t needed = bytes > budget_ ? bytes - budget_ : 0;
  // What the plan has room for may not find any between the frames that lie there.
  const std::uint64_t stuck = transport_.wantedGpuBytes();
  const std::uint64_t leaving = leavingBytes();
  if (stuck > leaving) needed = std::max(needed, stuck - leaving);
  return needed;
}

void Planner::findVictims(const Snapshot& snapshot) {
  victims_.clear();
  bool known = false;
  for (const Resident& resident : residents_) {
    PlannedClip& clip = clips_[resident.clip];
    const Item& item = clip.items[resident.item];
    if (item.leaving || item.drawn == passes_ || item.ticket != 0) continue;
    if (item.wanted == passes_ && wants_[item.want].fits) continue;
    if (!known) findNextUses(snapshot, clips_, passes_);
    known = true;
    const double next = clip.usesKnown == passes_ ? clip.nextUse[clip.clip->frameOf(resident.item)] : kNever;
    const bool means = clip.clip->levelOf(resident.item) + 1 == clip.clip->levelCount();
    // What nobody plays towards goes first, the least recently used of it before the rest.
    double score = next < kNever ? next : 1e12 + snapshot.now - item.used;
    if (means) score /= kMeansWeigh;
    victims_.push_back({resident.clip, resident.item, score});
  }
  std::sort(victims_.begin(), victims_.end(), [](const Victim& x, const Victim& y) {
    if (x.score != y.score) return x.score > y.score;
    return x.clip != y.clip ? x.clip < y.clip : x.item < y.item;
  });
}

void Planner::makeRoom(const Snapshot& snapshot, std::vector<Change>& changes) {
  const std::uint64_t needed = roomNeeded(snapshot.now);
  if (needed == 0) return;
  findVictims(snapshot);
  std::uint64_t made = 0;
  for (const Victim& victim : victims_) {
    if (made >= needed) break;
    made += clips_[victim.clip].items[victim.item].bytes;
    evict(victim.clip, victim.item, Change::Kind::evict, changes);
  }
}

void Planner::cancel(Item& item) {
  std::erase_if(loads_, [&](const Load& load) {
    if (load.ticket != item.ticket) return false;
    transport_.cancel(load.ticket);
    loading_ -= load.bytes;
    return true;
  });
  item.ticket = 0;
}

// Memory goes back to the device in blocks: after the budget shrank, frames in those that go are loaded anew elsewhere,
// drawn ones before they leave, if there is room.
void Planner::leaveBlocks(const Snapshot& snapshot, std::vector<Change>& changes) {
  if (!shrunkFrom_) return;
  bool found = false;
  for (const Resident& resident : residents_) {
    Item& item = clips_[resident.clip].items[resident.item];
    if (item.leaving) continue;
    if (!transport_.mustLeave(*item.frame)) {
      item.moving = false;
      continue;
    }
    found = true;
    const bool late = snapshot.update >= *shrunkFrom_ + kNoPatience;
    // Beside it there may never be room for what is loaded in its place.
    if (item.ticket != 0 && late) cancel(item);
    if (item.ticket != 0) continue;
    item.moving = item.drawn == passes_;
    if (item.moving && !late) continue;
    evict(resident.clip, resident.item, late ? Change::Kind::seize : Change::Kind::evict, changes);
  }
  // What was on its way when the budget shrank may lie in such memory too.
  if (!found && snapshot.update > *shrunkFrom_ && transport_.stats().gpuAllocated <= budget_) shrunkFrom_.reset();
}

// Frames are of all sizes, and the gaps between them are not always where they are needed.
void Planner::measureSlack() {
  const std::uint64_t stuck = transport_.wantedGpuBytes();
  if (stuck > 0 && leavingBytes() == 0) {
    slack_ = std::min(slack_ + stuck / 16 + 1, budget_ / 2);
  } else {
    slack_ -= (slack_ + 255) / 256;
  }
}

void Planner::evict(std::uint32_t clip, std::uint32_t number, Change::Kind kind, std::vector<Change>& changes) {
  Item& item = clips_[clip].items[number];
  changes.push_back({.kind = kind, .clip = clip, .item = number, .instance = {}, .frame = {}});
  item.leaving = true;
  resident_ -= item.bytes;
  asked_ += item.bytes;
}

// Drawn frames hold the room that others need: those go that no moment of now is made of, of the least important
// instance first, and of each its last one only for a budget that became smaller.
void Planner::forceRoom(const Snapshot& snapshot, std::vector<Change>& changes) {
  const bool over = resident_ + loading_ > budget_;
  if (over && !blockedFrom_) blockedFrom_ = snapshot.update;
  if (!blockedFrom_ || snapshot.update < *blockedFrom_ + kPatience || asked_ > 0) return;
  const bool last = over && snapshot.update >= *blockedFrom_ + kNoPatience;
  const auto unwanted = [&](const Item& item) {
    return item.resident && !item.leaving && item.ticket == 0 && !(item.wanted == passes_ && wants_[item.want].fits);
  };
  const auto force = [&](const InstanceView& instance) {
    PlannedClip& clip = clips_[instance.clip];
    if (clip.clip == nullptr || instance.drawnCount < (last ? 1u : 2u)) return false;
    const std::uint32_t item = instance.drawn[instance.drawnCount - 1];
    if (!unwanted(clip.items[item]) || (!last && clip.items[item].alone == passes_)) return false;
    evict(instance.clip, item, last ? Change::Kind::seize : Change::Kind::force, changes);
    return true;
  };
  // Those without priority go first.
  for (const InstanceView& instance : snapshot.instances) {
    if (!(instance.priority > 0) && force(instance)) return;
  }
  const auto& ranked = detail_.ranked();
  for (std::size_t i = ranked.size(); i-- > 0;) {
    if (force(snapshot.instances[ranked[i].instance])) return;
  }
}

}  // namespace billow::runtime
