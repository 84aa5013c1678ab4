// A brick's payload by its encoding: spec/pagecodec.md, "Bricks".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H

#include "bc7_model.h"
#include "billow/format/brick.h"

namespace billow::format::page_coder {

using ActiveRows = std::array<std::uint8_t, 64>;  // row x * 8 + y: bit z

inline constexpr ActiveRows kAllRows = [] {
  ActiveRows rows{};
  rows.fill(0xff);
  return rows;
}();

// Bytes of a brick before its indices.
constexpr std::uint32_t endBytes(std::uint32_t encoding) {
  return isLocal(encoding) ? kLocalCellBytes : 0;
}

class BrickModel {
 public:
  BrickModel();

  // Codes `payload` of brickBytes(encoding) bytes; `mask` says which voxels are active where the page does, else it is
  // nullptr. True where the indices, of 1 to 8 bits, are still to be coded: those of inactive voxels are 0.
  template <class Coder>
  bool code(Coder& coder, std::uint32_t encoding, const ActiveRows* mask, std::byte* payload);

  // Bytes that nothing is known of.
  template <class Coder>
  void codePlain(Coder& coder, std::byte* bytes, std::size_t count);

 private:
  template <class Coder>
  void codeEnds(Coder& coder, const ActiveRows& rows, std::byte* ends);
  template <class Coder>
  void codeCoarse(Coder& coder, std::byte* bytes);
  template <class Coder>
  void codeWide(Coder& coder, std::byte* bytes);

  Bc7Model bc7_;
  std::array<BitModel, kEncodingCount> regular_;
  std::array<SymbolModel, 8> ends_;
  ClassBits endBits_;
  std::array<SymbolModel, 4> coarse_;
  ClassBits coarseBits_;
  std::array<SymbolModel, 2> wide_;
  ClassBits wideBits_;
  std::array<ByteModel, 2> plain_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_BRICK_MODEL_H
