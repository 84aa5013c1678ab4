// Meshes from files: what is read, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "mesh/formats.h"
#include "mesh_file.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::MeshFolder;

struct Measures {
  double area = 0, volume = 0;  // the second above 0 where the outside is outside
};

Measures measure(const TriangleList& triangles) {
  Measures sums;
  for (const Triangle& triangle : triangles) {
    std::array<std::array<double, 3>, 3> c{};
    for (std::size_t i = 0; i < 3; ++i) std::copy(triangle[i].begin(), triangle[i].end(), c[i].begin());
    const auto twice = areaVector(c[0], c[1], c[2]);
    sums.area += std::sqrt(twice[0] * twice[0] + twice[1] * twice[1] + twice[2] * twice[2]) / 2;
    sums.volume += (c[0][0] * twice[0] + c[0][1] * twice[1] + c[0][2] * twice[2]) / 6;
  }
  return sums;
}

void expectCube(const TriangleList& triangles, double scale = 1) {
  EXPECT_EQ(triangles.size(), 12u);
  EXPECT_NEAR(measure(triangles).area, 24 * scale * scale, 0.01);
  EXPECT_NEAR(measure(triangles).volume, 8 * scale * scale * scale, 0.01);
}

// ---- What is read

TEST(Mesh, ObjFacesOfAnyCorners) {
  const MeshFolder folder;
  expectCube(readMesh(folder.write("cube.obj", tests::kCubeObj)));
  // Numbers from the end, with texture coordinates and normals, a line continued, Windows' ends of lines.
  expectCube(readMesh(folder.write("cube.obj",
                                   "mtllib /dev/zero\r\nv -1 -1 -1\r\nv 1 -1 -1 0.5 1 1\r\nv 1 +1 -1\r\n"
                                   "v -1 1e0 -1\nv -1 -1 1 # five\nvn 0 0 what\nv 1 -1 1\nv 1 1 1\n"
                                   "v -1 1 1\ng all\nf 4/1/2 3//1 \\\r\n 2/7 -8\nf -4 -3 -2 -1\n"
                                   "f 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6")));
}

// An L, a comb and a ring cut open (corners that coincide), by their areas; a fan would give more.
TEST(Mesh, ConcaveFacesAreCutRight) {
  const struct {
    const char* corners;
    double area;
  } faces[] = {{"0 0 2 0 2 1 1 1 1 3 0 3", 4},
               {"0 0 7 0 7 3 6 3 6 1 5 1 5 3 4 3 4 1 3 1 3 3 2 3 2 1 1 1 1 3 0 3", 15},
               {"0 0 4 0 4 4 0 4 0 0 1 1 1 3 3 3 3 1 1 1", 12}};
  for (const auto& face : faces) {
    for (const bool reversed : {false, true}) {
      std::istringstream numbers(face.corners);
      std::string vertices, corners;
      int count = 0;
      for (double x = 0, y = 0; numbers >> x >> y;) {
        vertices += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(x + y) + "\n";
        corners = reversed ? " " + std::to_string(++count) + corners : corners + " " + std::to_string(++count);
      }
      const std::string text = vertices + "f" + corners;
      const TriangleList triangles = readObj(text, "face.obj");
      EXPECT_EQ(triangles.size(), static_cast<std::size_t>(count) - 2);
      EXPECT_NEAR(measure(triangles).area, face.area * std::sqrt(3.0), 1e-6) << face.corners;
    }
  }
}

TEST(Mesh, DracoInBothEncodings) {
  const MeshFolder folder;
  for (const int speed : {0, 5, 10}) {
    expectCube(readMesh(folder.write("cube.drc", tests::dracoOf(tests::cubeCorners(), speed))));
  }
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : bytes) {
    bits = bits << 8 | static_cast<unsigned char>(c);
    for (count += 8; count >= 6; count -= 6) text += kDigits[bits >> (count - 6) & 63];
  }
  if (count > 0) text += kDigits[bits << (6 - count) & 63];
  return text + std::string((4 - text.size() % 4) % 4, '=');
}

TEST(Mesh, GltfInOneFileOrTwo) {
  const MeshFolder folder;
  const std::string bytes = tests::bytesOf(tests::cubeCorners());
  folder.write("the cube.bin", bytes);
  const std::string embedded = "data:application/octet-stream;base64," + base64(bytes);
  expectCube(readMesh(folder.write("cube.gltf", tests::gltfOf(36, "the%20cube.bin").dump())));
  expectCube(readMesh(folder.write("cube.gltf", tests::gltfOf(36, embedded).dump())));
  expectCube(readMesh(folder.write("cube.glb", tests::glbOf(tests::gltfOf(36, "").dump(), bytes))));
}

TriangleList readGlb(const json& document, const std::string& bytes) {
  const std::string file = tests::glbOf(document.dump(), bytes);
  return readGltf(std::as_bytes(std::span(file)), "/nowhere/test.glb");
}

TEST(Mesh, GltfNodesHaveTransforms) {
  const std::string bytes = tests::bytesOf(tests::cubeCorners());
  json document = tests::gltfOf(36, "");
  // A quarter turn about z takes x to y; the child is mirrored, which keeps the outside outside.
  document["nodes"] = json::parse(R"([{"children": [1], "translation": [10, 20, 30],
                                       "rotation": [0, 0, 0.70710678, 0.70710678]},
                                      {"mesh": 0, "scale": [-2, 1, 3], "translation": [5, 0, 0]},
                                      {"mesh": 0}])");
  const TriangleList triangles = readGlb(document, bytes);
  ASSERT_EQ(triangles.size(), 12u);
  EXPECT_NEAR(measure(triangles).volume, 48, 1e-3);
  Vertex least = triangles[0][0], most = least;
  for (const Triangle& triangle : triangles) {
    for (const Vertex& vertex : triangle) {
      for (std::size_t i = 0; i < 3; ++i) {
        least[i] = std::min(least[i], vertex[i]);
        most[i] = std::max(most[i], vertex[i]);
      }
    }
  }
  const Vertex expectedLeast{9, 23, 27}, expectedMost{11, 27, 33};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(least[i], expectedLeast[i], 1e-4f);
    EXPECT_NEAR(most[i], expectedMost[i], 1e-4f);
  }
  // The same by a matrix, and the other node's mesh in a second scene.
  document["nodes"][0] = json::parse(R"({"children": [1], "matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 10,20,30,1]})");
  EXPECT_NEAR(measure(readGlb(document, bytes)).volume, 48, 1e-3);
  document["scenes"].push_back({{"nodes", {2}}});
  document["scene"] = 1;
  expectCube(readGlb(document, bytes));
  document["scenes"][1]["nodes"] = {2, 0};
  EXPECT_NEAR(measure(readGlb(document, bytes)).volume, 56, 1e-3);
}

TEST(Mesh, GltfIndicesStripsFansAndQuantisedPositions) {
  // A square of four corners, by 16-bit positions that stand for [-1, 1].
  const std::int16_t corners[4][4] = {
      {-32767, -32767, 0, 0}, {32767, -32767, 0, 0}, {-32767, 32767, 0, 0}, {32767, 32767, 0, 0}};
  std::string bytes(reinterpret_cast<const char*>(corners), sizeof corners);
  const std::uint8_t list[] = {0, 1, 2, 2, 1, 3}, strip[] = {0, 1, 2, 3}, fan[] = {0, 1, 3, 2};
  const struct {
    int mode;
    std::string indices;
  } kinds[] = {{4, std::string(std::begin(list), std::end(list))},
               {5, std::string(std::begin(strip), std::end(strip))},
               {6, std::string(std::begin(fan), std::end(fan))}};
  for (const auto& [mode, indices] : kinds) {
    json document = tests::gltfOf(4, "");
    document["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_materials_unlit"};
    document["accessors"][0].update({{"componentType", 5122}, {"normalized", true}});
    document["bufferViews"] = {{{"buffer", 0}, {"byteLength", 32}, {"byteStride", 8}},
                               {{"buffer", 0}, {"byteOffset", 32}, {"byteLength", indices.size()}}};
    document["buffers"][0]["byteLength"] = 32 + indices.size();
    document["accessors"].push_back(
        {{"bufferView", 1}, {"componentType", 5121}, {"type", "SCALAR"}, {"count", indices.size()}});
    document["meshes"][0]["primitives"][0].update({{"mode", mode}, {"indices", 1}});
    const TriangleList triangles = readGlb(document, bytes + indices);
    ASSERT_EQ(triangles.size(), 2u) << mode;
    double up = 0;
    for (const Triangle& t : triangles) {
      const auto at = [&](std::size_t i) {
        return std::array<double, 3>{static_cast<double>(t[i][0]), static_cast<double>(t[i][1]), 0};
      };
      up += areaVector(at(0), at(1), at(2))[2] / 2;
    }
    EXPECT_NEAR(up, 4, 1e-6) << mode;  // both toward z
  }
}

json dracoDocument(std::size_t size) {
  json document = tests::gltfOf(36, "");
  document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  document["accessors"][0].erase("bufferView");
  document["bufferViews"][0]["byteLength"] = document["buffers"][0]["byteLength"] = size;
  document["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
  return document;
}

TEST(Mesh, GltfWithDraco) {
  const std::string bytes = tests::dracoOf(tests::cubeCorners(), 5);
  json document = dracoDocument(bytes.size());
  expectCube(readGlb(document, bytes));
  document["nodes"] = json::parse(R"([{"mesh": 0, "children": [1]}, {"mesh": 0, "scale": [2, 2, 2]}])");
  EXPECT_NEAR(measure(readGlb(document, bytes)).volume, 72, 0.05);
}

// ---- What is refused

// The message of the Error that reading gives.
std::string refusal(const std::string& path, Fault fault = Fault::input) {
  try {
    readMesh(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), fault) << error.what();
    const std::string message = error.what();
    EXPECT_EQ(message.find(path), 0u) << message;
    return message;
  }
  return "nothing was wrong";
}

void expectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in: " << text;
}

TEST(Mesh, MissingOnesAndOtherKinds) {
  const MeshFolder folder;
  expectContains(refusal("/nowhere/rock.obj", Fault::file), "cannot be read");
  expectContains(refusal(folder.write("rock.stl", "solid")), "expected a mesh *.drc, *.obj, *.gltf or *.glb");
  const std::string path = folder.write("large.obj", "");
  std::filesystem::resize_file(path, kMostMeshBytes + 1);
  expectContains(refusal(path), "it has 268435457 bytes; expected at most 268435456");
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  expectContains(refusal(path, Fault::file), "cannot be read");
}

TEST(Mesh, BrokenObjIsRefusedByLine) {
  const MeshFolder folder;
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  std::string corners;
  for (std::size_t i = 0; i <= kMostCorners; ++i) corners += " 1";
  const struct {
    std::string text;
    const char* expected;
  } faults[] = {{"", "its 0 triangles have no area"},
                {triangle + "f 1 2 2", "its 1 triangles have no area"},
                {"v 0 0 0\nv 0 0", "line 2: a coordinate is \"\""},
                {"\\\nv 0 0 \\\n nan", "line 1: a coordinate is \"nan\""},
                {"# a\\\nb\nv 0 0 0x1", "line 3: a coordinate is \"0x1\""},
                {"v 1e39 0 0", "line 1: a coordinate is \"1e39\""},
                {"v 0 inf 0", "a coordinate is \"inf\""},
                {triangle + "f 1 2", "line 4: a face has 2 corners"},
                {triangle + "f 1 2 4", "line 4: a corner is \"4\"; expected the number of one of the 3 vertices"},
                {triangle + "f 1 2 0", "a corner is \"0\""},
                {triangle + "f 1 2 -4", "a corner is \"-4\""},
                {triangle + "f 1 2 99999999999999999999", "a corner is \"99999999999999999999\""},
                {triangle + "f 1 2 x", "a corner is \"x\""},
                {triangle + "f 1 2 3.5", "a corner is \"3.5\""},
                {triangle + "f" + corners, "line 4: a face has more than 256 corners"}};
  for (const auto& fault : faults) expectContains(refusal(folder.write("rock.obj", fault.text)), fault.expected);
}

TEST(Mesh, TooManyAreRefusedByNumber) {
  std::string text;
  for (std::size_t i = 0; i <= kMostVertices; ++i) text += "v 0 0 0\n";
  const MeshFolder folder;
  expectContains(refusal(folder.write("rock.obj", text)), "line 4194305: more than 4194304 vertices");
  text = "v 0 0 0\n";
  for (std::size_t i = 0; i <= kMostTriangles; ++i) text += "f 1 1 1\n";
  expectContains(refusal(folder.write("rock.obj", text)), "it has more than 4194304 triangles");
}

TEST(Mesh, BrokenDracoIsRefused) {
  using namespace std::string_literals;
  const MeshFolder folder;
  const std::string sound = tests::dracoOf(tests::cubeCorners(), 10), tangled = tests::dracoOf(tests::cubeCorners(), 0);
  const std::string header = "DRACO\2\2"s;
  const std::string endless = "\xff\xff\xff\xff\x0f"s;
  const auto changed = [&](std::size_t at, char byte) {
    std::string bytes = sound;
    bytes[at] = byte;
    return bytes;
  };
  const struct {
    std::string bytes;
    const char* expected;
  } faults[] = {{"", "not Draco"},
                {"some text", "not Draco"},
                {sound.substr(0, sound.size() / 2), "a broken Draco mesh"},
                {tangled.substr(0, tangled.size() / 2), "a broken Draco mesh"},
                {changed(7, 0), "a Draco point cloud; expected a mesh"},
                {changed(8, 9), "Draco's encoding 9 is unknown"},
                {changed(6, 1), "expected Draco's bitstream 2.2"},
                {header + "\1\0\0\0"s + endless + endless, "it has 4294967295 triangles or vertices; expected at most"},
                {header + "\1\1\0\0\0\4"s + endless, "it has 4294967295 triangles or vertices; expected at most"}};
  for (const auto& fault : faults) expectContains(refusal(folder.write("rock.drc", fault.bytes)), fault.expected);
  auto corners = tests::cubeCorners();
  std::fill(corners.begin(), corners.end(), corners[0]);
  expectContains(refusal(folder.write("flat.drc", tests::dracoOf(corners, 10))), "no area");
}

TEST(Mesh, BrokenGltfIsRefusedByItsPath) {
  const MeshFolder folder;
  const std::string bytes = tests::bytesOf(tests::cubeCorners());
  const struct {
    const char* pointer;
    const char* value;
    const char* expected;
  } faults[] = {{"/asset/version", "\"1.0\"", "asset.version is \"1.0\"; expected glTF 2.0"},
                {"/extensionsRequired", "[\"EXT_meshopt_compression\"]", "extensionsRequired[0] is \"EXT_meshopt"},
                {"/scene", "1", "scene is 1"},
                {"/scenes/0/nodes/0", "1", "scenes[0].nodes[0] is 1"},
                {"/scenes/0/nodes", "[0, 0]", "scenes[0].nodes[0] is 0; expected a node that is in the scene once"},
                {"/nodes/0/children", "[0]", "nodes[0].children[0] is 0; expected a node that is in the scene once"},
                {"/nodes/0/mesh", "-1", "nodes[0].mesh is -1"},
                {"/nodes/0/rotation", "[0, 0, 0, 0]", "nodes[0].rotation is [0,0,0,0]; expected a quaternion"},
                {"/nodes/0/matrix", "[1, 0]", "nodes[0].matrix"},
                {"/nodes/0/scale", "[1e31, 1, 1]", "nodes[0].scale[0] is 1e+31"},
                {"/meshes/0/primitives/0/mode", "7", "primitives[0].mode is 7"},
                {"/meshes/0/primitives/0/mode", "1", "its 0 triangles have no area"},
                {"/meshes/0/primitives/0/attributes", "{}", "attributes.POSITION is missing"},
                {"/meshes/0/primitives/0/indices", "0", "accessors[0].type is \"VEC3\""},
                {"/accessors/0/sparse", "{}", "accessors[0].sparse"},
                {"/accessors/0/type", "\"VEC2\"", "accessors[0].type is \"VEC2\""},
                {"/accessors/0/componentType", "5124", "accessors[0].componentType is 5124"},
                {"/accessors/0/componentType", "5125", "accessors[0].componentType is 5125"},
                {"/accessors/0/count", "37", "accessors[0].count is 37; expected as many elements as the 432 bytes"},
                {"/accessors/0/count", "1e300", "accessors[0].count"},
                {"/accessors/0/byteOffset", "4", "accessors[0].count is 36"},
                {"/accessors/0/bufferView", "1", "accessors[0].bufferView is 1"},
                {"/bufferViews/0/byteStride", "8", "bufferViews[0].byteStride is 8"},
                {"/bufferViews/0/byteOffset", "4294967296", "expected a range within the 432 bytes of its buffer"},
                {"/bufferViews/0/buffer", "7", "bufferViews[0].buffer is 7"},
                {"/buffers/0/byteLength", "433", "expected no more than the 432 bytes that are there"},
                {"/buffers/0/uri", "\"../cube.bin\"", "expected a path relative to the mesh's folder, and within it"},
                {"/buffers/0/uri", "\"a/%2e%2E/../x\"", "expected a path relative to the mesh's folder"},
                {"/buffers/0/uri", "\"/etc/passwd\"", "expected a path relative to the mesh's folder"},
                {"/buffers/0/uri", "\"http://there/cube.bin\"", "expected a path relative to the mesh's folder"},
                {"/buffers/0/uri", "\"cube%2\"", "two hexadecimal digits after each %"},
                {"/buffers/0/uri", "\"data:,text\"", "base64"},
                {"/buffers/0/uri", "\"data:;base64,A A\"", "base64"},
                {"/buffers/0/uri", "\"data:;base64,AAAA\"", "expected no more than the 3 bytes that are there"}};
  for (const auto& fault : faults) {
    json document = tests::gltfOf(36, "");
    document[json::json_pointer(fault.pointer)] = json::parse(fault.value);
    expectContains(refusal(folder.write("rock.glb", tests::glbOf(document.dump(), bytes))), fault.expected);
  }
  json document = tests::gltfOf(36, "gone.bin");
  try {
    readMesh(folder.write("rock.gltf", document.dump()));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::file);
    expectContains(error.what(), "gone.bin: cannot be read");
  }
}

TEST(Mesh, BrokenContainersAndNumbersOfGltfAreRefused) {
  const MeshFolder folder;
  auto corners = tests::cubeCorners();
  const std::string text = tests::gltfOf(36, "").dump(), sound = tests::glbOf(text, tests::bytesOf(corners));
  expectContains(refusal(folder.write("rock.glb", sound.substr(0, 10))), "expected a binary glTF 2.0");
  expectContains(refusal(folder.write("rock.glb", sound.substr(0, 100))), "it is cut short: 100 bytes of");
  std::string longer = sound;
  longer[12] = longer[13] = '\x7f';
  expectContains(refusal(folder.write("rock.glb", longer)), "it is cut short");
  expectContains(refusal(folder.write("rock.gltf", "{\"asset\": ")), "not JSON");
  expectContains(refusal(folder.write("rock.gltf", std::string(1000, '['))), "lies too deep");
  corners[5][1] = std::numeric_limits<float>::quiet_NaN();
  expectContains(refusal(folder.write("rock.glb", tests::glbOf(text, tests::bytesOf(corners)))),
                 "meshes[0].primitives[0].attributes.POSITION is 0; expected finite positions; one is nan");
  json indexed = tests::gltfOf(36, "");
  indexed["accessors"].push_back({{"bufferView", 0}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", 3}});
  indexed["meshes"][0]["primitives"][0]["indices"] = 1;
  expectContains(refusal(folder.write("rock.glb", tests::glbOf(indexed.dump(), tests::bytesOf(tests::cubeCorners())))),
                 "expected indices below 36; number 0 is 3212836864");
  std::string draco = tests::dracoOf(tests::cubeCorners(), 0);
  draco[20] = static_cast<char>(~draco[20]);
  expectContains(refusal(folder.write("rock.glb", tests::glbOf(dracoDocument(draco.size()).dump(), draco))),
                 "rock.glb: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: ");
}

// A small file must not become a large mesh by being named again and again.
TEST(Mesh, InstancesAreLimited) {
  json document = tests::gltfOf(36, "");
  json& nodes = document["nodes"];
  nodes = json::array();
  json primitives = json::array();
  for (int i = 0; i < 1200; ++i) primitives.push_back(document["meshes"][0]["primitives"][0]);
  document["meshes"][0]["primitives"] = primitives;
  document["scenes"][0]["nodes"] = json::array();
  for (int i = 0; i < 1200; ++i) {
    nodes.push_back({{"mesh", 0}});
    document["scenes"][0]["nodes"].push_back(i);
  }
  const MeshFolder folder;
  const std::string bytes = tests::bytesOf(tests::cubeCorners());
  expectContains(refusal(folder.write("rock.glb", tests::glbOf(document.dump(), bytes))),
                 "it has more than 4194304 triangles");
  for (json& primitive : document["meshes"][0]["primitives"]) primitive["mode"] = 0;
  expectContains(refusal(folder.write("rock.glb", tests::glbOf(document.dump(), bytes))),
                 "at most 1048576 primitives in all");
}

// Bytes changed at random: read or refused, and what is read is finite.
TEST(Mesh, NoBytesDoHarm) {
  const std::string bytes = tests::bytesOf(tests::cubeCorners()), draco = tests::dracoOf(tests::cubeCorners(), 0);
  const std::string sources[] = {std::string(tests::kCubeObj), tests::dracoOf(tests::cubeCorners(), 10), draco,
                                 tests::glbOf(tests::gltfOf(36, "").dump(), bytes),
                                 tests::glbOf(dracoDocument(draco.size()).dump(), draco)};
  std::mt19937 random(5);
  int read = 0;
  for (int round = 0; round < 5000; ++round) {
    const std::size_t kind = static_cast<std::size_t>(round) % std::size(sources);
    std::string changed = sources[kind];
    for (int i = 0; i < 1 + round % 3; ++i) changed[random() % changed.size()] = static_cast<char>(random() & 255);
    if (round % 7 == 0) changed.resize(random() % changed.size());
    const auto span = std::as_bytes(std::span(changed));
    try {
      const TriangleList triangles = kind == 0   ? readObj(changed, "x.obj")
                                     : kind <= 2 ? readDraco(span, std::nullopt, "x.drc")
                                                 : readGltf(span, "/nowhere/x.glb");
      for (const Triangle& triangle : triangles) {
        for (const Vertex& vertex : triangle) ASSERT_TRUE(std::isfinite(vertex[0] + vertex[1] + vertex[2]));
      }
      ++read;
    } catch (const Error& error) {
      ASSERT_NE(std::string(error.what()).find("x."), std::string::npos);
    }
  }
  EXPECT_GT(read, 500);
}

}  // namespace
}  // namespace billow
