#include "planner.h"

#include <algorithm>

namespace billow::runtime {

void Planner::pass(Snapshot& snapshot, std::vector<Change>& changes, std::vector<StreamError>& errors) {
  ++passes_;
  update_ = snapshot.update;
  if (snapshot.gpuBudget < budget_) shrunkFrom_ = snapshot.update;
  budget_ = snapshot.gpuBudget;
  takeNotices(snapshot, changes);
  takeArrivals(snapshot.now, changes, errors);
  markDrawn(snapshot);
  measureSlack();
  findVelocity(snapshot);
  detail_.choose(snapshot, clips_, transport_, pace(snapshot), passes_, changes);
  gather(snapshot);
  fit();
  cancelUnwanted(snapshot.now);
  makeRoom(snapshot, changes);
  leaveBlocks(snapshot, changes);
  order(snapshot);
  forceRoom(snapshot, changes);
  count(snapshot.now);
}

Pace Planner::pace(const Snapshot& snapshot) {
  if (snapshot.update > paceUpdate_) {
    const double passed = (snapshot.now - paceNow_) / static_cast<double>(snapshot.update - paceUpdate_);
    updateSeconds_ += 0.25 * (std::clamp(passed, 0.0, kLongestUpdate) - updateSeconds_);
    paceNow_ = snapshot.now;
    paceUpdate_ = snapshot.update;
  }
  // What has arrived waits for an update().
  return {.room = budget_ - std::min(slack_, budget_),
          .ahead = std::min(quickest_.value_or(0), kLongestLatency) + updateSeconds_,
          .behind = config_.framesInFlight * updateSeconds_};
}

void Planner::findVelocity(const Snapshot& snapshot) {
  for (const InstanceView& instance : snapshot.instances) {
    PlannedClip& clip = clips_[instance.clip];
    if (clip.clip == nullptr || !clip.clip->velocity) continue;
    if (clip.velocity || instance.playback.interpolation != Interpolation::advect) continue;
    clip.velocity = true;
    // With the grids of velocity they are larger.
    for (Item& item : clip.items) {
      if (!item.resident) item.bytes = 0;
    }
  }
}

void Planner::fit() {
  const std::uint64_t room = budget_ - std::min(slack_, budget_);
  std::uint64_t sum = 0;
  bool full = false;
  for (Want& want : wants_) {
    const std::uint64_t bytes = bytesOf(transport_, clips_[want.clip], want.item);
    // What comes later may not take the room of what comes sooner and is larger.
    if (full && want.tier >= kSoon) continue;
    want.fits = bytes <= room - std::min(sum, room);
    if (want.fits) sum += bytes;
    full = full || !want.fits;
  }
}

bool Planner::absent(const Want& want, double now) const {
  const PlannedClip& clip = clips_[want.clip];
  const Item& item = clip.items[want.item];
  if (item.ticket != 0 || item.leaving || item.corrupt || item.retryAt > now) return false;
  return !item.resident || item.moving || (clip.velocity && clip.clip->velocity && !item.velocity);
}

std::uint64_t Planner::bytesToLoad(const Want& want) {
  PlannedClip& clip = clips_[want.clip];
  if (!clip.items[want.item].resident) return bytesOf(transport_, clip, want.item);
  return transport_.cost(clip.clip->order(want.item, clip.velocity)).gpu;
}

void Planner::order(const Snapshot& snapshot) {
  bool blocked = false;
  for (const Want& want : wants_) {
    if (lost_ || loads_.size() >= kMostLoads) break;
    if (!want.fits || !absent(want, snapshot.now)) continue;
    const std::uint64_t bytes = bytesToLoad(want);
    const std::uint64_t taken = resident_ + loading_;
    if (bytes > budget_ - std::min(taken, budget_)) {
      blocked = want.tier <= kNow;
      break;
    }
    if (!submit(want, bytes, snapshot.now)) break;
  }
  // Over the budget is blocked too: forceRoom() counts its patience from when that began.
  if (!blocked && resident_ + loading_ <= budget_) blockedFrom_.reset();
  if (blocked && !blockedFrom_) blockedFrom_ = snapshot.update;
}

bool Planner::submit(const Want& want, std::uint64_t bytes, double now) {
  PlannedClip& clip = clips_[want.clip];
  Item& item = clip.items[want.item];
  LoadOrder order = clip.clip->order(want.item, clip.velocity);
  order.ticket = nextTicket_;
  order.urgent = want.tier <= kNow;
  item.scratch = !transport_.submit(order);
  if (item.scratch) return false;
  item.ticket = nextTicket_++;
  loading_ += bytes;
  loads_.push_back({.ticket = item.ticket,
                    .clip = want.clip,
                    .item = want.item,
                    .since = now,
                    .bytes = bytes,
                    .velocity = clip.velocity,
                    .waited = false});
  return true;
}

Missing Planner::whyMissing(const Want& want, double now) const {
  const Item& item = clips_[want.clip].items[want.item];
  if (item.corrupt || item.retryAt > now) return Missing::failed;
  if (!want.fits || item.leaving) return Missing::gpuBudget;
  if (item.ticket == 0) {
    if (item.scratch) return Missing::cpuBudget;
    return blockedFrom_ ? Missing::gpuBudget : Missing::queued;
  }
  switch (transport_.stage(item.ticket).value_or(LoadStage::uploading)) {
    case LoadStage::reading:
      return Missing::reading;
    case LoadStage::decoding:
      return Missing::decoding;
    case LoadStage::waitingForMemory:
      return Missing::gpuBudget;
    case LoadStage::uploading:
      return Missing::uploading;
  }
  return Missing::queued;
}

void Planner::count(double now) {
  stats_.gpuBytes = resident_ + loading_ + asked_;
  stats_.framesResident = static_cast<std::uint32_t>(residents_.size());
  stats_.loadsQueued = stats_.loadsReading = stats_.loadsDecoding = stats_.loadsUploading = 0;
  stats_.missingBricks = {};
  for (Load& load : loads_) {
    const LoadStage stage = transport_.stage(load.ticket).value_or(LoadStage::uploading);
    load.waited = load.waited || stage == LoadStage::waitingForMemory;
    if (stage == LoadStage::reading) ++stats_.loadsReading;
    if (stage == LoadStage::decoding) ++stats_.loadsDecoding;
    if (stage == LoadStage::waitingForMemory || stage == LoadStage::uploading) ++stats_.loadsUploading;
  }
  for (const Want& want : wants_) {
    const Item& item = clips_[want.clip].items[want.item];
    if (want.fits && absent(want, now)) ++stats_.loadsQueued;
    if (want.tier != kNow || item.resident) continue;
    const auto why = static_cast<std::size_t>(whyMissing(want, now));
    stats_.missingBricks[why] += clips_[want.clip].clip->bricks(want.item);
  }
}

}  // namespace billow::runtime
