// Bit cubes (masks of bricks, children of nodes) in the context of the neighbours that are already known.
// spec/pagecodec.md, "Bit cubes".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_MASK_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_MASK_MODEL_H

#include "models.h"

namespace billow::format::page_coder {

// One for each size of cube. A row is the 2^n bits of equal x and y, bit z of it that of (x, y, z).
class MaskModel {
 public:
  MaskModel() {
    same_.fill(bitModel(kScale * 15 / 16));
    bits_.fill(bitModel(kScale / 2));
    for (std::uint32_t context = 0; context < bits_.size(); ++context) {
      const auto set = static_cast<std::uint32_t>(std::popcount(context & 1023));
      bits_[context] = bitModel(kScale * (1 + set) / 12);
    }
  }

  // `rows[x << n | y]`, each in the low 2^n bits.
  template <class Coder, class Row>
  void code(Coder& coder, std::uint32_t n, Row* rows) {
    const std::uint32_t side = 1u << n;
    for (std::uint32_t x = 0; x < side; ++x) {
      for (std::uint32_t y = 0; y < side; ++y) {
        Row* row = rows + (x << n | y);
        const Row left = y > 0 ? row[-1] : x > 0 ? row[-std::ptrdiff_t{side}] : Row{0};
        const Row behind = x > 0 ? row[-std::ptrdiff_t{side}] : left;
        const Row beside = x > 0 && y + 1 < side ? row[1 - std::ptrdiff_t{side}] : behind;
        const Row corner = x > 0 && y > 0 ? row[-1 - std::ptrdiff_t{side}] : behind;
        *row = static_cast<Row>(
            codeRow(coder, side, Neighbours{left, behind, beside, corner, 2u * (x > 0) + (y > 0)}, *row));
      }
    }
  }

 private:
  struct Neighbours {
    std::uint32_t left, behind, beside, corner;
    std::uint32_t place;
  };

  template <class Coder>
  std::uint32_t codeRow(Coder& coder, std::uint32_t side, const Neighbours& near, std::uint32_t row) {
    const std::uint32_t all = side == 32 ? ~0u : (1u << side) - 1;
    const bool empty = (near.left | near.behind | near.beside | near.corner) == 0;
    const bool full = (near.left & near.behind & near.beside & near.corner) == all;
    if (empty || full) {
      const std::uint32_t expected = full ? all : 0;
      if (coder.bit(same_[near.place << 1 | full], row == expected)) return expected;
    }
    // One bit before the row and one after it, as its ends.
    const auto spread = [&](std::uint32_t bits) {
      return std::uint64_t{bits} << 1 | (bits & 1) | std::uint64_t{bits >> (side - 1)} << (side + 1);
    };
    const std::uint64_t left = spread(near.left);
    const std::uint64_t behind = spread(near.behind);
    std::uint32_t result = 0;
    std::uint32_t before = (near.left & 1) * 3;  // the two bits before z, the nearer in bit 0
    for (std::uint32_t z = 0; z < side; ++z) {
      const auto context = static_cast<std::uint32_t>((left >> z & 7) << 7 | (behind >> z & 7) << 4) |
                           (near.beside >> z & 1) << 3 | (near.corner >> z & 1) << 2 | before;
      const std::uint32_t bit = coder.bit(bits_[near.place << 10 | context], (row >> z & 1) != 0);
      result |= bit << z;
      before = (before << 1 | bit) & 3;
    }
    return result;
  }

  std::array<BitModel, 8> same_;
  std::array<BitModel, 4096> bits_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_MASK_MODEL_H
