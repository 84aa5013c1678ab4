// The shaders, compiled at build time (CMakeLists.txt) into arrays of words.
#ifndef BILLOW_RUNTIME_SPIRV_H
#define BILLOW_RUNTIME_SPIRV_H

#include <cstdint>

namespace billow::runtime::spirv {
using std::uint32_t;
#include "composite_half_half.spv.h"
#include "composite_half_single.spv.h"
#include "composite_single_half.spv.h"
#include "composite_single_single.spv.h"
#include "march_half.spv.h"
#include "march_layers_half.spv.h"
#include "march_layers_single.spv.h"
#include "march_single.spv.h"
#include "metavoxel_bin.spv.h"
#include "metavoxel_bin_volume.spv.h"
#include "metavoxel_blocks.spv.h"
#include "metavoxel_clear.spv.h"
#include "metavoxel_compare.spv.h"
#include "metavoxel_fill.spv.h"
#include "metavoxel_fill_volume.spv.h"
#include "metavoxel_finish_half.spv.h"
#include "metavoxel_finish_single.spv.h"
#include "metavoxel_gather.spv.h"
#include "metavoxel_inject.spv.h"
#include "metavoxel_keep.spv.h"
#include "metavoxel_light.spv.h"
#include "metavoxel_march_half.spv.h"
#include "metavoxel_march_single.spv.h"
#include "metavoxel_plan.spv.h"
#include "metavoxel_pyramid.spv.h"
#include "metavoxel_rank.spv.h"
#include "metavoxel_reset.spv.h"
#include "metavoxel_shadow.spv.h"
#include "metavoxel_spare.spv.h"
#include "metavoxel_spawn.spv.h"
#include "metavoxel_sum.spv.h"
#include "voxels.spv.h"
}  // namespace billow::runtime::spirv

#endif  // BILLOW_RUNTIME_SPIRV_H
