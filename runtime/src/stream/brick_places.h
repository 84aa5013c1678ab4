// Gives bricks places in the frame's buffer or in its atlas, and copies them there. What is equal in the pack (same
// units) gets one place, whichever grid asks.
#ifndef BILLOW_RUNTIME_STREAM_BRICK_PLACES_H
#define BILLOW_RUNTIME_STREAM_BRICK_PLACES_H

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stream/load_plan.h"

namespace billow::runtime {

// BC7 bricks lie in the atlas, one a slot. All others lie in the buffer as they lie on disk, one after another, whose
// slots are units of kBrickUnitBytes; the shader decodes them. Where BC7 does not stay, such bricks are decoded to
// eight bits a voxel and lie there too.
class BrickPlaces {
 public:
  // `words`: one for each unit of the pages.
  BrickPlaces(const LoadPlan& plan, std::span<std::uint32_t> words, std::span<std::byte> buffer,
              std::span<std::byte> atlas);

  // The record's brick word, encoding on the GPU << kEncodingShift | slot, of a brick that is not constant, by its
  // bytes and the number of its first unit. nullopt where there are more than the plan has room for, or where its units
  // are in part those of another brick.
  std::optional<std::uint32_t> place(std::uint32_t encoding, const std::byte* bytes, std::uint32_t unit);

  // Room in the buffer for a brick that the caller writes, and its brick word; null where there is none.
  std::byte* take(std::uint32_t encoding, std::uint32_t& word);

  // Copies what is still due, and clears the slots of the atlas that nothing is in.
  void finish();

  std::uint64_t unitsUsed() const { return units_; }
  std::uint32_t blocksUsed() const { return blocks_; }
  std::uint32_t bricksUsed() const { return bricks_; }  // in the buffer

 private:
  std::optional<std::uint32_t> placeBlocks(std::uint32_t encoding, const std::byte* bytes, std::uint32_t& word);
  void copy(std::byte* to, const std::byte* from, std::size_t bytes);
  void flush();

  const LoadPlan& plan_;
  std::span<std::uint32_t> words_;  // brick words by the first unit, 0 where there is none
  std::span<std::byte> room_;       // for bricks in the buffer
  std::span<std::byte> atlas_;
  std::uint64_t units_ = 0;
  std::uint32_t blocks_ = 0, bricks_ = 0;
  // A run of bricks that follow one another on both sides is copied at once.
  std::byte* to_ = nullptr;
  const std::byte* from_ = nullptr;
  std::size_t due_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_BRICK_PLACES_H
