#include "brick_model.h"

namespace billow::format::page_coder {
namespace {

std::uint32_t byteAt(const std::byte* bytes, std::size_t at) {
  return std::to_integer<std::uint32_t>(bytes[at]);
}

// The first local cell of a row of voxels; the others follow, two voxels each.
constexpr std::uint32_t cellOfRow(std::uint32_t row) {
  return (row >> 5) << 3 | (row >> 2 & 1) << 2;
}

std::array<bool, kLocalCells> cellsInUse(const ActiveRows& rows) {
  std::array<bool, kLocalCells> used{};
  for (std::uint32_t row = 0; row < rows.size(); ++row) {
    for (std::uint32_t cell = 0; cell < 4; ++cell) used[cellOfRow(row) | cell] |= (rows[row] >> (2 * cell) & 3) != 0;
  }
  return used;
}

// Whether inactive voxels have index 0 and cells without active voxels the ends 0: then they need no bits.
bool isRegular(std::uint32_t encoding, const ActiveRows& active, const std::byte* payload) {
  const std::uint32_t bits = indexBits(encoding);
  const std::byte* indices = payload + endBytes(encoding);
  for (std::uint32_t row = 0; row < active.size(); ++row) {
    if (active[row] == 0xff) continue;
    std::uint64_t packed = 0;
    std::memcpy(&packed, indices + row * bits, bits);
    for (std::uint32_t z = 0; z < 8; ++z) {
      if ((active[row] >> z & 1) == 0 && (packed >> (z * bits) & ((1u << bits) - 1)) != 0) return false;
    }
  }
  if (!isLocal(encoding)) return true;
  const auto cells = cellsInUse(active);
  for (std::uint32_t cell = 0; cell < kLocalCells; ++cell) {
    if (!cells[cell] && (byteAt(payload, 2 * cell) | byteAt(payload, 2 * cell + 1)) != 0) return false;
  }
  return true;
}

}  // namespace

BrickModel::BrickModel() {
  regular_.fill(bitModel(kScale - 256));
  ends_.fill(evenModel());
  coarse_.fill(evenModel());
  wide_.fill(evenModel());
}

template <class Coder>
bool BrickModel::code(Coder& coder, std::uint32_t encoding, const ActiveRows* mask, std::byte* payload) {
  if (encoding == kEncodingCoarse) {
    codeCoarse(coder, payload);
  } else if (isBc7(encoding)) {
    for (int block = 0; block < 8; ++block) bc7_.code(coder, payload + 16 * block);
  } else if (encoding == kEncodingUniform16) {
    codeWide(coder, payload);
  } else if (mask != nullptr &&
             !coder.bit(regular_[encoding], Coder::kDecodes || isRegular(encoding, *mask, payload))) {
    codePlain(coder, payload, *brickBytes(encoding));
  } else {
    if (isLocal(encoding)) codeEnds(coder, mask != nullptr ? *mask : kAllRows, payload);
    return true;
  }
  return false;
}

// A cell's ends by those of its neighbour that was coded last: along z, else y, else x.
template <class Coder>
void BrickModel::codeEnds(Coder& coder, const ActiveRows& rows, std::byte* ends) {
  const auto used = cellsInUse(rows);
  std::uint32_t known[kLocalCells][2];
  for (std::uint32_t cell = 0; cell < kLocalCells; ++cell) {
    int sum[2] = {0, 0};
    int count = 0;
    const auto take = [&](std::uint32_t other, int weight) {
      if (!used[other]) return;
      for (int end = 0; end < 2; ++end) sum[end] += weight * static_cast<int>(known[other][end]);
      count += weight;
    };
    if ((cell & 3) != 0) take(cell - 1, 2);
    if ((cell & 4) != 0) take(cell - 4, 1);
    if ((cell & 8) != 0) take(cell - 8, 1);
    for (std::uint32_t end = 0; end < 2; ++end) {
      known[cell][end] = 0;
      if (!used[cell]) continue;
      const std::uint32_t guess = count == 0 ? 64 + 128 * end : static_cast<std::uint32_t>(sum[end] / count);
      known[cell][end] = codeDifference(coder, ends_[2 * static_cast<std::uint32_t>(std::min(count, 3)) + end],
                                        endBits_, 8, guess, byteAt(ends, 2 * cell + end));
    }
    if (Coder::kDecodes) {
      for (std::uint32_t end = 0; end < 2; ++end) ends[2 * cell + end] = static_cast<std::byte>(known[cell][end]);
    }
  }
}

// 4x4x4 values, each by the mean of its neighbours before it.
template <class Coder>
void BrickModel::codeCoarse(Coder& coder, std::byte* bytes) {
  for (std::uint32_t i = 0; i < 64; ++i) {
    std::uint32_t sum = 0, count = 0;
    for (const std::uint32_t stride : {1u, 4u, 16u}) {
      if ((i / stride & 3) == 0) continue;
      sum += byteAt(bytes, i - stride);
      ++count;
    }
    const std::uint32_t guess = count == 0 ? 128 : sum / count;
    bytes[i] = static_cast<std::byte>(codeDifference(coder, coarse_[count], coarseBits_, 8, guess, byteAt(bytes, i)));
  }
}

// 16-bit indices: the high byte by the one before it, the low one as it is.
template <class Coder>
void BrickModel::codeWide(Coder& coder, std::byte* bytes) {
  std::uint32_t before = 128;
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    const std::uint32_t low = coder.bits(8, byteAt(bytes, 2 * i));
    const std::uint32_t guess = (i & 7) == 0 && i >= 8 ? byteAt(bytes, 2 * i - 15) : before;
    before = codeDifference(coder, wide_[(i & 7) == 0], wideBits_, 8, guess, byteAt(bytes, 2 * i + 1));
    bytes[2 * i] = static_cast<std::byte>(low);
    bytes[2 * i + 1] = static_cast<std::byte>(before);
  }
}

template <class Coder>
void BrickModel::codePlain(Coder& coder, std::byte* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    bytes[i] = static_cast<std::byte>(plain_[i & 1].code(coder, byteAt(bytes, i)));
  }
}

template bool BrickModel::code(Encoder&, std::uint32_t, const ActiveRows*, std::byte*);
template bool BrickModel::code(Decoder&, std::uint32_t, const ActiveRows*, std::byte*);
template void BrickModel::codePlain(Encoder&, std::byte*, std::size_t);
template void BrickModel::codePlain(Decoder&, std::byte*, std::size_t);

}  // namespace billow::format::page_coder
