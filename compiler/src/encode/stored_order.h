// A brick on its texel scale, in the order in which its blocks are stored.
#ifndef BILLOW_COMPILER_ENCODE_STORED_ORDER_H
#define BILLOW_COMPILER_ENCODE_STORED_ORDER_H

#include <cstdint>

#include "encode/bc7_plane.h"
#include "encode/wide/wide_encoder.h"

namespace billow::compiler {

// Targets with an axis exchanged with z: value[z][y][x].
class StoredBrick {
 public:
  StoredBrick(const BrickTargets& targets, std::uint32_t packedAxis);

  // BC7 block 0 to 7: pair of four slices, block row, block column.
  Plane plane(std::uint32_t block) const;

 private:
  float value_[format::kBrickVoxels];
  float weight_[format::kBrickVoxels];
  bool allActive_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_STORED_ORDER_H
