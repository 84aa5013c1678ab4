// The formats of meshes, each from bytes of which nothing is trusted. `file` is a name for messages. They throw
// Error(Fault::input).
#ifndef BILLOW_COMPILER_MESH_FORMATS_H
#define BILLOW_COMPILER_MESH_FORMATS_H

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh.h"

namespace billow::compiler {

[[noreturn]] void failMesh(const std::string& file, const std::string& what);

// A plain file of at most `limit` bytes. Throws Error(Fault::file), or Fault::input where it has more.
std::vector<std::byte> readMeshBytes(const std::string& path, std::uint64_t limit);

// Appends, up to kMostTriangles; vertices must be finite.
void addTriangle(const Triangle& triangle, const std::string& file, TriangleList& into);

// Positions and faces; all else is passed over.
TriangleList readObj(std::string_view text, const std::string& file);

// `position`: the unique id of the attribute; nullopt: that of type POSITION.
TriangleList readDraco(std::span<const std::byte> bytes, std::optional<std::uint32_t> position,
                       const std::string& file);

// JSON, or the binary container. `path` is also where its buffers' relative paths begin: Error(Fault::file) where they
// cannot be read.
TriangleList readGltf(std::span<const std::byte> bytes, const std::string& path);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_MESH_FORMATS_H
