// Emitters on meshes: where their particles are born, and which way they go.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "billow/format/noise.h"
#include "effect/surface_points.h"
#include "effect_document.h"
#include "mesh/formats.h"
#include "mesh_file.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::bake;
using tests::MeshFolder;
using tests::readDocument;
using tests::smallest;
using Vec3 = std::array<double, 3>;

// A square of two units in the plane z = 0, its left half of 2 triangles, its right half of 2 * 20 * 20.
TriangleList unevenSquare() {
  TriangleList triangles;
  const auto add = [&](float x, float y, float width, float height) {
    triangles.push_back({{{x, y, 0}, {x + width, y, 0}, {x + width, y + height, 0}}});
    triangles.push_back({{{x, y, 0}, {x + width, y + height, 0}, {x, y + height, 0}}});
  };
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const float x = static_cast<float>(i) / 20, y = static_cast<float>(j) / 10 - 1;
      if (i == 10 && j == 10) add(-1, -1, 1, 2);
      add(x, y, 0.05f, 0.1f);
    }
  }
  return triangles;
}

// 8 x 8 cells of equal area must get equally many points; the bound is that of chi squared at one in a thousand.
TEST(EffectMesh, PointsAreUniformOverTheArea) {
  const Surface surface = placePoints({unevenSquare(), {1, 1, 1}}, 16384);
  std::array<double, 64> counts{};
  for (const format::SurfacePoint& point : surface.points) {
    const auto cell = [&](std::size_t axis) {
      return std::min<std::size_t>(static_cast<std::size_t>((point.place[axis] / 32767.0 + 1) * 4), 7);
    };
    ++counts[cell(0) * 8 + cell(1)];
    EXPECT_EQ(point.place[2], 0);
  }
  double squares = 0;
  for (const double count : counts) squares += (count - 256) * (count - 256) / 256;
  EXPECT_LT(squares, 103.4);
  EXPECT_EQ(surface.halfSides, (std::array<float, 3>{1, 1, 0}));
}

// What is scaled is the mesh before its area is measured: sides of 2 x 4, 2 x 10 and 4 x 10.
TEST(EffectMesh, PointsLieOnTheSurfaceWithNormalsOutward) {
  const Surface surface = placePoints({readObj(tests::kCubeObj, "cube.obj"), {1, 2, 5}}, 6800);
  std::array<int, 3> counts{};
  std::array<int, 2> signs{};
  for (const format::SurfacePoint& point : surface.points) {
    const Vec3 normal = format::normalOf(point);
    std::size_t axis = 0;
    while (axis < 2 && std::abs(normal[axis]) < 0.5) ++axis;
    ASSERT_EQ(std::abs(point.place[axis]), 32767);
    ++counts[axis];
    ++signs[point.place[axis] > 0 ? 1 : 0];
    EXPECT_NEAR(normal[axis], point.place[axis] > 0 ? 1 : -1, 1e-9);
  }
  EXPECT_NEAR(counts[0], 4000, 4);
  EXPECT_NEAR(counts[1], 2000, 4);
  EXPECT_NEAR(counts[2], 800, 4);
  EXPECT_NEAR(signs[0], signs[1], 8);
}

// Random slopes come back within a degree.
TEST(EffectMesh, NormalsKeepTheirDirection) {
  double worst = 1;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    Triangle triangle{};
    for (std::uint32_t k = 0; k < 9; ++k)
      triangle[k / 3][k % 3] = format::unitOf(format::hashInteger(i * 9 + k)) - 0.5f;
    Vec3 normal = areaVector(
        {static_cast<double>(triangle[0][0]), static_cast<double>(triangle[0][1]), static_cast<double>(triangle[0][2])},
        {static_cast<double>(triangle[1][0]), static_cast<double>(triangle[1][1]), static_cast<double>(triangle[1][2])},
        {static_cast<double>(triangle[2][0]), static_cast<double>(triangle[2][1]),
         static_cast<double>(triangle[2][2])});
    const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const Vec3 stored = format::normalOf(placePoints({{triangle}, {1, 1, 1}}, 1).points[0]);
    worst = std::min(worst, (normal[0] * stored[0] + normal[1] * stored[1] + normal[2] * stored[2]) / length);
  }
  EXPECT_GT(worst, std::cos(0.0175));
}

json onMesh(const std::string& file) {
  json document = smallest();
  document["emitters"][0]["shape"] = {{"type", "mesh"}, {"file", file}};
  return document;
}

TEST(EffectMesh, ParticlesAreBornOnItAndGoOutward) {
  const MeshFolder folder;
  std::string moved(tests::kCubeObj);
  for (std::size_t at = 0; (at = moved.find("v -1", at)) != std::string::npos; at += 3) moved.replace(at, 4, "v 3");
  for (std::size_t at = 0; (at = moved.find("v 1", at)) != std::string::npos; at += 3) moved.replace(at, 3, "v 5");
  json document = onMesh(folder.write("cube.obj", moved));  // x from 3 to 5
  json& emitter = document["emitters"][0];
  emitter["shape"]["scale"] = 2;
  emitter["position"] = {0, 100, 0};
  emitter.erase("rate");
  emitter["bursts"] = {{{"time", 0}, {"count", 3000}}};
  emitter["velocity"] = {{"direction", "normal"}, {"speed", 3}};
  const format::EffectTables tables = bake(document).effects;
  const auto begin = format::particlesAt(tables, 0, 0), later = format::particlesAt(tables, 0, 0.25);
  ASSERT_EQ(begin.size(), 3000u);
  std::array<int, 6> sides{};
  for (std::size_t i = 0; i < 3000; ++i) {
    const auto offset = [&](const format::Particle& p, std::size_t axis) {
      return static_cast<double>(p.center[axis]) - Vec3{8, 100, 0}[axis];
    };
    int on = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (std::abs(std::abs(offset(begin[i], axis)) - 2) > 1e-4) continue;
      ++on;
      ++sides[axis * 2 + (offset(begin[i], axis) > 0 ? 1 : 0)];
    }
    ASSERT_GE(on, 1);
    double farther = 0, square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = offset(later[i], axis) - offset(begin[i], axis);
      farther += step * offset(begin[i], axis);
      square += step * step;
    }
    EXPECT_NEAR(square, 0.75 * 0.75, 1e-3);
    EXPECT_NEAR(farther, 2 * 0.75, 1e-3);  // along the side's axis, away from the middle
  }
  for (const int side : sides) EXPECT_NEAR(side, 500, 90);  // four deviations
}

TEST(EffectMesh, PointsAreAsManyAsTheirParticlesNeedAndStoredOnce) {
  const MeshFolder folder;
  json document = onMesh(folder.write("cube.obj", tests::kCubeObj));
  document["emitters"][0]["position"] = json::parse("[[0, [0, 0, 0]], [2, [4, 0, 0]]]");
  document["emitters"].push_back(document["emitters"][0]);
  document["emitters"][1]["name"] = "more";
  document["emitters"].push_back(document["emitters"][0]);
  document["emitters"][2]["name"] = "many";
  document["emitters"][2]["rate"] = 1000;
  const format::EffectTables tables = bake(document).effects;
  EXPECT_EQ(tables.emitters[0].pointCount, 1024u);
  EXPECT_EQ(tables.emitters[1].firstPoint, 0u);
  EXPECT_EQ(tables.emitters[2].firstPoint, 1024u);
  EXPECT_EQ(tables.emitters[2].pointCount, 2000u * 4);
  EXPECT_EQ(tables.surfacePoints.size(), 1024u + 2000 * 4);
  EXPECT_NE(tables.emitters[0].positionRow, format::kNoRow);
  EXPECT_EQ(pointsFor(1u << 20), format::kMaxSurfacePoints);
}

// Another compiler, machine or build must give the same.
TEST(EffectMesh, TheSameBitsEverywhere) {
  TriangleList mesh = unevenSquare();
  for (Triangle& triangle : mesh) {
    for (Vertex& v : triangle) v[2] = v[0] * v[1] / 3;
  }
  const Surface surface = placePoints({mesh, {1, 1.7, 0.3}}, 4096);
  EXPECT_EQ(XXH3_64bits(surface.points.data(), surface.points.size() * sizeof(format::SurfacePoint)),
            16262032065240024378u);
}

TEST(EffectMesh, WhatIsRefused) {
  const MeshFolder folder;
  const std::string cube = folder.write("cube.obj", tests::kCubeObj);
  const struct {
    const char* pointer;
    json value;
    std::string expected;
  } faults[] = {{"/shape/file", "/nowhere/rock.obj", "/nowhere/rock.obj: cannot be read"},
                {"/shape/file", folder.write("rock.obj", "v 0 0 zero"), "rock.obj: line 1: a coordinate is \"zero\""},
                {"/shape/file", "rock.stl", "rock.stl: expected a mesh *.drc, *.obj, *.gltf or *.glb"},
                {"/shape/file", 7, "emitters[0].shape.file is 7"},
                {"/shape/scale", 0, "emitters[0].shape.scale is 0"},
                {"/shape/scale", {1, 2}, "emitters[0].shape.scale is [1,2]"},
                {"/shape/scale", {1, -2, 1}, "emitters[0].shape.scale[1] is -2"},
                {"/shape/file", folder.write("far.obj", "v 2e6 0 0\nv 2e6 1 0\nv 2e6 0 1\nf 1 2 3"),
                 "expected a mesh within 1000000 of its origin; it goes to 2000000"},
                {"/position", {0, 1e6, 0}, ""},
                {"/shape/radius", 1, "radius"},
                {"/velocity",
                 {{"speed", 1}, {"direction", "up"}},
                 "emitters[0].velocity.direction is \"up\"; expected three numbers, or \"normal\""}};
  ASSERT_NO_THROW(bake(onMesh(cube)));
  for (const auto& fault : faults) {
    json document = onMesh(cube);
    document["emitters"][0][json::json_pointer(fault.pointer)] = fault.value;
    try {
      bake(document);
      EXPECT_TRUE(fault.expected.empty()) << fault.pointer << " " << fault.value << " passed";
    } catch (const Error& error) {
      ASSERT_FALSE(fault.expected.empty()) << error.what();
      EXPECT_NE(std::string(error.what()).find(fault.expected), std::string::npos) << error.what();
    }
  }
  json document = onMesh(folder.write("far.obj", "v 9e5 0 0\nv 9e5 1 0\nv 9e5 0 1\nf 1 2 3"));
  document["emitters"][0]["position"] = {9e5, 0, 0};
  try {
    bake(document);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("emitters[0].position: its mesh's middle would be at 1800000"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace billow
