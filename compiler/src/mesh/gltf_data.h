// What glTF keeps in buffers, by number.
#ifndef BILLOW_COMPILER_MESH_GLTF_DATA_H
#define BILLOW_COMPILER_MESH_GLTF_DATA_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "json/value.h"
#include "mesh/mesh.h"

namespace billow::compiler {

// An accessor's elements; all of them lie within `bytes`.
struct GltfElements {
  std::span<const std::byte> bytes;
  std::size_t count = 0, stride = 0;
  std::int64_t type = 0;  // glTF's componentType
  bool normalized = false;

  // Component `component` of element `index`, which is one of them.
  double at(std::size_t index, std::size_t component) const;
};

class GltfData {
 public:
  // `container`: the binary chunk of a *.glb, else empty. Path and bytes must outlive this.
  GltfData(const json::Value& root, const std::string& path, std::span<const std::byte> container);

  // Their functions throw json::Error where what the value names is not there or not sound.
  GltfElements positions(const json::Value& accessor);
  GltfElements indices(const json::Value& accessor);
  std::span<const std::byte> view(const json::Value& number);

  // The members of a list of the document; none where it is absent.
  static std::vector<json::Value> list(const json::Value& root, std::string_view key);
  // The member that `number` names.
  static const json::Value& member(const std::vector<json::Value>& list, const json::Value& number,
                                   std::string_view name);

 private:
  GltfElements elements(const json::Value& accessor, std::size_t components);
  std::span<const std::byte> buffer(const json::Value& number);
  std::vector<std::byte> load(const json::Value& uri) const;

  const std::string& path_;
  std::span<const std::byte> container_;
  std::vector<json::Value> accessors_, views_, buffers_;
  std::vector<std::vector<std::byte>> loaded_;  // by buffer; empty: not yet
  std::uint64_t loadedBytes_ = 0;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_MESH_GLTF_DATA_H
