// From a pack back to grids in the source's index space: what `extract` writes and `compare` measures.
#ifndef BILLOW_COMMAND_RECONSTRUCT_H
#define BILLOW_COMMAND_RECONSTRUCT_H

#include <string>
#include <vector>

#include "billow/format/grid_view.h"
#include "billow/format/pack.h"
#include "stages.h"

namespace billow::command {

// Leaves and tiles with the values that the GPU reconstructs, origins in source index space, where a tile need not be
// aligned to its size. `indexToWorld` takes source indices too.
compiler::ImportedGrid reconstruct(const format::GridView& view);

// The volume with this name; "" takes the only one. Throws compiler::Error(commandLine) listing what there is.
const format::VolumeRecord& findVolume(const format::Pack& pack, const std::string& name);

// The index of frame `number` in the volume's frames, or -1.
std::ptrdiff_t findFrame(const format::Pack& pack, const format::VolumeRecord& volume, std::int32_t number);

// The index of the grid with this name in the volume's grids, or -1.
std::ptrdiff_t findGrid(const format::Pack& pack, const format::VolumeRecord& volume, const std::string& name);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RECONSTRUCT_H
