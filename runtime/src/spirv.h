// The shaders, compiled at build time (CMakeLists.txt) into arrays of words.
#ifndef BILLOW_RUNTIME_SPIRV_H
#define BILLOW_RUNTIME_SPIRV_H

#include <cstdint>

namespace billow::runtime::spirv {
using std::uint32_t;
#include "march_half.spv.h"
#include "march_single.spv.h"
#include "voxels.spv.h"
}  // namespace billow::runtime::spirv

#endif  // BILLOW_RUNTIME_SPIRV_H
