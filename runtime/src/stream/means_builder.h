// A grid eight times coarser, of the means that its Node3s have: something small to draw where the grid does not fit.
// A voxel stands for 8^3 of the grid's, and is active where a Node3 or an active tile is. Sums of values times volume
// are those of the grid, so optical depth is, as far as the encoding rounds.
#ifndef BILLOW_RUNTIME_STREAM_MEANS_BUILDER_H
#define BILLOW_RUNTIME_STREAM_MEANS_BUILDER_H

#include <array>
#include <cstdint>
#include <span>

#include "stream/grid_builder.h"

namespace billow::runtime {

inline constexpr std::size_t kNode4Cells = 4096;

// The grid frame of the means: box, transform and number of active voxels in their index space.
format::GridFrame frameOfMeans(const format::GridFrame& frame);
// Of a brick of means: eight bits a voxel where these are off by no more than the grid itself is, else sixteen.
std::uint32_t encodingOfMeans(const format::GridFrame& frame);

class MeansBuilder {
 public:
  // `scratch.means`: kNode4Cells.
  MeansBuilder(TreeWalk& walk, const GridPlan& grid, BrickPlaces& bricks, MaskTable& masks, const GridScratch& scratch,
               std::span<std::byte> buffer);

  // Fills the grid's sections, with a flat index; else the walk's issue says what is wrong.
  bool build();
  std::uint64_t activeVoxels() const { return active_; }

 private:
  using Upper = TreeWalk::Visited<format::Node4>;

  bool addNode4(std::uint32_t bit, const Upper& node);
  bool gather(const Upper& node);
  bool addBrick(const std::array<std::uint32_t, 3>& cell, std::uint32_t corner, const Upper& node);
  bool addTile(std::uint32_t bit, const Upper& node);
  std::uint32_t encode(std::span<const float, format::kBrickVoxels> values, const format::Mask3& active);
  std::uint32_t* entry(const std::array<std::uint32_t, 3>& cell);  // null outside of the box

  TreeWalk& walk_;
  const GridPlan& grid_;
  BrickPlaces& bricks_;
  MaskTable& masks_;
  std::span<std::uint8_t> distances_;
  std::span<float> means_;                    // by bit of the Node4; where there is no child nothing is read
  std::array<std::uint32_t, 128> present_{};  // of its children, those in the active box
  std::span<std::uint32_t> table_;
  RecordTable records_;
  std::uint64_t active_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_MEANS_BUILDER_H
