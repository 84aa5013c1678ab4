// Meshes that descriptions refer to.
#ifndef BILLOW_COMPILER_MESH_MESH_H
#define BILLOW_COMPILER_MESH_MESH_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace billow::compiler {

inline constexpr std::uint64_t kMostMeshBytes = 256u << 20;     // of a mesh's file, and of all its buffers
inline constexpr std::uint64_t kMostMeshTextBytes = 64u << 20;  // of glTF's JSON
inline constexpr std::size_t kMostTriangles = std::size_t{1} << 22;
inline constexpr std::size_t kMostVertices = std::size_t{1} << 22;
inline constexpr std::size_t kMostCorners = 256;  // of a face

using Vertex = std::array<float, 3>;     // finite
using Triangle = std::array<Vertex, 3>;  // counterclockwise where one looks at its outside
using TriangleList = std::vector<Triangle>;

// Twice the vector area: along the outside's normal, and twice as long as the area is large.
std::array<double, 3> areaVector(const std::array<double, 3>& a, const std::array<double, 3>& b,
                                 const std::array<double, 3>& c);

bool hasArea(const Triangle& triangle);

// Reads *.drc (Draco, bitstream 2.2), *.obj, *.gltf or *.glb (2.0, with the scene's transforms applied; skins and
// morphs at rest). Throws Error with the file's name: Fault::file where it or its buffers cannot be read, Fault::input
// where it is broken, too large, of another kind or has no area.
TriangleList readMesh(const std::string& path);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_MESH_MESH_H
