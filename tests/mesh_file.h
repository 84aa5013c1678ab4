// Small meshes in every format, for tests.
#ifndef BILLOW_TESTS_MESH_FILE_H
#define BILLOW_TESTS_MESH_FILE_H

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "mesh/mesh.h"

namespace billow::tests {

// A folder that goes away with its files.
class MeshFolder {
 public:
  MeshFolder() : path_(std::filesystem::temp_directory_path() / ("billow_mesh_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  MeshFolder(const MeshFolder&) = delete;
  MeshFolder& operator=(const MeshFolder&) = delete;
  ~MeshFolder() { std::filesystem::remove_all(path_); }

  std::string write(const std::string& name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

// From -1 to 1 along each axis, its faces to the outside.
inline constexpr std::string_view kCubeObj =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";

// The same as 36 corners.
inline std::vector<compiler::Vertex> cubeCorners() {
  constexpr std::array<std::array<int, 4>, 6> kFaces{
      {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 4, 7, 3}, {1, 2, 6, 5}}};
  constexpr std::array<compiler::Vertex, 8> kVertices{
      {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}};
  std::vector<compiler::Vertex> corners;
  for (const auto& face : kFaces) {
    for (const std::size_t i : {0u, 1u, 2u, 0u, 2u, 3u})
      corners.push_back(kVertices[static_cast<std::size_t>(face[i])]);
  }
  return corners;
}

// As Draco codes it; `speed` 10 is sequential, 0 Edgebreaker.
inline std::string dracoOf(const std::vector<compiler::Vertex>& corners, int speed) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(corners.size() / 3));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (std::uint32_t f = 0; f < corners.size() / 3; ++f) {
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(f), corners[f * 3].data(), corners[f * 3 + 1].data(),
                                      corners[f * 3 + 2].data());
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetSpeedOptions(speed, speed);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  encoder.SetEncodingMethod(speed == 10 ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*mesh, &buffer).ok()) throw std::runtime_error("Draco");
  return {buffer.data(), buffer.size()};
}

// One mesh of these corners, in a buffer of its own.
inline nlohmann::json gltfOf(std::size_t corners, const std::string& uri) {
  nlohmann::json document = nlohmann::json::parse(R"({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3"}], "bufferViews": [{"buffer": 0}]})");
  document["accessors"][0]["count"] = corners;
  document["bufferViews"][0]["byteLength"] = corners * 12;
  document["buffers"] = {{{"byteLength", corners * 12}}};
  if (!uri.empty()) document["buffers"][0]["uri"] = uri;
  return document;
}

inline std::string bytesOf(const std::vector<compiler::Vertex>& corners) {
  return {reinterpret_cast<const char*>(corners.data()), corners.size() * sizeof(compiler::Vertex)};
}

// A binary container of the two chunks.
inline std::string glbOf(std::string text, std::string binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4);
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&number), sizeof number);
  };
  return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_MESH_FILE_H
