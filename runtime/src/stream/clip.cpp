#include "clip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "billow/format/affine.h"

namespace billow::runtime {
namespace {

constexpr std::uint32_t kMeansLog2 = 3;  // of the length of a voxel of means

// Everything of a grid frame that can be seen. Two frames with equal roots and constants are one.
using GridKey =
    std::tuple<std::uint32_t, std::uint32_t, float, float, float, std::array<std::int32_t, 6>, std::array<double, 12>>;

GridKey keyOf(const format::GridFrame& grid) {
  std::array<std::int32_t, 6> box{};
  std::copy_n(grid.activeMin, 3, box.begin());
  std::copy_n(grid.activeMax, 3, box.begin() + 3);
  std::array<double, 12> transform{};
  std::copy_n(grid.indexToWorld, 12, transform.begin());
  return {grid.flags, grid.node5, grid.background, grid.valueMin, grid.valueMax, box, transform};
}

std::vector<std::uint32_t> equalFrames(const format::Pack& pack, const format::VolumeRecord& volume) {
  std::map<std::vector<GridKey>, std::uint32_t> first;
  std::vector<std::uint32_t> same(volume.frameCount);
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    std::vector<GridKey> keys;
    keys.reserve(volume.gridCount);
    for (std::uint32_t grid = 0; grid < volume.gridCount; ++grid) {
      keys.push_back(keyOf(pack.gridFrame(volume, frame, grid)));
    }
    same[frame] = first.try_emplace(std::move(keys), frame).first->second;
  }
  return same;
}

bool holdsVoxels(const format::GridFrame& grid) {
  return (grid.flags & format::kGridPresent) != 0 && grid.node5 != format::kNone;
}

// Calls visit for each grid frame in which something is active.
template <class Visit>
void visitGrids(const format::Pack& pack, const format::VolumeRecord& volume, const Visit& visit) {
  for (std::uint32_t i = 0; i < volume.frameCount * volume.gridCount; ++i) {
    const format::GridFrame& grid = pack.gridFrames()[volume.firstGridFrame + i];
    if (holdsVoxels(grid)) visit(grid);
  }
}

double voxelWidth(const format::Pack& pack, const format::VolumeRecord& volume) {
  double width = 0;
  visitGrids(pack, volume, [&](const format::GridFrame& grid) {
    if (width > 0) return;
    width = std::cbrt(std::abs(format::determinant(grid.indexToWorld)));
  });
  return width > 0 && std::isfinite(width) ? width : 1;
}

void findBounds(const format::Pack& pack, const format::VolumeRecord& volume, Clip& clip) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::max());
  high.fill(std::numeric_limits<double>::lowest());
  visitGrids(pack, volume, [&](const format::GridFrame& grid) {
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      for (std::size_t row = 0; row < 3; ++row) {
        const double* m = grid.indexToWorld + 4 * row;
        double at = m[3];
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
          at += m[axis] * ((corner >> axis & 1) != 0 ? grid.activeMax[axis] + 0.5 : grid.activeMin[axis] - 0.5);
        }
        low[row] = std::min(low[row], at);
        high[row] = std::max(high[row], at);
      }
    }
  });
  if (low[0] > high[0]) return;
  double square = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    clip.centre[row] = low[row] / 2 + high[row] / 2;
    square += (high[row] / 2 - low[row] / 2) * (high[row] / 2 - low[row] / 2);
  }
  clip.radius = std::sqrt(square);
}

bool hasVelocity(const format::Pack& pack, const format::VolumeRecord& volume) {
  std::uint32_t found = 0;
  for (const format::GridRecord& grid : pack.gridsOf(volume)) {
    const auto role = static_cast<format::Role>(grid.role);
    if (role == format::Role::velocityX) found |= 1;
    if (role == format::Role::velocityY) found |= 2;
    if (role == format::Role::velocityZ) found |= 4;
  }
  return found == 7;
}

void addLevels(const format::Pack& pack, std::uint32_t volume, Clip& clip) {
  const auto add = [&](std::uint32_t number, std::uint32_t log2) {
    const format::VolumeRecord& record = pack.volumes()[number];
    clip.levels.push_back(
        {.volume = number, .grids = chooseGrids(pack, record), .log2 = log2, .voxel = voxelWidth(pack, record)});
  };
  add(volume, 0);
  for (const format::LevelRecord& level : pack.levelsOf(volume)) {
    // Means are as coarse as that, and smaller than a tree.
    if (level.log2 < kMeansLog2) add(level.level, level.log2);
  }
  ClipLevel means = clip.levels.front();
  means.means = true;
  means.log2 = kMeansLog2;
  means.voxel *= 1 << kMeansLog2;
  clip.levels.push_back(means);
}

}  // namespace

LoadOrder Clip::order(std::uint32_t item, bool carried) const {
  const ClipLevel& level = levels[levelOf(item)];
  const format::VolumeRecord& record = pack->pack.volumes()[level.volume];
  return {.ticket = 0,
          .pack = pack,
          .volume = level.volume,
          .frame = frameOf(item),
          .grids = carried ? withVelocity(pack->pack, record, level.grids) : level.grids,
          .means = level.means};
}

std::uint64_t Clip::bricks(std::uint32_t item) const {
  const ClipLevel& level = levels[levelOf(item)];
  const format::VolumeRecord& record = pack->pack.volumes()[level.volume];
  std::uint64_t count = 0;
  for (const std::uint32_t grid : {level.grids.extinction, level.grids.temperature, level.grids.flames}) {
    if (grid < record.gridCount) count += pack->pack.gridFrame(record, frameOf(item), grid).node3Count;
  }
  return count;
}

std::shared_ptr<const Clip> makeClip(const std::shared_ptr<OpenPack>& open, AssetId asset, std::uint32_t volume) {
  const format::Pack& pack = open->pack;
  const format::VolumeRecord& record = pack.volumes()[volume];
  if (record.frameCount == 0) return nullptr;
  auto clip = std::make_shared<Clip>();
  clip->pack = open;
  clip->asset = asset;
  clip->volume = volume;
  clip->timeline = Timeline(pack.framesOf(record), record.framesPerSecond);
  clip->same = equalFrames(pack, record);
  clip->velocity = hasVelocity(pack, record);
  addLevels(pack, volume, *clip);
  findBounds(pack, record, *clip);
  return clip;
}

std::vector<std::shared_ptr<const Clip>> makeClips(const std::shared_ptr<OpenPack>& pack, AssetId asset) {
  std::vector<std::shared_ptr<const Clip>> clips;
  for (std::uint32_t volume = 0; volume < pack->pack.volumes().size(); ++volume) {
    clips.push_back(pack->pack.isLevel(volume) ? nullptr : makeClip(pack, asset, volume));
  }
  return clips;
}

std::shared_ptr<const Clip> withGrids(const Clip& clip, const GridChoice& grids) {
  auto other = std::make_shared<Clip>(clip);
  // A level has the grids of its volume, in the same order.
  for (ClipLevel& level : other->levels) level.grids = grids;
  return other;
}

}  // namespace billow::runtime
