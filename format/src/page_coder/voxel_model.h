// The indices of bricks of the uniform and local encodings, each predicted from its neighbours that are already known.
// spec/pagecodec.md, "Voxels".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H

#include <span>

#include "token_tables.h"

namespace billow::format::page_coder {

// The indices of one brick, `bits` (1 to 8) each, the first in the low bits.
struct VoxelBrick {
  std::byte* indices;
  const std::uint8_t* mask;  // 64 rows of active voxels, the others have index 0; nullptr without a mask
  std::uint32_t bits;
};

// All bricks of a page together: the tables that they share, then the bricks, two at a time.
class VoxelModel {
 public:
  template <class Coder>
  void code(Coder& coder, std::span<const VoxelBrick> bricks);

 private:
  TokenTables tables_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H
