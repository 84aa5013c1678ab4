// Points of a mesh's surface, on which particles are born. spec/effects.md is the standard.
#ifndef BILLOW_FORMAT_SURFACE_H
#define BILLOW_FORMAT_SURFACE_H

#include <array>
#include <cstdint>

namespace billow::format {

inline constexpr std::uint32_t kMaxSurfacePoints = 65536;  // of an emitter

// One of the points that divide a surface's area evenly among themselves. All bit patterns are points.
struct SurfacePoint {
  std::int16_t place[3];  // share of the emitter's extent, in 1 / 32767
  std::int8_t normal[2];  // octahedral, in 1 / 127
};
static_assert(sizeof(SurfacePoint) == 8);

// From the shape's middle; within its extent.
std::array<double, 3> placeOf(const SurfacePoint& point, const float (&extent)[3]);
// Of unit length.
std::array<double, 3> normalOf(const SurfacePoint& point);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SURFACE_H
