#include "page_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "billow/format/bfloat16.h"

namespace billow::format::page_coder {
namespace {

constexpr std::uint32_t kNoClaim = 0xffffffffu;

enum MaskKind : std::uint32_t { kKindAll = 0, kKindTexel = 1, kKindNext = 2, kKindOther = 3 };

std::uint32_t encodingKind(std::uint32_t encoding) {
  if (encoding == kEncodingConstant) return 0;
  return indexBits(encoding) > 0 && !isLocal(encoding) ? 1 : 2;
}

// 0 for what is not finite.
std::uint32_t finiteBfloat16(double value) {
  if (!(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))) return 0;
  return toBfloat16(static_cast<float>(value));
}

std::uint32_t zigzag(std::uint32_t difference) {
  return difference << 1 ^ (0u - (difference >> 31));
}
std::uint32_t unzigzag(std::uint32_t value) {
  return value >> 1 ^ (0u - (value & 1));
}

constexpr bool hasSmallIndices(std::uint32_t encoding) {
  return indexBits(encoding) >= 1 && indexBits(encoding) <= 8;
}

// Which voxels have an index other than 0.
ActiveRows rowsInUse(const std::byte* indices, std::uint32_t bits) {
  ActiveRows rows{};
  for (std::uint32_t row = 0; row < rows.size(); ++row) {
    std::uint64_t packed = 0;
    std::memcpy(&packed, indices + row * bits, bits);
    for (std::uint32_t z = 0; z < 8; ++z) {
      rows[row] = static_cast<std::uint8_t>(rows[row] | ((packed >> (z * bits) & ((1u << bits) - 1)) != 0) << z);
    }
  }
  return rows;
}

std::uint32_t countOf(const ActiveRows& rows) {
  const auto words = std::bit_cast<std::array<std::uint64_t, 8>>(rows);
  std::uint32_t count = 0;
  for (const std::uint64_t word : words) count += static_cast<std::uint32_t>(std::popcount(word));
  return count;
}

// At most 512 * 65535.
std::uint32_t sumOf(const Texels& texels) {
  return std::accumulate(texels.begin(), texels.end(), 0u);
}
std::uint32_t sumOf(Texels& texels, const ActiveRows& rows) {
  for (std::uint32_t row = 0; row < rows.size(); ++row) {
    if (rows[row] == 0xff) continue;
    for (std::uint32_t z = 0; z < 8; ++z) {
      if ((rows[row] >> z & 1) == 0) texels[row << 3 | z] = 0;
    }
  }
  return sumOf(texels);
}

template <class Coder>
float codeFloat(Coder& coder, FloatModel& model, float value) {
  return std::bit_cast<float>(model.code(coder, std::bit_cast<std::uint32_t>(value)));
}

}  // namespace

std::uint64_t bytesOfRuns(PageRuns runs) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < kStreamCount; ++i) bytes += std::uint64_t{runs[i].count} * kStreamItemBytes[i];
  return bytes;
}

PageModel::PageModel(PageRuns runs, std::byte* page) : runs_(runs) {
  for (std::size_t i = 0; i < kStreamCount; ++i) {
    at_[i] = page;
    page += std::size_t{runs[i].count} * kStreamItemBytes[i];
  }
  nextUnit_.fill(bitModel(kScale - 256));
  maskKind_.fill(evenModel());
  tileSame_.fill(bitModel(kScale / 2));
  unitNext_ = run(Stream::unit).first;
  maskNext_ = run(Stream::mask).first;
}

std::byte* PageModel::item(Stream stream, std::uint32_t number) {
  const auto which = static_cast<std::size_t>(stream);
  return at_[which] + std::size_t{number} * kStreamItemBytes[which];
}

template <class Item>
Item PageModel::load(Stream stream, std::uint32_t number) {
  Item value;
  std::memcpy(&value, item(stream, number), sizeof value);
  return value;
}

template <class Item>
void PageModel::store(Stream stream, std::uint32_t number, const Item& value) {
  std::memcpy(item(stream, number), &value, sizeof value);
}

template <class Coder>
void PageModel::code(Coder& coder) {
  codeNodes3(coder);
  codeMasks(coder);
  codeNodes<Coder, Node5>(coder, Stream::node5, kNode5Log2, node5Masks_);
  codeNodes<Coder, Node4>(coder, Stream::node4, kNode4Log2, node4Masks_);
  claimBricks();
  codeBricks(coder);
  sumTexels();
  codeMeans(coder);
  codeChildren(coder);
}

template <class Coder>
void PageModel::codeNodes3(Coder& coder) {
  for (std::uint32_t i = 0; i < run(Stream::node3).count; ++i) {
    auto node = load<Node3>(Stream::node3, i);
    codeBrickWord(coder, node);
    codeMaskWord(coder, node);
    const std::uint32_t kind = encodingKind(encodingOf(node));
    node.lo = codeFloat(coder, lo_[kind], node.lo);
    node.scale = codeFloat(coder, scale_[kind], node.scale);
    store(Stream::node3, i, node);
  }
}

template <class Coder>
void PageModel::codeBrickWord(Coder& coder, Node3& node) {
  const std::uint32_t encoding = encoding_[encodingBefore_].code(coder, encodingOf(node)) & 31;
  encodingBefore_ = std::min(encoding, kEncodingCount);
  const bool hasUnits = brickUnits(encoding) > 0;
  std::uint32_t unit = hasUnits ? unitNext_ : 0;
  if (!coder.bit(nextUnit_[hasUnits], unitOf(node) == unit)) unit = unit_.code(coder, unitOf(node)) & kBrickUnitMask;
  node.brick = encoding << kEncodingShift | unit;
  if (hasUnits) unitNext_ = (unit + brickUnits(encoding)) & kBrickUnitMask;
}

template <class Coder>
void PageModel::codeMaskWord(Coder& coder, Node3& node) {
  std::uint32_t kind = node.mask == kMaskAll     ? kKindAll
                       : node.mask == kMaskTexel ? kKindTexel
                       : node.mask == maskNext_  ? kKindNext
                                                 : kKindOther;
  SymbolModel& model = maskKind_[encodingKind(encodingOf(node)) * 4 + kindBefore_];
  kind = coder.symbol(model, kind) & 3;
  kindBefore_ = kind;
  if (kind == kKindAll) node.mask = kMaskAll;
  if (kind == kKindTexel) node.mask = kMaskTexel;
  if (kind == kKindNext) node.mask = maskNext_++;
  if (kind == kKindOther) node.mask = maskIndex_.code(coder, node.mask);
}

template <class Coder>
void PageModel::codeMasks(Coder& coder) {
  for (std::uint32_t i = 0; i < run(Stream::mask).count; ++i) {
    auto rows = load<ActiveRows>(Stream::mask, i);  // words are little-endian: byte r is row r
    brickMasks_.code(coder, kNode3Log2, rows.data());
    store(Stream::mask, i, rows);
  }
}

// The first Node3 that names a brick of the page tells its encoding; one whose units another took before tells nothing.
void PageModel::claimBricks() {
  const StreamRange units = run(Stream::unit);
  const std::uint32_t nodes = run(Stream::node3).count;
  claims_.assign(units.count, Claim{kNoClaim, 0});
  std::vector<bool> taken(units.count);
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const auto node = load<Node3>(Stream::node3, i);
    const std::uint32_t size = brickUnits(encodingOf(node));
    const std::uint32_t first = unitOf(node) - units.first;
    if (size == 0 || first >= units.count || units.count - first < size) continue;
    if (std::find(taken.begin() + first, taken.begin() + first + size, true) != taken.begin() + first + size) continue;
    std::fill_n(taken.begin() + first, size, true);
    claims_[first] = {i, encodingOf(node)};
  }
}

const ActiveRows* PageModel::maskOf(const Node3& node) {
  if (node.mask == kMaskAll) return &kAllRows;
  const StreamRange masks = run(Stream::mask);
  if (node.mask - masks.first >= masks.count) return nullptr;
  return reinterpret_cast<const ActiveRows*>(item(Stream::mask, node.mask - masks.first));
}

template <class Coder>
void PageModel::codeBricks(Coder& coder) {
  std::vector<VoxelBrick> voxels;
  for (std::uint32_t unit = 0; unit < run(Stream::unit).count;) {
    const Claim claim = claims_[unit];
    std::byte* payload = item(Stream::unit, unit);
    if (claim.node == kNoClaim) {
      bricks_.codePlain(coder, payload, kBrickUnitBytes);
      ++unit;
      continue;
    }
    const ActiveRows* mask = maskOf(load<Node3>(Stream::node3, claim.node));
    if (bricks_.code(coder, claim.encoding, mask, payload)) {
      const std::uint8_t* rows = mask != nullptr ? mask->data() : nullptr;
      voxels.push_back({payload + endBytes(claim.encoding), rows, indexBits(claim.encoding)});
    }
    unit += brickUnits(claim.encoding);
  }
  voxels_.code(coder, voxels);
}

// Of constants and bricks of the page: how many voxels are active, and the sum of their texels.
void PageModel::sumTexels() {
  const std::uint32_t nodes = run(Stream::node3).count;
  texelSums_.assign(nodes, 0);
  activeCounts_.assign(nodes, 0);
  for (std::uint32_t unit = 0; unit < claims_.size(); ++unit) {
    const Claim claim = claims_[unit];
    if (claim.node == kNoClaim) continue;
    const ActiveRows* mask = maskOf(load<Node3>(Stream::node3, claim.node));
    const std::span payload(item(Stream::unit, unit), *brickBytes(claim.encoding));
    Texels texels;
    decodeTexels(claim.encoding, payload, texels);
    std::uint32_t& count = activeCounts_[claim.node];
    if (mask != nullptr) {
      count = countOf(*mask);
      texelSums_[claim.node] = sumOf(texels, *mask);
    } else if (!hasSmallIndices(claim.encoding)) {
      count = kBrickVoxels;
      texelSums_[claim.node] = sumOf(texels);
    } else if (isLocal(claim.encoding)) {
      const ActiveRows rows = rowsInUse(payload.data() + kLocalCellBytes, indexBits(claim.encoding));
      count = countOf(rows);
      texelSums_[claim.node] = sumOf(texels, rows);
    } else {
      count = static_cast<std::uint32_t>(kBrickVoxels - std::count(texels.begin(), texels.end(), 0));
      texelSums_[claim.node] = sumOf(texels);
    }
  }
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const auto node = load<Node3>(Stream::node3, i);
    if (encodingOf(node) != kEncodingConstant) continue;
    const ActiveRows* mask = maskOf(node);
    activeCounts_[i] = mask != nullptr ? countOf(*mask) : kBrickVoxels;
  }
}

// The mean that the texels make, if inactive voxels have the tile of the page's first Node4.
template <class Coder>
void PageModel::codeMeans(Coder& coder) {
  double background = 0;
  if (run(Stream::node4).count > 0) background = static_cast<double>(load<Node4>(Stream::node4, 0).tile);
  for (std::uint32_t i = 0; i < run(Stream::node3).count; ++i) {
    auto node = load<Node3>(Stream::node3, i);
    const auto active = static_cast<double>(activeCounts_[i]);
    const double sum = active * static_cast<double>(node.lo) +
                       static_cast<double>(texelSums_[i]) * static_cast<double>(node.scale) +
                       (static_cast<double>(kBrickVoxels) - active) * background;
    const auto bits = std::bit_cast<std::uint32_t>(node.mean);
    const std::uint32_t upper =
        codeDifference(coder, mean_, meanBits_, 16, finiteBfloat16(sum / kBrickVoxels), bits >> 16);
    std::uint32_t lower = 0;
    if (coder.bit(meanRest_, (bits & 0xffff) != 0)) lower = coder.bits(16, bits & 0xffff);
    node.mean = std::bit_cast<float>(upper << 16 | lower);
    store(Stream::node3, i, node);
  }
}

template <class Coder, class Node>
void PageModel::codeNodes(Coder& coder, Stream stream, std::uint32_t sideLog2, MaskModel& masks) {
  constexpr std::uint32_t kWords = sizeof(Node::mask) / 4;
  std::uint32_t begin = run(Stream::child).first;
  std::uint32_t tile = 0;
  for (std::uint32_t i = 0; i < run(stream).count; ++i) {
    auto node = load<Node>(stream, i);
    if (coder.bit(nextBegin_, node.childBegin == begin)) {
      node.childBegin = begin;
    } else {
      node.childBegin = coder.bits(32, node.childBegin);
    }
    node.flags = flags_.code(coder, node.flags);
    const bool same = coder.bit(tileSame_[node.flags & 1], std::bit_cast<std::uint32_t>(node.tile) == tile);
    node.tile = same ? std::bit_cast<float>(tile) : codeFloat(coder, values_[0], node.tile);
    tile = std::bit_cast<std::uint32_t>(node.tile);
    node.min = codeFloat(coder, values_[1], node.min);
    node.max = codeFloat(coder, values_[2], node.max);
    node.mean = codeFloat(coder, values_[3], node.mean);
    if (sideLog2 == kNode5Log2) {
      masks.code(coder, sideLog2, node.mask);
    } else {
      auto rows = std::bit_cast<std::array<std::uint16_t, 2 * kWords>>(node.mask);
      masks.code(coder, sideLog2, rows.data());
      std::memcpy(node.mask, rows.data(), sizeof node.mask);
    }
    begin = node.childBegin;
    for (const std::uint32_t word : node.mask) begin += static_cast<std::uint32_t>(std::popcount(word));
    store(stream, i, node);
  }
}

// Mostly one more than the one before.
template <class Coder>
void PageModel::codeChildren(Coder& coder) {
  std::uint32_t next = run(Stream::node3).first;
  for (std::uint32_t i = 0; i < run(Stream::child).count; ++i) {
    const auto child = load<std::uint32_t>(Stream::child, i);
    const std::uint32_t coded = next + unzigzag(child_.code(coder, zigzag(child - next)));
    store(Stream::child, i, coded);
    next = coded + 1;
  }
}

template void PageModel::code(Encoder&);
template void PageModel::code(Decoder&);

}  // namespace billow::format::page_coder
