// Any bytes as a mesh: Draco and glTF by how they begin, all else as OBJ. They are refused, or triangles of finite
// places; and these have points, if they have an area.
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "effect/surface_points.h"
#include "mesh/formats.h"
#include "stages.h"

using namespace billow::compiler;

namespace {

TriangleList read(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  if (text.starts_with("DRACO")) return readDraco(bytes, std::nullopt, "mesh.drc");
  if (text.starts_with("glTF") || text.starts_with("{")) return readGltf(bytes, "/nowhere/mesh.gltf");
  return readObj(text, "mesh.obj");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const MeshShape mesh{read({reinterpret_cast<const char*>(data), size}), {1, 1, 1}};
    bool area = false;
    for (const Triangle& triangle : mesh.triangles) {
      for (const Vertex& vertex : triangle) {
        for (const float coordinate : vertex) {
          if (!std::isfinite(coordinate)) std::abort();
        }
      }
      area = area || hasArea(triangle);
    }
    if (area && placePoints(mesh, 64).points.size() != 64) std::abort();
  } catch (const Error& error) {
    if (error.fault() == Fault::internal) std::abort();
  }
  return 0;
}
