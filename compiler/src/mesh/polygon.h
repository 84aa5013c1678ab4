// Faces of more than three corners.
#ifndef BILLOW_COMPILER_MESH_POLYGON_H
#define BILLOW_COMPILER_MESH_POLYGON_H

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "mesh/mesh.h"

namespace billow::compiler {

// Numbers of the corners of triangles, two fewer than corners, of which there are at least three: ears are cut off one
// after another, so concave faces are right too. Where lines cross there is no right answer, but still an answer.
std::vector<std::array<std::size_t, 3>> cutPolygon(std::span<const Vertex> corners);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_MESH_POLYGON_H
