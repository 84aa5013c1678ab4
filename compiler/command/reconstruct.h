// From a pack back to grids in the source's index space: what `extract` writes and `compare` measures.
#ifndef BILLOW_COMMAND_RECONSTRUCT_H
#define BILLOW_COMMAND_RECONSTRUCT_H

#include "billow/format/grid_view.h"
#include "stages.h"

namespace billow::command {

// Leaves and tiles with the values that the GPU reconstructs, origins in source index space, where a tile need not be
// aligned to its size. `indexToWorld` takes source indices too.
compiler::ImportedGrid reconstruct(const format::GridView& view);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RECONSTRUCT_H
