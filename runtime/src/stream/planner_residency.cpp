#include <algorithm>
#include <utility>

#include "api.h"
#include "planner.h"

namespace billow::runtime {
namespace {

constexpr float kFirstBackOff = 0.25f;  // seconds; doubled up to
constexpr float kLongestBackOff = 8;

// Whether reading again may help: the bytes did not come, or memory was short. Bytes that break a rule stay as they
// are.
bool passing(const Error& error) {
  if (error.code != ErrorCode::pack) return true;
  return error.issue && error.issue->kind != nullptr && error.issue->kind->name == "cannot-read";
}

}  // namespace

void Planner::setResident(std::uint32_t clip, std::uint32_t number, const ResidentFrame& frame) {
  Item& item = clips_[clip].items[number];
  item.frame = &frame;
  item.bytes = std::max<std::uint64_t>(frame.stats().allocatedBytes, 1);
  item.resident = true;
  item.place = static_cast<std::uint32_t>(residents_.size());
  residents_.push_back({clip, number});
  resident_ += item.bytes;
}

// Of what is resident and was not asked back, or was: the sum that it is counted in shrinks.
void Planner::setAbsent(std::uint32_t clip, std::uint32_t number) {
  Item& item = clips_[clip].items[number];
  (item.leaving ? asked_ : resident_) -= item.bytes;
  const Resident moved = residents_.back();
  residents_[item.place] = moved;
  clips_[moved.clip].items[moved.item].place = item.place;
  residents_.pop_back();
  item.resident = item.leaving = item.velocity = item.moving = false;
  item.bytes = 0;
  item.frame = nullptr;
}

std::uint64_t Planner::leavingBytes() const {
  std::uint64_t sum = asked_;
  for (const Leaving& leaving : leaving_) sum += leaving.bytes;
  return sum;
}

void Planner::takeNotices(Snapshot& snapshot, std::vector<Change>& changes) {
  std::erase_if(leaving_,
                [&](const Leaving& frame) { return frame.update + config_.framesInFlight < snapshot.update; });
  changes.reserve(changes.size() + snapshot.notices.size());
  for (Notice& notice : snapshot.notices) {
    if (notice.clip >= clips_.size()) clips_.resize(notice.clip + 1);
    // A pass that ran out of memory has dealt with it.
    if (notice.kind == Notice::Kind::opened && notice.opened == nullptr) continue;
    PlannedClip& clip = clips_[notice.clip];
    if (notice.kind == Notice::Kind::opened) {
      clip = {};
      clip.items.resize(notice.opened->items());
      clip.clip = std::move(notice.opened);
      continue;
    }
    if (clip.clip == nullptr) continue;
    if (notice.kind == Notice::Kind::closed) {
      closeClip(notice.clip);
      changes.push_back({.kind = Change::Kind::closed, .clip = notice.clip, .item = 0, .instance = {}, .frame = {}});
      continue;
    }
    Item& item = clip.items[notice.item];
    if (!item.leaving) continue;
    if (notice.kind == Notice::Kind::retired) {
      leaving_.push_back({snapshot.update, item.bytes});
      setAbsent(notice.clip, notice.item);
    } else {
      item.leaving = false;
      asked_ -= item.bytes;
      resident_ += item.bytes;
    }
  }
  snapshot.notices.clear();
}

void Planner::closeClip(std::uint32_t number) {
  PlannedClip& clip = clips_[number];
  for (std::uint32_t item = 0; item < clip.items.size(); ++item) {
    if (!clip.items[item].resident) continue;
    leaving_.push_back({update_, clip.items[item].bytes});
    setAbsent(number, item);
  }
  std::erase_if(loads_, [&](const Load& load) {
    if (load.clip != number) return false;
    transport_.cancel(load.ticket);
    loading_ -= load.bytes;
    return true;
  });
  clip = {};
}

void Planner::takeArrivals(double now, std::vector<Change>& changes, std::vector<StreamError>& errors) {
  transport_.take(arrivals_);
  // Where memory is short here, they are still there in the next pass: the device may be writing the frames.
  changes.reserve(changes.size() + arrivals_.size());
  leaving_.reserve(leaving_.size() + 2 * arrivals_.size());
  residents_.reserve(residents_.size() + arrivals_.size());
  while (!arrivals_.empty()) {
    Arrival arrival = std::move(arrivals_.back());
    arrivals_.pop_back();
    const auto found =
        std::find_if(loads_.begin(), loads_.end(), [&](const Load& load) { return load.ticket == arrival.ticket; });
    if (found == loads_.end()) {
      // It was cancelled when it had all but arrived.
      if (arrival.frame) {
        leaving_.push_back({update_, (*arrival.frame)->stats().allocatedBytes});
        changes.push_back({.kind = Change::Kind::discard, .frame = std::move(*arrival.frame)});
      }
      continue;
    }
    const Load load = *found;
    *found = loads_.back();
    loads_.pop_back();
    loading_ -= load.bytes;
    clips_[load.clip].items[load.item].ticket = 0;
    const double took = now - load.since;
    latency_ += 0.25 * (took - latency_);
    if (!load.waited && arrival.frame) quickest_ = std::min(took, quickest_.value_or(took) + 0.05 * took);
    if (arrival.frame) {
      arrived(load, arrival, changes);
    } else {
      failed(load, arrival, now, changes, errors);
    }
  }
}

void Planner::arrived(const Load& load, Arrival& arrival, std::vector<Change>& changes) {
  Item& item = clips_[load.clip].items[load.item];
  if (item.resident) {
    leaving_.push_back({update_, item.bytes});
    setAbsent(load.clip, load.item);
  }
  setResident(load.clip, load.item, **arrival.frame);
  item.velocity = load.velocity;
  item.backOff = 0;
  ++stats_.framesLoaded;
  changes.push_back({.kind = Change::Kind::arrive,
                     .clip = load.clip,
                     .item = load.item,
                     .instance = {},
                     .frame = std::move(*arrival.frame)});
}

void Planner::failed(const Load& load, const Arrival& arrival, double now, std::vector<Change>& changes,
                     std::vector<StreamError>& errors) {
  PlannedClip& planned = clips_[load.clip];
  const Clip& clip = *planned.clip;
  Item& item = planned.items[load.item];
  const Error& error = arrival.frame.error();
  bool tell = item.backOff == 0;
  if (isVulkan(error.code)) {
    if (std::exchange(lost_, true)) return;
    tell = true;
  } else if (passing(error)) {
    item.backOff = tell ? kFirstBackOff : std::min(2 * item.backOff, kLongestBackOff);
    item.retryAt = now + static_cast<double>(item.backOff);
  } else {
    item.corrupt = tell = true;  // though it failed for another reason before
    changes.push_back({.kind = Change::Kind::fail, .clip = load.clip, .item = load.item});
  }
  if (!tell) return;
  if (arrival.page && !told_.insert(clip.pack, *arrival.page, item.corrupt)) return;
  const char* const then = lost_          ? "; nothing more is loaded until there is a new device"
                           : item.corrupt ? "; all else plays on"
                                          : "; it will be tried again";
  errors.push_back({.code = error.code,
                    .asset = clip.asset,
                    .volume = clip.volume,
                    .frame = clip.frameOf(load.item),
                    .page = arrival.page,
                    .message = "frame " + std::to_string(clip.frameOf(load.item)) + " of volume " +
                               std::to_string(clip.volume) + ": " + error.message + then});
}

}  // namespace billow::runtime
