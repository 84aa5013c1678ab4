// Records of one grid as the GPU reads them; those of tiles each once.
#ifndef BILLOW_RUNTIME_STREAM_RECORD_TABLE_H
#define BILLOW_RUNTIME_STREAM_RECORD_TABLE_H

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>

#include "billow/format/gpu_size.h"
#include "billow/format/layout.h"

namespace billow::runtime {

// What the GPU reads of a Node3 or of an active tile, in one load. An inactive voxel's value is the grid's background.
struct GpuRecord {
  std::uint32_t brick;  // encoding on the GPU << kEncodingShift | slot
  std::uint32_t mask;   // number of a mask, kMaskAll or kMaskTexel
  float lo;
  float scale;
};
static_assert(sizeof(GpuRecord) == format::kGpuRecordBytes);

class RecordTable {
 public:
  // At most `tiles` of the records are of tiles; `slots` are a power of two, more than `tiles`.
  RecordTable(std::span<GpuRecord> records, std::uint32_t tiles, float background, std::span<std::uint32_t> slots)
      : records_(records), tilesLeft_(tiles), background_(std::bit_cast<std::uint32_t>(background)), slots_(slots) {
    std::fill(slots.begin(), slots.end(), 0u);
  }

  // The number of a new record, from 1 on; 0 where there is no room.
  std::uint32_t add(const GpuRecord& record) {
    if (used_ == records_.size()) return 0;
    records_[used_] = record;
    return ++used_;
  }

  // The number of the tile's record; 0 where the value is the background's, nullopt where there is no room.
  std::optional<std::uint32_t> tile(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits == background_) return 0;
    const auto last = static_cast<std::uint32_t>(slots_.size() - 1);
    std::uint32_t slot = bits * 0x9e3779b1u >> 7 & last;
    while (slots_[slot] != 0 && std::bit_cast<std::uint32_t>(records_[slots_[slot] - 1].lo) != bits) {
      slot = (slot + 1) & last;
    }
    if (slots_[slot] == 0) {
      if (tilesLeft_ == 0) return std::nullopt;
      const std::uint32_t made = add({.brick = 0, .mask = format::kMaskAll, .lo = value, .scale = 0});
      if (made == 0) return std::nullopt;
      --tilesLeft_;
      slots_[slot] = made;
    }
    return slots_[slot];
  }

  std::uint32_t used() const { return used_; }
  std::size_t room() const { return records_.size(); }

 private:
  std::span<GpuRecord> records_;
  std::uint32_t used_ = 0, tilesLeft_;
  std::uint32_t background_;
  std::span<std::uint32_t> slots_;  // records of tiles by their bits, 0 where it is free
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_RECORD_TABLE_H
