// A loaded frame read on the CPU as the shaders read it (lookup.glsl, brick.glsl). A read outside of it ends the
// program: so what a loader made of any bytes can be proved to be safe.
#ifndef BILLOW_TESTS_LOADED_FRAME_H
#define BILLOW_TESTS_LOADED_FRAME_H

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <vector>

#include "billow/format/brick.h"
#include "stream/grid_builder.h"
#include "stream/load_frame.h"

namespace billow::tests {

// Stored bytes of the pages that a request needs.
struct ReadPages {
  std::vector<std::vector<std::byte>> bytes;
  std::vector<runtime::StoredPage> pages;

  explicit ReadPages(const runtime::LoadRequest& request) {
    const format::Pack& pack = *request.pack;
    const std::vector<std::uint32_t> numbers = runtime::pagesOf(request);
    for (const std::uint32_t number : numbers) {
      bytes.emplace_back(pack.pages()[number].storedSize);
      const auto place = format::placeOfPage(pack, number);
      if (!place.offset || !pack.source().read(*place.offset, bytes.back())) std::abort();
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) pages.push_back({numbers[i], bytes[i]});
  }
};

class FrameReader {
 public:
  explicit FrameReader(const runtime::LoadedFrame& frame) : frame_(frame) {}

  std::uint32_t word(std::uint64_t byte) const { return load<std::uint32_t>(frame_.buffer, byte); }

  // The record of a cell of 8^3 voxels; 0 is the background.
  std::uint32_t record(const runtime::LoadedGrid& grid, const std::array<std::uint32_t, 3>& cell) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (cell[axis] - grid.cells.min[axis] >= grid.cells.dim[axis]) return 0;
    }
    if (grid.index == runtime::Index::flat) {
      const std::uint32_t entry = flatEntry(grid, cell);
      return entry >= runtime::gpu::kSkip ? 0 : entry;
    }
    const std::uint32_t bit5 = (cell[0] >> 4) << 10 | (cell[1] >> 4) << 5 | cell[2] >> 4;
    const std::uint32_t bit4 = (cell[0] & 15) << 8 | (cell[1] & 15) << 4 | (cell[2] & 15);
    if (grid.index == runtime::Index::dense) {
      const std::uint32_t node = word(grid.table + 4 * bit5);
      return node == 0 ? grid.absent5 : word(grid.node4 + 4 * (std::uint64_t{node - 1} * 4096 + bit4));
    }
    const std::uint32_t node4 = rankedChild(grid.table, 0, 1024, bit5);
    if (node4 == format::kNone) return grid.absent5;
    const std::uint64_t at = grid.node4 + std::uint64_t{node4} * runtime::gpu::kTreeNode4Words * 4;
    const std::uint32_t child = rankedChild(at, 2, 130, bit4);
    return child == format::kNone ? word(at + 4) : word(grid.children + 4 * (std::uint64_t{word(at)} + child));
  }

  // A flat table's entry of a cell within the box.
  std::uint32_t flatEntry(const runtime::LoadedGrid& grid, const std::array<std::uint32_t, 3>& cell) const {
    std::uint64_t entry = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      entry = entry * grid.cells.dim[axis] + (cell[axis] - grid.cells.min[axis]);
    }
    return word(grid.table + 4 * entry);
  }

  float voxel(const runtime::LoadedGrid& grid, std::int64_t x, std::int64_t y, std::int64_t z) const {
    const float background = grid.frame.background;
    if (std::min({x, y, z}) < 0 || std::max({x, y, z}) > 4095) return background;
    const std::array<std::uint32_t, 3> cell{static_cast<std::uint32_t>(x >> 3), static_cast<std::uint32_t>(y >> 3),
                                            static_cast<std::uint32_t>(z >> 3)};
    const std::uint32_t number = record(grid, cell);
    if (number == 0) return background;
    const auto made = load<runtime::GpuRecord>(frame_.buffer, grid.records + 16 * (std::uint64_t{number} - 1));
    return value(grid, made, static_cast<std::uint32_t>(x & 7), static_cast<std::uint32_t>(y & 7),
                 static_cast<std::uint32_t>(z & 7));
  }

 private:
  [[noreturn]] static void outside(const char* what) {
    std::cerr << "a read outside of the " << what << std::endl;
    std::abort();
  }

  template <class T>
  static T load(std::span<const std::byte> bytes, std::uint64_t at) {
    T value;
    if (at > bytes.size() || bytes.size() - at < sizeof value) outside("buffer");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  }

  std::uint32_t rankedChild(std::uint64_t at, std::uint32_t maskAt, std::uint32_t ranksAt, std::uint32_t bit) const {
    const std::uint32_t mask = word(at + 4 * (maskAt + (bit >> 5)));
    const std::uint32_t rank = word(at + 4 * (ranksAt + (bit >> 6))) >> (bit >> 1 & 16) & 0xffff;
    if ((mask >> (bit & 31) & 1) == 0) return format::kNone;
    return rank + static_cast<std::uint32_t>(std::popcount(mask & ((1u << (bit & 31)) - 1)));
  }

  // The bytes of a brick, and the word behind it that a shader reads.
  std::vector<std::byte> brick(std::uint32_t encoding, std::uint32_t slot) const {
    if (format::isBc7(encoding)) return atlasSlot(slot);
    std::vector<std::byte> bytes(*format::brickBytes(encoding));
    const std::uint64_t at = std::uint64_t{slot} * format::kBrickUnitBytes;
    if (at + bytes.size() + 4 > frame_.buffer.size()) outside("buffer");
    std::copy_n(frame_.buffer.begin() + static_cast<std::ptrdiff_t>(at), bytes.size(), bytes.begin());
    return bytes;
  }

  std::vector<std::byte> atlasSlot(std::uint32_t slot) const {
    const runtime::AtlasShape& shape = frame_.shape;
    if (slot >= shape.slots() || frame_.atlas.size() != shape.bytes()) outside("atlas");
    const std::uint32_t x = slot & ((1u << shape.xBits) - 1), y = slot >> shape.xBits & ((1u << shape.yBits) - 1);
    const std::uint32_t z = slot >> (shape.xBits + shape.yBits);
    std::vector<std::byte> bytes;
    for (std::uint64_t row = 0; row < 4; ++row) {  // of 32 bytes: two blocks
      const std::uint64_t slice = z * 2 + row / 2, line = (slice * 2 << shape.yBits) + y * 2 + row % 2;
      const auto from = frame_.atlas.subspan(((line << shape.xBits) + x) * 32, 32);
      bytes.insert(bytes.end(), from.begin(), from.end());
    }
    return bytes;
  }

  float value(const runtime::LoadedGrid& grid, const runtime::GpuRecord& record, std::uint32_t x, std::uint32_t y,
              std::uint32_t z) const {
    const std::uint32_t encoding = record.brick >> format::kEncodingShift, voxel = format::voxelIndex(x, y, z);
    const std::vector<std::byte> bytes = brick(encoding, record.brick & format::kBrickUnitMask);
    bool active = true;
    if (record.mask == format::kMaskTexel) active = format::decodeIndex(encoding, bytes, voxel) != 0;
    if (record.mask < format::kMaskTexel) {
      active = (word(grid.masks + 64 * std::uint64_t{record.mask} + 4 * (voxel >> 5)) >> (voxel & 31) & 1) != 0;
    }
    if (!active) return grid.frame.background;
    return format::reconstruct(record.lo, record.scale, format::decodeTexel(encoding, bytes, x, y, z));
  }

  const runtime::LoadedFrame& frame_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_LOADED_FRAME_H
