// How far a ray may skip: what a flat table's empty cells hold.
#ifndef BILLOW_RUNTIME_STREAM_DISTANCE_FIELD_H
#define BILLOW_RUNTIME_STREAM_DISTANCE_FIELD_H

#include <cstdint>
#include <span>

#include "billow/format/gpu_size.h"

namespace billow::runtime {

// Distances over the cells of the box and one layer before it: in that layer upper taps already reach into the box.
class DistanceField {
 public:
  static std::uint64_t scratchOf(const format::CellBox& cells);  // bytes

  DistanceField(const format::CellBox& cells, std::span<std::uint8_t> scratch);

  // Writes gpu::kSkip and the distance to the nearest cell that must be sampled, in cells by the maximum norm and at
  // most 255, into each entry of the table but those that must be sampled themselves.
  void addTo(std::span<std::uint32_t> table);

 private:
  std::uint8_t* row(std::uint32_t x, std::uint32_t y) { return cells_.data() + (std::size_t{x} * y_ + y) * z_; }
  void markBusy(std::span<const std::uint32_t> table);
  // In ascending (1) or descending (-1) order, over the 13 neighbours that were visited before.
  void sweep(int order);
  void gatherNear(int x, int y, int order);

  std::uint32_t x_, y_, z_;  // cells along each axis, with the layer
  std::span<std::uint8_t> cells_;
  std::span<std::uint8_t> least_;  // a row with a cell before and behind
  std::span<std::uint8_t> near_;   // a row
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_DISTANCE_FIELD_H
