// Displacement maps from noise.
#ifndef BILLOW_COMPILER_EFFECT_NOISE_MAP_H
#define BILLOW_COMPILER_EFFECT_NOISE_MAP_H

#include <vector>

#include "billow/format/cube_map.h"
#include "effect/description.h"

namespace billow::compiler {

// `map.frames` maps, whose values together fill [0, 1]. The same bytes for any thread count.
std::vector<format::CubeMap> makeNoiseMaps(const NoiseMap& map);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_NOISE_MAP_H
