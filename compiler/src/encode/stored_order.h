// A brick on its texel scale, in the order in which its blocks are stored.
#ifndef BILLOW_COMPILER_ENCODE_STORED_ORDER_H
#define BILLOW_COMPILER_ENCODE_STORED_ORDER_H

#include <cstdint>

#include "encode/bc7_plane.h"
#include "encode/scalar_fit.h"
#include "encode/texel_range.h"

namespace billow::compiler {

// What every block encoding of a brick starts from.
struct BrickTargets {
  explicit BrickTargets(const BrickSource& brick);

  TexelRange range;
  TexelTargets value;
  TexelWeights weight;
  bool allActive;
};

// The same with an axis exchanged with z: value[z][y][x].
class StoredBrick {
 public:
  StoredBrick(const BrickTargets& targets, std::uint32_t packedAxis);

  // BC4 block 0 to 31: slice, block row, block column.
  Scalars scalars(std::uint32_t block) const;
  // BC7 block 0 to 7: pair of four slices, block row, block column.
  Plane plane(std::uint32_t block) const;

 private:
  float value_[format::kBrickVoxels];
  float weight_[format::kBrickVoxels];
  bool allActive_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_STORED_ORDER_H
