#include "mesh/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "billow/format/source.h"
#include "import/input_notes.h"
#include "mesh/formats.h"
#include "stages.h"

namespace billow::compiler {
namespace {

TriangleList read(const std::string& path, const std::string& extension) {
  const std::vector<std::byte> bytes = readMeshBytes(path, kMostMeshBytes);
  if (extension == ".drc") return readDraco(bytes, std::nullopt, path);
  if (extension == ".obj") return readObj({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path);
  return readGltf(bytes, path);
}

}  // namespace

void failMesh(const std::string& file, const std::string& what) {
  throw Error(Fault::input, fmt::format("{}: {}", file, what));
}

std::vector<std::byte> readMeshBytes(const std::string& path, std::uint64_t limit) {
  noteInput(path);
  const auto source = format::openFileSource(path);
  if (!source) throw Error(Fault::file, fmt::format("{}: cannot be read: {}", path, source.error().detail));
  const std::uint64_t size = (*source)->size();
  if (size > limit) failMesh(path, fmt::format("it has {} bytes; expected at most {}", size, limit));
  std::vector<std::byte> bytes(size);
  if (!(*source)->read(0, bytes)) throw Error(Fault::file, path + ": cannot be read");
  return bytes;
}

void addTriangle(const Triangle& triangle, const std::string& file, TriangleList& into) {
  if (into.size() == kMostTriangles) failMesh(file, fmt::format("it has more than {} triangles", kMostTriangles));
  into.push_back(triangle);
}

std::array<double, 3> areaVector(const std::array<double, 3>& a, const std::array<double, 3>& b,
                                 const std::array<double, 3>& c) {
  std::array<double, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t u = (i + 1) % 3, v = (i + 2) % 3;
    result[i] = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]);
  }
  return result;
}

bool hasArea(const Triangle& triangle) {
  std::array<std::array<double, 3>, 3> corners{};
  for (std::size_t i = 0; i < 3; ++i) std::copy(triangle[i].begin(), triangle[i].end(), corners[i].begin());
  return areaVector(corners[0], corners[1], corners[2]) != std::array<double, 3>{};
}

TriangleList readMesh(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".drc" && extension != ".obj" && extension != ".gltf" && extension != ".glb") {
    failMesh(path, "expected a mesh *.drc, *.obj, *.gltf or *.glb");
  }
  TriangleList triangles = read(path, extension);
  if (std::none_of(triangles.begin(), triangles.end(), hasArea)) {
    failMesh(path, fmt::format("its {} triangles have no area", triangles.size()));
  }
  return triangles;
}

}  // namespace billow::compiler
