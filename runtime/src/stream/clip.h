// One volume of an open pack as planning sees it: its moments, which frames are equal, and at what levels of detail
// each can be had. Immutable once made, so that every thread may read it.
#ifndef BILLOW_RUNTIME_STREAM_CLIP_H
#define BILLOW_RUNTIME_STREAM_CLIP_H

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "playback.h"
#include "transport.h"

namespace billow::runtime {

struct ClipLevel {
  std::uint32_t volume = 0;
  GridChoice grids = {};
  bool means = false;
  std::uint32_t log2 = 0;  // of how many voxels of the volume one of its is wide
  double voxel = 1;        // width in the volume's own world
};

// What can be resident is an item: a distinct frame at a level, numbered frame * levels + level.
struct Clip {
  std::shared_ptr<OpenPack> pack;
  AssetId asset = {};
  std::uint32_t volume = 0;
  Timeline timeline;
  std::vector<std::uint32_t> same;  // by frame: the first that holds the same
  std::vector<ClipLevel> levels;    // the finest first; the last is that of means
  bool velocity = false;            // every velocity component has a grid
  std::array<double, 3> centre{};   // of what is ever active, in the volume's own world
  double radius = 0;

  std::uint32_t frames() const { return timeline.frames(); }
  std::uint32_t levelCount() const { return static_cast<std::uint32_t>(levels.size()); }
  std::uint32_t items() const { return frames() * levelCount(); }
  std::uint32_t item(std::uint32_t frame, std::uint32_t level) const { return same[frame] * levelCount() + level; }
  std::uint32_t frameOf(std::uint32_t item) const { return item / levelCount(); }
  std::uint32_t levelOf(std::uint32_t item) const { return item % levelCount(); }

  // `carried`: with the grids that Interpolation::advect needs.
  LoadOrder order(std::uint32_t item, bool carried) const;
  // Distinct bricks of an item: what is missing where it is not drawn.
  std::uint64_t bricks(std::uint32_t item) const;
};

// Null where the volume has no frames. One that is a level of another plays alone.
std::shared_ptr<const Clip> makeClip(const std::shared_ptr<OpenPack>& pack, AssetId asset, std::uint32_t volume);
// One for each volume that has frames and is no level of another; null in place of the rest.
std::vector<std::shared_ptr<const Clip>> makeClips(const std::shared_ptr<OpenPack>& pack, AssetId asset);
// The same, but for the grids that it draws: they are numbers within its volume.
std::shared_ptr<const Clip> withGrids(const Clip& clip, const GridChoice& grids);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_CLIP_H
