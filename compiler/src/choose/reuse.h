// The bricks of the frame written before, as candidates for this frame's: stored already, so they cost nothing.
#ifndef BILLOW_COMPILER_CHOOSE_REUSE_H
#define BILLOW_COMPILER_CHOOSE_REUSE_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "choose/choose.h"

namespace billow::compiler {

// XXH3-128: equal ones are taken for equal content.
using Hash128 = std::array<std::uint64_t, 2>;
Hash128 hashOf(std::span<const std::byte> bytes);

// A leaf's place and content: what the next frame is compared with before anything is tried.
struct LeafKey {
  std::array<std::int32_t, 3> origin;
  Hash128 hash;  // of mask and values
};

// In the order of the grid's leaves.
std::vector<LeafKey> leafKeys(const ImportedGrid& grid);
// By leaf of `now`: whether `before` has the same content at the same place. Both ascend by origin.
std::vector<char> unchangedLeaves(std::span<const LeafKey> before, std::span<const LeafKey> now);

// One grid's bricks as the last frame that was written anew holds them. One frame's payloads of memory.
class FrameBefore {
 public:
  struct Stored {
    std::array<std::int32_t, 3> origin;
    format::Mask3 active;
    ChosenBrick brick;
  };

  void keep(const ImportedGrid& grid, const ChosenGrid& chosen);
  // By leaf: the stored brick at its place with the same mask, or null. Valid until keep().
  std::vector<const ChosenBrick*> candidates(const ImportedGrid& grid) const;

 private:
  std::vector<Stored> bricks_;  // ascending origins
};

// What `stored` spoils where it stands for `leaf`, by the very decoder that readers have. errors: by voxel, 0 where
// inactive.
Fit measureReuse(const ChosenBrick& stored, const Leaf& leaf, float background, format::Values& errors);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_REUSE_H
