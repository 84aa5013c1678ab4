#include "players.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "api.h"

namespace billow::runtime {
namespace {

constexpr std::uint32_t kMostGenerations = (1u << (32 - kHandleSlotBits)) - 1;

double lengthOfColumn(const std::array<double, 12>& m, std::size_t column) {
  return std::sqrt(m[column] * m[column] + m[4 + column] * m[4 + column] + m[8 + column] * m[8 + column]);
}

bool allFinite(const std::array<double, 12>& transform) {
  return std::all_of(transform.begin(), transform.end(), [](double x) { return std::isfinite(x); });
}

// Within what can be squared and summed.
double bounded(double x) {
  constexpr double kMost = 1e30;
  return std::isnan(x) ? 0 : std::clamp(x, -kMost, kMost);
}

bool sane(const InstanceInfo& info) {
  return allFinite(info.objectToWorld) && std::isfinite(info.time) && std::isfinite(info.playback.speed) &&
         std::isfinite(info.priority) && info.priority >= 0;
}

}  // namespace

std::uint32_t Players::openClip(std::shared_ptr<const Clip> clip) {
  std::uint32_t number = static_cast<std::uint32_t>(tracks_.size());
  if (freeTracks_.empty()) {
    tracks_.emplace_back();
  } else {
    number = freeTracks_.back();
    freeTracks_.pop_back();
  }
  tracks_[number].slots = std::vector<Track::Slot>(clip->items());
  ++tracks_[number].version;
  notices_.push_back({.kind = Notice::Kind::opened, .clip = number, .item = 0, .opened = clip});
  tracks_[number].clip = std::move(clip);
  return number;
}

// Frames stay until planning, which may be looking at them, says that it knows.
void Players::closeClip(std::uint32_t number) {
  tracks_[number].clip.reset();
  std::erase_if(asked_, [&](const auto& asked) { return asked.first == number; });
  notices_.push_back({.kind = Notice::Kind::closed, .clip = number, .item = 0, .opened = {}});
}

std::uint32_t Players::indexOf(InstanceId id) const {
  const std::uint32_t slot = id.value & kHandleSlotMask;
  if (slot >= handles_.size() || handles_[slot].generation != id.value >> kHandleSlotBits) return format::kNone;
  return handles_[slot].index;
}

const InstanceView* Players::find(InstanceId id) const {
  const std::uint32_t index = indexOf(id);
  return index == format::kNone ? nullptr : &views_[index];
}

void Players::touch(std::uint32_t index) {
  if (touched_[index] != 0) return;
  touches_.push_back(index);
  touched_[index] = 1;
}

void Players::touchAll() {
  for (std::uint32_t i = 0; i < views_.size(); ++i) touch(i);
}

void Players::forgetDrawn(std::uint32_t index) {
  shown_[index] = {};
  Player player;
  player.level = players_[index].level;
  player.ideal = players_[index].ideal;
  players_[index] = player;
}

void Players::setPriority(InstanceId id, float priority) {
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone || !std::isfinite(priority)) return;
  views_[index].priority = std::max(priority, 0.0f);
  touch(index);
}

Result<InstanceId> Players::add(const InstanceInfo& info, std::uint32_t clip) {
  if (!sane(info)) return failure(ErrorCode::argument, "InstanceInfo: a number is outside of its range");
  if (freeHandles_.empty()) {
    if (handles_.size() > kHandleSlotMask) return failure(ErrorCode::argument, "there are too many instances");
    freeHandles_.push_back(static_cast<std::uint32_t>(handles_.size()));
    handles_.emplace_back();
  }
  const std::uint32_t slot = freeHandles_.back();
  freeHandles_.pop_back();
  handles_[slot].index = static_cast<std::uint32_t>(views_.size());
  InstanceView view;
  view.id.value = handles_[slot].generation << kHandleSlotBits | slot;
  view.clip = clip;
  view.playback = info.playback;
  view.priority = info.priority;
  view.phase = phaseAt(tracks_[clip].clip->timeline, info.playback.loop, info.time, 0);
  views_.push_back(view);
  players_.emplace_back();
  shown_.emplace_back();
  transforms_.push_back(info.objectToWorld);
  touched_.push_back(0);
  place(static_cast<std::uint32_t>(views_.size()) - 1);
  return view.id;
}

void Players::removeAt(std::uint32_t index) {
  Handle& handle = handles_[views_[index].id.value & kHandleSlotMask];
  handle.index = format::kNone;
  const std::uint32_t slot = views_[index].id.value & kHandleSlotMask;
  // A slot that has no number left is never used again.
  if (++handle.generation <= kMostGenerations) freeHandles_.push_back(slot);
  const std::size_t last = views_.size() - 1;
  if (index != last) {
    views_[index] = views_[last];
    players_[index] = players_[last];
    shown_[index] = shown_[last];
    transforms_[index] = transforms_[last];
    touch(index);
    handles_[views_[index].id.value & kHandleSlotMask].index = index;
  }
  views_.pop_back();
  players_.pop_back();
  shown_.pop_back();
  transforms_.pop_back();
  touched_.pop_back();
}

void Players::remove(InstanceId id) {
  const std::uint32_t index = indexOf(id);
  if (index != format::kNone) removeAt(index);
}

void Players::removeOf(AssetId asset) {
  for (std::uint32_t i = static_cast<std::uint32_t>(views_.size()); i-- > 0;) {
    if (tracks_[views_[i].clip].clip->asset == asset) removeAt(i);
  }
}

void Players::place(std::uint32_t index) {
  InstanceView& view = views_[index];
  const std::array<double, 12>& m = transforms_[index];
  const Clip& clip = *tracks_[view.clip].clip;
  for (std::size_t row = 0; row < 3; ++row) {
    view.centre[row] = m[4 * row + 3];
    for (std::size_t column = 0; column < 3; ++column) view.centre[row] += m[4 * row + column] * clip.centre[column];
  }
  for (double& x : view.centre) x = bounded(x);
  view.scale = bounded(std::max({lengthOfColumn(m, 0), lengthOfColumn(m, 1), lengthOfColumn(m, 2)}));
  view.radius = bounded(clip.radius * view.scale);
  touch(index);
}

void Players::setTransform(InstanceId id, const std::array<double, 12>& objectToWorld) {
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone || !allFinite(objectToWorld)) return;
  transforms_[index] = objectToWorld;
  place(index);
}

void Players::setPlayback(InstanceId id, const Playback& playback) {
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone || !std::isfinite(playback.speed)) return;
  InstanceView& view = views_[index];
  const Timeline& timeline = tracks_[view.clip].clip->timeline;
  const double time = momentAt(timeline, view.playback.loop, view.phase, 0).time;
  if (playback.loop != view.playback.loop) view.phase = phaseAt(timeline, playback.loop, time, 0);
  // What it passed lies on the other side then.
  if (playback.loop != view.playback.loop || (playback.speed < 0) != (view.playback.speed < 0)) {
    players_[index].passed = 0;
  }
  view.playback = playback;
  players_[index].steady = {};
  touch(index);
}

void Players::seek(InstanceId id, double time) {
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone || !std::isfinite(time)) return;
  InstanceView& view = views_[index];
  view.phase = phaseAt(tracks_[view.clip].clip->timeline, view.playback.loop, time, view.phase);
  ++view.seeks;
  players_[index].passed = 0;
}

Drawable Players::drawable(InstanceId id) const {
  Drawable drawable;
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone) return drawable;
  const Shown& shown = shown_[index];
  const Track& track = tracks_[views_[index].clip];
  drawable.count = shown.count;
  for (std::uint32_t i = 0; i < shown.count; ++i) {
    drawable.layers[i] = {
        .frame = track.slots[shown.items[i]].frame.get(), .weight = shown.weights[i], .advect = shown.advect[i]};
  }
  drawable.time = shown.time;
  drawable.held = shown.held && shown.count > 0;
  drawable.coarse = shown.coarse;
  return drawable;
}

void Players::residency(InstanceId id, std::span<std::uint8_t> frames) const {
  std::fill(frames.begin(), frames.end(), kNotResident);
  const std::uint32_t index = indexOf(id);
  if (index == format::kNone) return;
  const Track& track = tracks_[views_[index].clip];
  const std::size_t count = std::min<std::size_t>(frames.size(), track.clip->frames());
  for (std::uint32_t frame = 0; frame < count; ++frame) {
    for (std::uint32_t level = 0; level < track.clip->levelCount(); ++level) {
      if (track.slots[track.clip->item(frame, level)].frame == nullptr) continue;
      frames[frame] = static_cast<std::uint8_t>(track.clip->levels[level].log2);
      break;
    }
  }
}

bool Players::plays(std::uint32_t clip) const {
  return std::any_of(views_.begin(), views_.end(), [&](const InstanceView& view) { return view.clip == clip; });
}

void Players::setSuccessors(AssetId asset, std::span<const Succession> successions) {
  for (std::uint32_t i = 0; i < views_.size(); ++i) {
    InstanceView& view = views_[i];
    if (tracks_[view.clip].clip->asset != asset) continue;
    const auto found = std::find_if(successions.begin(), successions.end(),
                                    [&](const Succession& succession) { return succession.clip == view.clip; });
    view.successor = found == successions.end() ? format::kNone : found->successor;
    touch(i);
  }
}

namespace {

// Calls visit(track, frame) for what the instance needs now of its successor, until it gives false.
template <class Visit>
bool visitSuccessor(const std::vector<Track>& tracks, const InstanceView& view, const Visit& visit) {
  const Track& track = tracks[view.successor];
  const double phase = successorPhase(*tracks[view.clip].clip, *track.clip, view);
  const Moment moment = momentAt(track.clip->timeline, view.playback.loop, phase, 0);
  if (!visit(track, track.clip->same[moment.a])) return false;
  if (view.playback.interpolation == Interpolation::hold || moment.fraction <= 0) return true;
  return visit(track, track.clip->same[moment.b]);
}

bool anyResident(const Track& track, std::uint32_t frame) {
  const std::uint32_t levels = track.clip->levelCount();
  for (std::uint32_t level = 0; level < levels; ++level) {
    if (track.slots[std::size_t{frame} * levels + level].frame != nullptr) return true;
  }
  return false;
}

bool allFailed(const Track& track, std::uint32_t frame) {
  const std::uint32_t levels = track.clip->levelCount();
  for (std::uint32_t level = 0; level < levels; ++level) {
    if (!track.slots[std::size_t{frame} * levels + level].failed) return false;
  }
  return true;
}

}  // namespace

bool Players::succeed(AssetId asset) {
  for (const InstanceView& view : views_) {
    if (tracks_[view.clip].clip->asset != asset || view.successor == format::kNone || !(view.priority > 0)) continue;
    // One frame of the moment will do: on a slow disk both may never be there at once.
    if (visitSuccessor(tracks_, view,
                       [](const Track& track, std::uint32_t frame) { return !anyResident(track, frame); })) {
      return false;
    }
  }
  for (std::uint32_t i = 0; i < views_.size(); ++i) {
    InstanceView& view = views_[i];
    if (tracks_[view.clip].clip->asset != asset || view.successor == format::kNone) continue;
    view.phase = successorPhase(*tracks_[view.clip].clip, *tracks_[view.successor].clip, view);
    view.clip = std::exchange(view.successor, format::kNone);
    forgetDrawn(i);
    place(i);
  }
  return true;
}

bool Players::successorFailed(AssetId asset) const {
  return std::any_of(views_.begin(), views_.end(), [&](const InstanceView& view) {
    if (tracks_[view.clip].clip->asset != asset) return false;
    // It was added meanwhile, and plays a volume that is no more.
    if (view.successor == format::kNone) return true;
    return !visitSuccessor(tracks_, view,
                           [](const Track& track, std::uint32_t frame) { return !allFailed(track, frame); });
  });
}

void Players::retire(std::unique_ptr<ResidentFrame>&& frame, Transport& transport) {
  const std::uint64_t bytes = frame->stats().allocatedBytes;
  transport.retire(std::move(frame));
  ++retired_.frames;
  retired_.bytes += bytes;
}

// Whether an instance that draws the item would draw nothing without it.
bool Players::isLast(std::uint32_t clip, std::uint32_t item) const {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Shown& shown = shown_[i];
    if (views_[i].clip != clip || shown.count == 0) continue;
    bool draws = false, more = false;
    for (std::uint32_t layer = 0; layer < shown.count; ++layer) {
      draws = draws || shown.items[layer] == item;
      more = more || (shown.items[layer] != item && tracks_[clip].slots[shown.items[layer]].frame != nullptr);
    }
    if (draws && !more) return true;
  }
  return false;
}

std::size_t Players::take(std::span<Change> changes, Transport& transport) {
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Change& change = changes[i];
    if (change.kind == Change::Kind::arrive && !transport.admit(*change.frame)) return i;
    // Where memory is short in the middle, the rest is taken the next time, and this not again.
    const Change::Kind kind = std::exchange(change.kind, Change::Kind::none);
    if (kind == Change::Kind::discard) {
      transport.retire(std::move(change.frame));
      continue;
    }
    if (kind == Change::Kind::level) {
      const std::uint32_t index = indexOf(change.instance);
      if (index != format::kNone) {
        players_[index].level = static_cast<std::uint8_t>(change.item);
        players_[index].ideal = static_cast<std::uint8_t>(change.ideal);
        players_[index].steady = {};
      }
      continue;
    }
    Track& track = tracks_[change.clip];
    if (kind == Change::Kind::closed) {
      for (Track::Slot& slot : track.slots) {
        if (slot.frame != nullptr) retire(std::move(slot.frame), transport);
      }
      track.slots.clear();
      freeTracks_.push_back(change.clip);
      continue;
    }
    // What arrives for a closed clip stays: until planning knows that it is closed, it may look at the frame.
    if (track.clip == nullptr && kind != Change::Kind::arrive) continue;
    Track::Slot& slot = track.slots[change.item];
    switch (kind) {
      case Change::Kind::arrive:
        if (slot.frame != nullptr) retire(std::move(slot.frame), transport);
        slot.frame = std::move(change.frame);
        ++track.version;
        break;
      case Change::Kind::force:
      case Change::Kind::seize:
        if (slot.frame == nullptr) break;
        if (kind == Change::Kind::force && isLast(change.clip, change.item)) {
          notices_.push_back({.kind = Notice::Kind::refused, .clip = change.clip, .item = change.item, .opened = {}});
          break;
        }
        retire(std::move(slot.frame), transport);
        ++track.version;
        notices_.push_back({.kind = Notice::Kind::retired, .clip = change.clip, .item = change.item, .opened = {}});
        break;
      case Change::Kind::evict:
        asked_.emplace_back(change.clip, change.item);
        break;
      case Change::Kind::fail:
        slot.failed = true;
        break;
      default:
        break;
    }
  }
  return changes.size();
}

void Players::advance(double seconds) {
  const auto passing = static_cast<float>(std::max(seconds, kLeastPassing));
  count_ = {};
  for (std::size_t i = 0; i < views_.size(); ++i) {
    InstanceView& view = views_[i];
    Track& track = tracks_[view.clip];
    const double moved = view.playback.speed * seconds;
    view.phase = wrapPhase(track.clip->timeline, view.playback.loop, view.phase + moved);
    Shown& shown = shown_[i];
    const std::uint32_t before = players_[i].near;
    if (!goOn(track, view, players_[i], shown, passing)) {
      chooseLayers(track, view, players_[i], shown, moved, passing);
    }
    if (!(view.priority > 0)) continue;
    ++count_.all;
    if (shown.count == 0) ++count_.empty;
    if (shown.count > 0 && shown.held) ++count_.held;
    if (shown.coarse) ++count_.coarse;
    if ((shown.held || shown.count == 0) && players_[i].near != before) ++count_.late;
  }
}

void Players::giveBack(Transport& transport) {
  if (asked_.empty()) return;
  ++givenBack_;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Shown& shown = shown_[i];
    for (std::uint32_t layer = 0; layer < shown.count; ++layer) {
      tracks_[views_[i].clip].slots[shown.items[layer]].drawn = givenBack_;
    }
  }
  for (const auto& [clip, item] : asked_) {
    Track::Slot& slot = tracks_[clip].slots[item];
    if (slot.frame == nullptr) continue;
    const bool drawn = slot.drawn == givenBack_;
    notices_.push_back(
        {.kind = drawn ? Notice::Kind::refused : Notice::Kind::retired, .clip = clip, .item = item, .opened = {}});
    if (drawn) continue;
    retire(std::move(slot.frame), transport);
    ++tracks_[clip].version;
  }
  asked_.clear();
}

void Players::fill(Report& report) {
  report.moments.resize(views_.size());
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Shown& shown = shown_[i];
    report.moments[i] = {.phase = views_[i].phase,
                         .drawn = shown.items,
                         .drawnCount = shown.count,
                         .seeks = views_[i].seeks,
                         .held = shown.held};
  }
  report.changed.reserve(report.changed.size() + touches_.size());
  for (const std::uint32_t index : touches_) {
    if (index >= views_.size() || std::exchange(touched_[index], std::uint8_t{0}) == 0) continue;
    report.changed.push_back({.index = index, .view = views_[index]});
  }
  touches_.clear();
  report.notices.insert(report.notices.end(), std::make_move_iterator(notices_.begin()),
                        std::make_move_iterator(notices_.end()));
  notices_.clear();
}

void Players::dropFrames() {
  notices_.clear();
  asked_.clear();
  freeTracks_.clear();
  for (std::uint32_t number = 0; number < tracks_.size(); ++number) {
    Track& track = tracks_[number];
    if (track.clip == nullptr) {
      track.slots.clear();
      freeTracks_.push_back(number);
      continue;
    }
    track.slots = std::vector<Track::Slot>(track.clip->items());
    ++track.version;
    notices_.push_back({.kind = Notice::Kind::opened, .clip = number, .item = 0, .opened = track.clip});
  }
  for (std::uint32_t i = 0; i < views_.size(); ++i) forgetDrawn(i);
  touchAll();
}

}  // namespace billow::runtime
