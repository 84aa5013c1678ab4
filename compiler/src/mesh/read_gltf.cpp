#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include "json/document.h"
#include "mesh/formats.h"
#include "mesh/gltf_data.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using json::Range;
using json::Value;

constexpr Range kAny{-1e30, 1e30};
constexpr std::size_t kMostPrimitives = std::size_t{1} << 20;  // visited
constexpr std::string_view kDraco = "KHR_draco_mesh_compression";

// Of glTF's modes, those that have a surface.
enum Mode : std::int64_t { triangleList = 4, triangleStrip = 5, triangleFan = 6 };

using Point = std::array<double, 3>;

struct Transform {
  std::array<Point, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // where they go
  Point origin{};

  Point direction(const Point& v) const {
    Point result{};
    for (std::size_t i = 0; i < 3; ++i) result[i] = axes[0][i] * v[0] + axes[1][i] * v[1] + axes[2][i] * v[2];
    return result;
  }
  Point point(const Point& p) const {
    Point result = direction(p);
    for (std::size_t i = 0; i < 3; ++i) result[i] += origin[i];
    return result;
  }
  // What `inner` does, then this.
  Transform after(const Transform& inner) const {
    return {{direction(inner.axes[0]), direction(inner.axes[1]), direction(inner.axes[2])}, point(inner.origin)};
  }
  bool mirrors() const {
    const Point cross = areaVector({}, axes[0], axes[1]);
    return cross[0] * axes[2][0] + cross[1] * axes[2][1] + cross[2] * axes[2][2] < 0;
  }
};

Transform readTransform(const Value& node) {
  Transform result;
  if (const auto matrix = node.find("matrix")) {
    const auto m = matrix->numbers<16>(kAny);  // by column
    for (std::size_t i = 0; i < 3; ++i) {
      result.axes[i] = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
      result.origin[i] = m[12 + i];
    }
    return result;
  }
  if (const auto translation = node.find("translation")) result.origin = translation->numbers<3>(kAny);
  if (const auto rotation = node.find("rotation")) {
    const auto [x, y, z, w] = rotation->numbers<4>({-1, 1});
    const double square = x * x + y * y + z * z + w * w;
    if (!(std::abs(square - 1) < 0.01)) rotation->fail("a quaternion of length 1");
    const double s = 2 / square;
    result.axes = {{{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
                    {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
                    {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}}};
  }
  if (const auto scale = node.find("scale")) {
    const auto factors = scale->numbers<3>(kAny);
    for (std::size_t i = 0; i < 3; ++i) {
      for (double& component : result.axes[i]) component *= factors[i];
    }
  }
  return result;
}

class GltfReader {
 public:
  GltfReader(const Value& root, const std::string& path, std::span<const std::byte> container)
      : root_(root),
        path_(path),
        data_(root, path, container),
        nodes_(GltfData::list(root, "nodes")),
        meshes_(GltfData::list(root, "meshes")),
        visited_(nodes_.size()) {}

  TriangleList read() {
    checkVersion();
    std::vector<std::pair<Value, Transform>> waiting;  // numbers of nodes, and where their parents are
    for (const Value& number : roots()) waiting.emplace_back(number, Transform{});
    while (!waiting.empty()) {
      const auto [number, parent] = std::move(waiting.back());
      waiting.pop_back();
      const Value& node = GltfData::member(nodes_, number, "nodes");
      const auto index = static_cast<std::size_t>(&node - nodes_.data());
      if (visited_[index]) number.fail("a node that is in the scene once");
      visited_[index] = true;
      const Transform transform = parent.after(readTransform(node));
      if (const auto mesh = node.find("mesh")) addMesh(GltfData::member(meshes_, *mesh, "meshes"), transform);
      for (const Value& child : GltfData::list(node, "children")) waiting.emplace_back(child, transform);
    }
    return std::move(triangles_);
  }

 private:
  void checkVersion() const {
    const Value version = root_.at("asset").at("version");
    if (!version.text("a version").starts_with("2.")) version.fail("glTF 2.0");
    static constexpr std::string_view kHarmless[] = {kDraco, "KHR_mesh_quantization", "KHR_lights_punctual"};
    for (const Value& extension : GltfData::list(root_, "extensionsRequired")) {
      const std::string name = extension.text("an extension's name");
      const bool look = name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_");
      if (look || std::find(std::begin(kHarmless), std::end(kHarmless), name) != std::end(kHarmless)) continue;
      extension.fail("no extension that this reader does not know");
    }
  }

  std::vector<Value> roots() const {
    const std::vector<Value> scenes = GltfData::list(root_, "scenes");
    if (scenes.empty()) root_.fail("\"scenes\": one says which nodes there are");
    const auto chosen = root_.find("scene");
    return GltfData::list(chosen ? GltfData::member(scenes, *chosen, "scenes") : scenes.front(), "nodes");
  }

  void addMesh(const Value& mesh, const Transform& transform) {
    for (const Value& primitive : mesh.at("primitives").items("a list of primitives")) {
      if (++primitives_ > kMostPrimitives) mesh.fail(fmt::format("at most {} primitives in all", kMostPrimitives));
      const auto given = primitive.find("mode");
      const std::int64_t mode = given ? given->integer(0, triangleFan) : triangleList;
      if (mode < triangleList) continue;  // points and lines
      const auto extensions = primitive.find("extensions");
      const auto draco = extensions ? extensions->find(kDraco) : std::nullopt;
      if (draco) {
        addDraco(*draco, transform);
      } else {
        addPrimitive(primitive, mode, transform);
      }
    }
  }

  void addDraco(const Value& draco, const Transform& transform) {
    auto known = decoded_.find(draco.path());
    if (known == decoded_.end()) {
      const std::span<const std::byte> bytes = data_.view(draco.at("bufferView"));
      decodedBytes_ += bytes.size();
      if (decodedBytes_ > kMostMeshBytes) draco.fail(fmt::format("at most {} bytes in all", kMostMeshBytes));
      const Value position = draco.at("attributes").at("POSITION");
      const auto id = static_cast<std::uint32_t>(position.integer(0, 0xffffffff));
      known = decoded_.emplace(draco.path(), readDraco(bytes, id, draco.place())).first;
      decodedTriangles_ += known->second.size();
      if (decodedTriangles_ > kMostTriangles) draco.fail(fmt::format("at most {} triangles in all", kMostTriangles));
    }
    for (const Triangle& triangle : known->second) {
      std::array<Point, 3> corners{};
      for (std::size_t i = 0; i < 3; ++i) std::copy(triangle[i].begin(), triangle[i].end(), corners[i].begin());
      add(corners, transform, draco);
    }
  }

  void addPrimitive(const Value& primitive, std::int64_t mode, const Transform& transform) {
    const Value accessor = primitive.at("attributes").at("POSITION");
    const GltfElements positions = data_.positions(accessor);
    const auto indexed = primitive.find("indices");
    const GltfElements indices = indexed ? data_.indices(*indexed) : GltfElements{};
    const std::size_t count = indexed ? indices.count : positions.count;
    const auto corner = [&](std::size_t i) {
      const std::size_t index = indexed ? static_cast<std::size_t>(indices.at(i, 0)) : i;
      if (index >= positions.count) {
        indexed->fail(fmt::format("indices below {}; number {} is {}", positions.count, i, index));
      }
      return Point{positions.at(index, 0), positions.at(index, 1), positions.at(index, 2)};
    };
    const std::size_t step = mode == triangleList ? 3 : 1;
    for (std::size_t i = 0; i + 2 < count; i += step) {
      const bool odd = mode == triangleStrip && i % 2 == 1;
      add({corner(mode == triangleFan ? 0 : i), corner(i + (odd ? 2 : 1)), corner(i + (odd ? 1 : 2))}, transform,
          accessor);
    }
  }

  void add(std::array<Point, 3> corners, const Transform& transform, const Value& cause) {
    if (transform.mirrors()) std::swap(corners[1], corners[2]);
    Triangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const Point moved = transform.point(corners[i]);
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[i][k] = static_cast<float>(moved[k]);
        if (!std::isfinite(triangle[i][k])) cause.fail(fmt::format("finite positions; one is {}", moved[k]));
      }
    }
    addTriangle(triangle, path_, triangles_);
  }

  Value root_;
  const std::string& path_;
  GltfData data_;
  std::vector<Value> nodes_, meshes_;
  std::vector<bool> visited_;
  std::size_t primitives_ = 0;
  std::map<std::string, TriangleList> decoded_;  // by place in the document
  std::uint64_t decodedBytes_ = 0, decodedTriangles_ = 0;
  TriangleList triangles_;
};

struct Container {
  std::string text;
  std::span<const std::byte> binary;
};

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

bool isContainer(std::span<const std::byte> bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

// Its first chunk is the JSON, a second one the first buffer.
Container openContainer(std::span<const std::byte> bytes, const std::string& path) {
  static constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
  Container result;
  if (!isContainer(bytes)) {
    result.text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return result;
  }
  if (bytes.size() < 20 || wordAt(bytes, 4) != 2 || wordAt(bytes, 16) != kJson) {
    failMesh(path, "expected a binary glTF 2.0");
  }
  const std::uint32_t whole = wordAt(bytes, 8), text = wordAt(bytes, 12);
  if (whole > bytes.size() || whole < 20 || text > whole - 20) {
    failMesh(path, fmt::format("it is cut short: {} bytes of {}", bytes.size(), whole));
  }
  result.text.assign(reinterpret_cast<const char*>(bytes.data()) + 20, text);
  const std::span<const std::byte> rest = bytes.subspan(20 + text, whole - 20 - text);
  if (rest.size() < 8 || wordAt(rest, 4) != kBinary) return result;
  if (wordAt(rest, 0) > rest.size() - 8) failMesh(path, "its binary chunk is cut short");
  result.binary = rest.subspan(8, wordAt(rest, 0));
  return result;
}

}  // namespace

TriangleList readGltf(std::span<const std::byte> bytes, const std::string& path) {
  const Container container = openContainer(bytes, path);
  if (container.text.size() > kMostMeshTextBytes) {
    failMesh(path,
             fmt::format("its JSON has {} bytes; expected at most {}", container.text.size(), kMostMeshTextBytes));
  }
  try {
    const json::Document document(path, container.text);
    return GltfReader(document.root(), path, container.binary).read();
  } catch (const json::Error& error) {
    throw Error(Fault::input, error.what());
  }
}

}  // namespace billow::compiler
