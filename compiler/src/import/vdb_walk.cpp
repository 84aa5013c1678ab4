#include "import/vdb_walk.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <set>
#include <vector>

#include "billow/format/children.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using Origin = std::array<std::int32_t, 3>;

constexpr std::uint32_t kCompressZip = 1, kCompressMask = 2, kCompressBlosc = 4;

// What OpenVDB's mask compression says of a node's inactive values (one byte before the values).
enum Inactive : std::uint8_t {
  kOneValue = 2,
  kMaskNoValue = 3,
  kMaskOneValue = 4,
  kMaskTwoValues = 5,
  kAllValues = 6,
};

std::uint32_t countOn(const std::vector<std::uint64_t>& words) {
  int count = 0;
  for (const std::uint64_t word : words) count += std::popcount(word);
  return static_cast<std::uint32_t>(count);
}

class Walker {
 public:
  Walker(ByteReader& reader, const VdbGrid& grid) : reader_(reader), grid_(grid) {}

  // Returns the number of leaves.
  std::size_t walkTopology() {
    if (reader_.value<std::uint32_t>("the number of buffers") != 1) reader_.fail("a tree with other than one buffer");
    readRoot();
    return activeCounts_.size();
  }
  void walk() {
    walkTopology();
    for (std::size_t i = 0; i < activeCounts_.size(); ++i) readLeafBuffer(i);
  }

 private:
  void readRoot() {
    readBackground();
    const auto tiles = reader_.value<std::uint32_t>("the number of root tiles");
    const auto children = reader_.value<std::uint32_t>("the number of root children");
    for (std::uint32_t i = 0; i < tiles; ++i) {
      readRootOrigin();
      readBackground();
      if (reader_.value<std::uint8_t>("a root tile") > 1) reader_.fail("a root tile is neither active nor inactive");
    }
    for (std::uint32_t i = 0; i < children; ++i) readInternal(readRootOrigin(), 5, 7);
  }

  void readBackground() {
    if (grid_.type->bits) {
      if (reader_.value<std::uint8_t>("a value") > 1) reader_.fail("a bool is neither 0 nor 1");
    } else {
      reader_.skip(grid_.type->valueBytes, "a value");
    }
  }

  Origin readRootOrigin() {
    const auto origin = reader_.value<Origin>("a root entry's origin");
    for (const std::int32_t coordinate : origin) {
      if (coordinate % 4096 != 0) reader_.fail("a root entry's origin is no multiple of 4096");
    }
    if (!rootOrigins_.insert(origin).second) reader_.fail("two root entries at the same place");
    return origin;
  }

  std::vector<std::uint64_t> readMask(std::uint32_t bits) {
    std::vector<std::uint64_t> words(bits / 64);
    reader_.read(words.data(), words.size() * 8, "a node's mask");
    return words;
  }

  // A node of (2^log2)^3 children, each 2^childLog2 voxels wide: 32^3 of 128, or 16^3 of 8.
  void readInternal(const Origin& origin, std::uint32_t log2, std::uint32_t childLog2) {
    const std::uint32_t count = 1u << (3 * log2);
    const auto children = readMask(count);
    const auto values = readMask(count);
    for (std::size_t word = 0; word < children.size(); ++word) {
      if ((children[word] & values[word]) != 0) reader_.fail("a node has a child and an active tile in one place");
    }
    readValues(count, countOn(values));
    for (std::uint32_t word = 0; word < children.size(); ++word) {
      for (std::uint64_t bits = children[word]; bits != 0; bits &= bits - 1) {
        const std::uint32_t index = word * 64 + static_cast<std::uint32_t>(std::countr_zero(bits));
        readChild(childOrigin(origin, index, log2, childLog2), childLog2);
      }
    }
  }

  static Origin childOrigin(const Origin& origin, std::uint32_t index, std::uint32_t log2, std::uint32_t childLog2) {
    const std::array<std::uint32_t, 3> offset = format::childOrigin(index, log2, childLog2);
    Origin child{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      child[axis] = origin[axis] + static_cast<std::int32_t>(offset[axis]);
    }
    return child;
  }

  void readChild(const Origin& origin, std::uint32_t childLog2) {
    if (childLog2 == 7) return readInternal(origin, 4, 3);
    activeCounts_.push_back(static_cast<std::uint16_t>(countOn(readMask(512))));
    if (grid_.type->bits) leafOrigins_.push_back(origin);
  }

  void readLeafBuffer(std::size_t leaf) {
    if (countOn(readMask(512)) != activeCounts_[leaf]) reader_.fail("a leaf's two masks differ");
    if (!grid_.type->bits) return readValues(512, activeCounts_[leaf]);
    if (reader_.value<Origin>("a leaf's origin") != leafOrigins_[leaf]) reader_.fail("a leaf lies in a wrong place");
    if (grid_.type->sourceType == format::SourceType::boolean) readMask(512);
  }

  // The values of a node with `count` values, `active` of them active.
  void readValues(std::uint32_t count, std::uint32_t active) {
    const auto inactive = reader_.value<std::uint8_t>("a node's values");
    if (inactive > kAllValues) reader_.fail(fmt::format("unknown kind {} of inactive values", inactive));
    std::uint64_t extra = 0;
    if (inactive == kOneValue || inactive == kMaskOneValue) extra += grid_.type->valueBytes;
    if (inactive == kMaskTwoValues) extra += 2 * grid_.type->valueBytes;
    if (inactive == kMaskNoValue || inactive == kMaskOneValue || inactive == kMaskTwoValues) extra += count / 8;
    reader_.skip(extra, "a node's inactive values");
    const bool onlyActive = (grid_.compression & kCompressMask) != 0 && inactive != kAllValues;
    readData(onlyActive ? active : count);
  }

  void readData(std::uint32_t count) {
    const bool realHalf = grid_.half && grid_.type->halfBytes != grid_.type->valueBytes;
    if (realHalf && count == 0) return;  // OpenVDB writes not even a size
    const std::uint64_t bytes = std::uint64_t{count} * (realHalf ? grid_.type->halfBytes : grid_.type->valueBytes);
    if ((grid_.compression & (kCompressZip | kCompressBlosc)) == 0) return reader_.skip(bytes, "a node's values");
    const auto stored = reader_.value<std::int64_t>("a compressed block's size");
    if (stored <= 0) {  // not compressible: the bytes as they are
      if (stored != -static_cast<std::int64_t>(bytes)) reader_.fail("a block has another size than its node");
      return reader_.skip(bytes, "a node's values");
    }
    const auto size = static_cast<std::uint64_t>(stored);
    if (size > reader_.remaining()) reader_.skip(size, "a compressed block");
    if ((grid_.compression & kCompressBlosc) != 0) return skipBlosc(reader_, size, bytes);
    reader_.skip(size, "a compressed block");
  }

  ByteReader& reader_;
  const VdbGrid& grid_;
  std::set<Origin> rootOrigins_;
  std::vector<std::uint16_t> activeCounts_;
  std::vector<Origin> leafOrigins_;
};

}  // namespace

// The header: version, codec version, flags, type size; then raw, block and compressed size.
void skipBlosc(ByteReader& reader, std::uint64_t stored, std::uint64_t raw) {
  constexpr std::uint64_t kHeaderBytes = 16;
  if (stored < kHeaderBytes) reader.fail("a compressed block is shorter than its header");
  reader.skip(4, "a compressed block");
  const auto rawSize = reader.value<std::uint32_t>("a compressed block");
  const auto blockSize = reader.value<std::uint32_t>("a compressed block");
  const auto storedSize = reader.value<std::uint32_t>("a compressed block");
  // OpenVDB pads short data before it compresses them.
  constexpr std::uint64_t kPaddedBytes = 128;
  const bool sizeFits = rawSize == raw || (raw < kPaddedBytes && rawSize == kPaddedBytes);
  if (!sizeFits || storedSize != stored || blockSize == 0 || (rawSize != 0 && blockSize > rawSize)) {
    reader.fail("a compressed block's header is wrong");
  }
  reader.skip(stored - kHeaderBytes, "a compressed block");
}

std::size_t walkPointTopology(ByteReader& reader, const VdbGrid& grid) {
  static constexpr VdbType kIndices{"", format::SourceType::int32, 4, 4, 1, false};
  VdbGrid indices = grid;
  indices.type = &kIndices;
  return Walker(reader, indices).walkTopology();
}

void walkTree(ByteReader& reader, const VdbGrid& grid) {
  try {
    Walker(reader, grid).walk();
  } catch (const Error& error) {
    if (error.fault() != Fault::input) throw;
    throw Error(Fault::input,
                fmt::format("{} (in grid '{}')", error.what(), grid.name.empty() ? grid.uniqueName : grid.name));
  }
}

}  // namespace billow::compiler
