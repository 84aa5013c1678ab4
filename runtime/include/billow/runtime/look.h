// A good picture without any options: how dense, how hot and how large a volume is.
#ifndef BILLOW_RUNTIME_LOOK_H
#define BILLOW_RUNTIME_LOOK_H

#include <array>
#include <cstdint>
#include <span>

#include "billow/format/particle.h"
#include "billow/runtime/runtime.h"

namespace billow::runtime {

struct WorldBox {
  std::array<double, 3> min{0, 0, 0};
  std::array<double, 3> max{0, 0, 0};
  bool empty = true;
};

void addBox(const WorldBox& more, WorldBox& box);
// Of the balls that they are; those of radius 0 are not there.
void addParticles(std::span<const format::Particle> particles, WorldBox& box);

// The world box of what is active in frames [first, last] (indices into the volume's frames) of the chosen grids, in
// the scene's world where there is one (MetavoxelVolume::objectToWorld).
WorldBox worldBox(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids,
                  std::uint32_t first, std::uint32_t last,
                  const std::array<double, 12>& objectToWorld = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});

// Replaces what the record sets.
void applyLook(const format::LookRecord& record, Look& look);

// A look for the whole volume, the same for each of its frames: what the pack's look record sets, and for the rest
// values that fit the data. Reads one frame (the one with the most active voxels).
Result<Look> suggestLook(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_LOOK_H
