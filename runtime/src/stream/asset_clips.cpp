#include "asset_clips.h"

#include <algorithm>
#include <string>
#include <utility>

#include "api.h"

namespace billow::runtime {
namespace {

using Grid = std::uint32_t GridChoice::*;
constexpr Grid kGrids[] = {&GridChoice::extinction, &GridChoice::temperature, &GridChoice::flames,
                           &GridChoice::velocityX,  &GridChoice::velocityY,   &GridChoice::velocityZ};

bool exist(const GridChoice& grids, const format::VolumeRecord& volume) {
  return std::all_of(std::begin(kGrids), std::end(kGrids),
                     [&](Grid grid) { return grids.*grid == format::kNone || grids.*grid < volume.gridCount; });
}

// What Interpolation::advect needs is added where an instance advects.
GridChoice withoutVelocity(GridChoice grids) {
  grids.velocityX = grids.velocityY = grids.velocityZ = format::kNone;
  return grids;
}

// The grids of the same names in another pack's volume.
GridChoice sameNames(const format::Pack& pack, std::uint32_t volume, const GridChoice& grids,
                     const format::Pack& other) {
  const auto from = pack.gridsOf(pack.volumes()[volume]), to = other.gridsOf(other.volumes()[volume]);
  GridChoice same;
  for (const Grid grid : kGrids) {
    if (grids.*grid == format::kNone) continue;
    const auto found = std::find_if(to.begin(), to.end(), [&](const format::GridRecord& record) {
      return other.string(record.name) == pack.string(from[grids.*grid].name);
    });
    if (found != to.end()) same.*grid = static_cast<std::uint32_t>(found - to.begin());
  }
  return same;
}

std::vector<std::uint32_t> openAll(const Opened& opened, Players& players) {
  std::vector<std::uint32_t> clips;
  for (const auto& clip : opened.clips) clips.push_back(clip != nullptr ? players.openClip(clip) : format::kNone);
  return clips;
}

void closeAll(std::vector<std::uint32_t>& clips, Players& players) {
  for (const std::uint32_t clip : clips) {
    if (clip != format::kNone) players.closeClip(clip);
  }
  clips.clear();
}

}  // namespace

void AssetClips::open(const Opened& opened, Home home) {
  volumes_ = openAll(opened, home.players);
}

void AssetClips::close(Home home) {
  closeNext(home);
  closeAll(volumes_, home.players);
  for (const Chosen& chosen : chosen_) home.players.closeClip(chosen.now.clip);
  chosen_.clear();
}

Result<std::uint32_t> AssetClips::find(const InstanceInfo& info, Opened& opened, Opened* next, Home home) {
  const format::Pack& pack = opened.pack->pack;
  if (info.volume >= pack.volumes().size() || pack.volumes()[info.volume].frameCount == 0) {
    return failure(ErrorCode::argument, "the pack has no volume " + std::to_string(info.volume) + " with frames");
  }
  const format::VolumeRecord& volume = pack.volumes()[info.volume];
  const GridChoice usual = chooseGrids(pack, volume), grids = withoutVelocity(info.grids.value_or(usual));
  if (!exist(grids, volume)) return failure(ErrorCode::argument, "InstanceInfo: the volume has no such grid");
  if (grids == usual && volumes_[info.volume] != format::kNone) return volumes_[info.volume];
  const auto known = std::find_if(chosen_.begin(), chosen_.end(), [&](const Chosen& chosen) {
    return chosen.volume == info.volume && chosen.now.grids == grids;
  });
  if (known != chosen_.end()) return known->now.clip;
  chosen_.reserve(chosen_.size() + 1);
  auto made = make(info.volume, grids, opened, home);
  if (!made) return tl::unexpected(made.error());
  chosen_.push_back({.volume = info.volume, .now = *made, .next = {}});
  if (next != nullptr) makeNext(chosen_.back(), opened, *next, home);
  return made->clip;
}

Result<AssetClips::Made> AssetClips::make(std::uint32_t volume, const GridChoice& grids, Opened& opened, Home home) {
  const std::shared_ptr<const Clip> usual = opened.clips[volume];
  const std::shared_ptr<const Clip> clip =
      withGrids(usual != nullptr ? *usual : *makeClip(opened.pack, home.asset, volume), grids);
  const std::uint64_t bytes = bookkeepingBytes(*clip);
  if (home.transport != nullptr && !home.transport->reserveCpu(bytes)) {
    return failure(ErrorCode::budget, "tables for the instance's grids do not fit into the CPU budget");
  }
  opened.bytes += bytes;
  return Made{.grids = grids, .clip = home.players.openClip(clip), .bytes = bytes};
}

void AssetClips::drop(const Made& made, Opened& opened, Home home) {
  if (made.clip == format::kNone) return;
  home.players.closeClip(made.clip);
  if (home.transport != nullptr) home.transport->releaseCpu(made.bytes);
  opened.bytes -= made.bytes;
}

void AssetClips::dropUnused(Opened& opened, Opened* next, Home home) {
  std::erase_if(chosen_, [&](const Chosen& chosen) {
    if (home.players.plays(chosen.now.clip)) return false;
    drop(chosen.now, opened, home);
    if (next != nullptr) drop(chosen.next, *next, home);
    return true;
  });
}

// Where it cannot be made it has none.
void AssetClips::makeNext(Chosen& chosen, const Opened& opened, Opened& next, Home home) {
  const format::Pack& pack = next.pack->pack;
  if (chosen.volume >= pack.volumes().size() || pack.volumes()[chosen.volume].frameCount == 0) return;
  const GridChoice grids = sameNames(opened.pack->pack, chosen.volume, chosen.now.grids, pack);
  if (const auto made = make(chosen.volume, grids, next, home)) chosen.next = *made;
}

void AssetClips::openNext(const Opened& opened, Opened& next, Home home) {
  nextVolumes_ = openAll(next, home.players);
  for (Chosen& chosen : chosen_) makeNext(chosen, opened, next, home);
}

std::vector<Succession> AssetClips::successions() const {
  std::vector<Succession> successions;
  for (std::size_t i = 0; i < std::min(volumes_.size(), nextVolumes_.size()); ++i) {
    if (volumes_[i] != format::kNone) successions.push_back({volumes_[i], nextVolumes_[i]});
  }
  for (const Chosen& chosen : chosen_) successions.push_back({chosen.now.clip, chosen.next.clip});
  return successions;
}

void AssetClips::closeNext(Home home) {
  closeAll(nextVolumes_, home.players);
  for (Chosen& chosen : chosen_) {
    if (chosen.next.clip != format::kNone) home.players.closeClip(chosen.next.clip);
    chosen.next = {};
  }
}

void AssetClips::succeed(Home home) {
  closeAll(volumes_, home.players);
  volumes_ = std::exchange(nextVolumes_, {});
  for (Chosen& chosen : chosen_) {
    home.players.closeClip(chosen.now.clip);
    chosen.now = std::exchange(chosen.next, {});
  }
}

}  // namespace billow::runtime
