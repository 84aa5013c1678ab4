// Displacement maps.
#ifndef BILLOW_COMPILER_EFFECT_NOISE_MAP_H
#define BILLOW_COMPILER_EFFECT_NOISE_MAP_H

#include <vector>

#include "billow/format/cube_map.h"
#include "effect/description.h"

namespace billow::compiler {

// The values of a map's largest level, face by face, row by row, before any of them is rounded.
using MapValues = std::vector<float>;
// Of all maps, which together fill [0, 1]; what the two functions below encode.
std::vector<MapValues> noiseValues(const NoiseMap& map);
MapValues pictureValues(const Image& picture);

// `map.frames` maps, whose values together fill [0, 1]. The same bytes for any thread count.
std::vector<format::CubeMap> makeNoiseMaps(const NoiseMap& map);

// From a picture of all directions: longitude along its width, from -Z over -X, +Z and +X back to -Z, and +Y at the
// top. The red values, stretched to [0, 1].
format::CubeMap makePictureMap(const Image& picture);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_NOISE_MAP_H
