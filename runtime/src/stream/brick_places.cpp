#include "stream/brick_places.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "billow/format/brick.h"

namespace billow::runtime {

BrickPlaces::BrickPlaces(const LoadPlan& plan, std::span<std::uint32_t> words, std::span<std::byte> buffer,
                         std::span<std::byte> atlas)
    : plan_(plan),
      words_(words),
      room_(buffer.subspan(plan.bricks.at, plan.bricks.count * format::kBrickUnitBytes)),
      atlas_(atlas) {
  std::fill(words.begin(), words.end(), 0u);
}

std::optional<std::uint32_t> BrickPlaces::place(std::uint32_t encoding, const std::byte* bytes, std::uint32_t unit) {
  if (format::isBc7(encoding)) {
    // In the atlas the same blocks serve all axes; decoded they differ, and a brick of four units has a word for each.
    return placeBlocks(encoding, bytes, words_[plan_.inAtlas ? unit : unit + format::packedAxis(encoding)]);
  }
  std::uint32_t& word = words_[unit];
  if (word != 0) return word >> format::kEncodingShift == encoding ? std::optional(word) : std::nullopt;
  std::byte* const to = take(encoding, word);
  if (to == nullptr) return std::nullopt;
  copy(to, bytes, std::size_t{format::brickUnits(encoding)} * format::kBrickUnitBytes);
  return word;
}

std::optional<std::uint32_t> BrickPlaces::placeBlocks(std::uint32_t encoding, const std::byte* bytes,
                                                      std::uint32_t& word) {
  const std::uint32_t stored = plan_.inAtlas ? format::kEncodingBc7Z : format::kEncodingUniform8;
  if (word != 0 && word >> format::kEncodingShift != stored) return std::nullopt;
  if (!plan_.inAtlas) {
    if (word != 0) return word;
    std::byte* const to = take(stored, word);
    if (to == nullptr) return std::nullopt;
    format::Texels texels;
    format::decodeTexels(encoding, {bytes, kAtlasSlotBytes}, texels);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) to[i] = static_cast<std::byte>(texels[i]);
    return word;
  }
  if (word == 0) {
    if (blocks_ == plan_.shape.slots()) return std::nullopt;
    word = stored << format::kEncodingShift | blocks_;
    writeSlot(plan_.shape, blocks_++, std::span<const std::byte, kAtlasSlotBytes>(bytes, kAtlasSlotBytes), atlas_);
  }
  return encoding << format::kEncodingShift | (word & format::kBrickUnitMask);
}

std::byte* BrickPlaces::take(std::uint32_t encoding, std::uint32_t& word) {
  const std::uint32_t units = format::brickUnits(encoding);
  if (units > plan_.bricks.count - units_) return nullptr;
  const std::uint64_t slot = plan_.bricks.at / format::kBrickUnitBytes + units_;
  word = encoding << format::kEncodingShift | static_cast<std::uint32_t>(slot);
  std::byte* const to = room_.data() + units_ * format::kBrickUnitBytes;
  units_ += units;
  ++bricks_;
  return to;
}

void BrickPlaces::copy(std::byte* to, const std::byte* from, std::size_t bytes) {
  if (to != to_ + due_ || from != from_ + due_) {
    flush();
    to_ = to;
    from_ = from;
  }
  due_ += bytes;
}

void BrickPlaces::flush() {
  if (due_ != 0) std::memcpy(to_, from_, due_);
  due_ = 0;
}

void BrickPlaces::finish() {
  flush();
  constexpr std::array<std::byte, kAtlasSlotBytes> kEmpty{};
  if (!plan_.inAtlas) return;
  for (std::uint64_t slot = blocks_; slot < plan_.shape.slots(); ++slot) {
    writeSlot(plan_.shape, static_cast<std::uint32_t>(slot), kEmpty, atlas_);
  }
}

}  // namespace billow::runtime
