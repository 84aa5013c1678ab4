#include "stream/means_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "billow/format/brick.h"
#include "stream/distance_field.h"

namespace billow::runtime {
namespace {

using format::Node3;
using format::Rule;

constexpr std::int32_t kStep = 8;              // voxels of the grid, to a voxel of its means
constexpr double kCentre = (kStep - 1) / 2.0;  // where the first of these lies

}  // namespace

format::GridFrame frameOfMeans(const format::GridFrame& frame) {
  format::GridFrame means = frame;
  const format::CellBox cells = format::cellBox(frame);
  for (int axis = 0; axis < 3; ++axis) {
    means.origin[axis] = 0;
    means.activeMin[axis] = static_cast<std::int32_t>(cells.min[axis]);
    means.activeMax[axis] = static_cast<std::int32_t>(cells.min[axis] + cells.dim[axis]) - 1;
    double* const row = means.indexToWorld + 4 * axis;
    row[3] += kCentre * (row[0] + row[1] + row[2]);
    for (int column = 0; column < 3; ++column) row[column] *= kStep;
  }
  means.activeVoxels = 0;
  return means;
}

std::uint32_t encodingOfMeans(const format::GridFrame& frame) {
  const double half = (double{frame.valueMax} - double{frame.valueMin}) / 255 / 2;
  return half <= double{frame.maxError} ? format::kEncodingUniform8 : format::kEncodingUniform16;
}

MeansBuilder::MeansBuilder(TreeWalk& walk, const GridPlan& grid, BrickPlaces& bricks, MaskTable& masks,
                           const GridScratch& scratch, std::span<std::byte> buffer)
    : walk_(walk),
      grid_(grid),
      bricks_(bricks),
      masks_(masks),
      distances_(scratch.distances),
      means_(scratch.means),
      table_(itemsOf<std::uint32_t>(buffer, grid.table)),
      records_(itemsOf<GpuRecord>(buffer, grid.records), grid.frame->tileCount, grid.frame->background,
               scratch.tiles.first(grid.tileSlots)) {
  std::ranges::fill(itemsOf<GpuRecord>(buffer, grid.records), GpuRecord{});  // some may stay unused
}

bool MeansBuilder::build() {
  const auto root = walk_.root();
  if (root.node == nullptr) return false;
  std::uint32_t absent = 0;
  if (root.tile) {
    const auto number = records_.tile(root.node->tile);
    if (!number) return walk_.fail(Rule::counts, root.at, "It has a tile, and the grid frame says none.");
    absent = *number;
    active_ = grid_.cells.count() * format::kBrickVoxels;
  }
  std::ranges::fill(table_, absent);
  std::uint32_t place = 0;
  const bool done = forEachBit(root.node->mask, [&](std::uint32_t bit) {
    const Upper node = walk_.node4(root.at, root.children.list[place++]);
    return node.node != nullptr && addNode4(bit, node);
  });
  if (done && grid_.frame->background == 0) DistanceField(grid_.cells, distances_).addTo(table_);
  return done;
}

std::uint32_t* MeansBuilder::entry(const std::array<std::uint32_t, 3>& cell) {
  std::size_t at = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t local = cell[axis] - grid_.cells.min[axis];
    if (local >= grid_.cells.dim[axis]) return nullptr;
    at = at * grid_.cells.dim[axis] + local;
  }
  return &table_[at];
}

// A Node4 is 2^3 bricks of means.
bool MeansBuilder::addNode4(std::uint32_t bit, const Upper& node) {
  if (node.tile) return addTile(bit, node);
  if (node.children.count == 0) return true;
  if (!gather(node)) return false;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::array<std::uint32_t, 3> cell{(bit >> 10) * 2 + (corner >> 2), (bit >> 5 & 31) * 2 + (corner >> 1 & 1),
                                            (bit & 31) * 2 + (corner & 1)};
    if (!addBrick(cell, corner, node)) return false;
  }
  return true;
}

bool MeansBuilder::addTile(std::uint32_t bit, const Upper& node) {
  const auto number = records_.tile(node.node->tile);
  if (!number) return walk_.fail(Rule::counts, node.at, "There are more values of tiles than the grid frame says.");
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    std::uint32_t* const at = entry(
        {(bit >> 10) * 2 + (corner >> 2), (bit >> 5 & 31) * 2 + (corner >> 1 & 1), (bit & 31) * 2 + (corner & 1)});
    if (at == nullptr) continue;
    *at = *number;
    active_ += format::kBrickVoxels;
  }
  return true;
}

bool MeansBuilder::gather(const Upper& node) {
  std::ranges::copy(node.node->mask, present_.begin());
  const std::uint32_t* next = node.children.list;
  return forEachBit(node.node->mask, [&](std::uint32_t child) {
    const std::uint32_t index = *next++;
    const PageItems::Found found = walk_.node3(node.at, index);
    if (found.data == nullptr) return false;
    means_[child] = reinterpret_cast<const Node3*>(found.data)->mean;
    return std::isfinite(means_[child]) || walk_.fail(Rule::brickFinite, {"Node3", index, found.page}, "Its mean.");
  });
}

// The brick of one corner of the Node4, at a cell of the coarse grid.
bool MeansBuilder::addBrick(const std::array<std::uint32_t, 3>& cell, std::uint32_t corner, const Upper& node) {
  std::array<float, format::kBrickVoxels> values{};
  format::Mask3 active{};
  std::uint32_t count = 0;
  for (std::uint32_t row = 0; row < 64; ++row) {
    const std::uint32_t x = (corner >> 2) * 8 + (row >> 3), y = (corner >> 1 & 1) * 8 + (row & 7), z = (corner & 1) * 8;
    const std::uint32_t bits = present_[x * 8 + y / 2] >> (y % 2 * 16 + z) & 0xff;
    active.words[row / 4] |= bits << row % 4 * 8;
    count += static_cast<std::uint32_t>(std::popcount(bits));
    for (std::uint32_t rest = bits; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(rest));
      values[row * 8 + k] = means_[x << 8 | y << 4 | (z + k)];
    }
  }
  std::uint32_t* const at = count != 0 ? entry(cell) : nullptr;
  if (at == nullptr) return true;
  active_ += count;
  *at = encode(values, active);
  return *at != 0 || walk_.fail(Rule::counts, node.at, "There are more children than the grid frame says.");
}

// The number of the brick's record; 0 where there is no room.
std::uint32_t MeansBuilder::encode(std::span<const float, format::kBrickVoxels> values, const format::Mask3& active) {
  float lo = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  bool all = true;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(active, i)) {
      all = false;
      continue;
    }
    lo = std::min(lo, values[i]);
    high = std::max(high, values[i]);
  }
  GpuRecord record{.brick = 0, .mask = format::kMaskAll, .lo = lo, .scale = 0};
  if (!all) {
    if (masks_.used == masks_.masks.size()) return 0;
    record.mask = masks_.used;
    masks_.masks[masks_.used++] = active;
  }
  const std::uint32_t encoding = encodingOfMeans(*grid_.frame);
  const double last = format::largestTexel(encoding);
  record.scale = static_cast<float>((double{high} - double{lo}) / last);
  if (record.scale == 0) return records_.add(record);
  std::byte* const bytes = bricks_.take(encoding, record.brick);
  if (bytes == nullptr) return 0;
  format::Texels texels{};
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const double texel = std::floor((double{values[i]} - double{lo}) / double{record.scale} + 0.5);
    if (format::maskBit(active, i)) texels[i] = static_cast<std::uint16_t>(std::clamp(texel, 0.0, last));
  }
  format::packIndices(texels, format::indexBits(encoding), bytes);
  return records_.add(record);
}

}  // namespace billow::runtime
