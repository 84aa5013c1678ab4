// A brick's payload by its encoding: spec/pagecodec.md, "Bricks".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H

#include "bc7_model.h"
#include "billow/format/brick.h"
#include "mask_model.h"
#include "voxel_model.h"

namespace billow::format::page_coder {

using ActiveRows = std::array<std::uint8_t, 64>;  // row x * 8 + y: bit z

// What the page tells of a brick's active voxels: `rows` where it has the mask, else those whose index is not 0 are.
struct BrickShape {
  std::uint32_t encoding;
  bool hasMask;
  ActiveRows rows;
};

class BrickModel {
 public:
  BrickModel();

  // Codes `payload` of brickBytes(encoding) bytes, and sets shape.rows to the voxels whose indices were coded.
  template <class Coder>
  void code(Coder& coder, BrickShape& shape, std::byte* payload, MaskModel& masks);

  // Bytes that nothing is known of.
  template <class Coder>
  void codePlain(Coder& coder, std::byte* bytes, std::size_t count);

 private:
  template <class Coder>
  void codeIndexed(Coder& coder, BrickShape& shape, std::byte* payload, MaskModel& masks);
  template <class Coder>
  void codeEnds(Coder& coder, const ActiveRows& rows, std::byte* ends);
  template <class Coder>
  void codeCoarse(Coder& coder, std::byte* bytes);
  template <class Coder>
  void codeWide(Coder& coder, std::byte* bytes);
  void setLocalCells(std::uint32_t bits, const std::byte* ends);

  VoxelModel voxels_;
  Bc7Model bc7_;
  std::array<BitModel, kEncodingCount> regular_;
  std::array<SymbolModel, 8> ends_;
  ClassBits endBits_;
  std::array<SymbolModel, 4> coarse_;
  ClassBits coarseBits_;
  std::array<SymbolModel, 2> wide_;
  ClassBits wideBits_;
  std::array<ByteModel, 2> plain_;
  std::array<Cell, 9> uniformCells_;  // by bits
  std::array<Cell, kLocalCells> localCells_;
  std::array<const Cell*, 256> cellOf_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H
