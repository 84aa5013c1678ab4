// OpenVDB point grids as particles, written here by OpenVDB itself.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "effect/bake_effect.h"
#include "effect/read.h"
#include "import/points.h"
#include "planned.h"
#include "point_attributes.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using namespace tests;
using openvdb::points::AttributeHandle;
using openvdb::points::AttributeWriteHandle;
using openvdb::points::PointDataGrid;

struct Point {
  std::int64_t id;
  openvdb::Vec3s place;
  float radius;
};

std::vector<Point> cloud(std::size_t count, std::int64_t firstId, std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  const auto number = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() & 0xffffff) / static_cast<float>(0xffffff);
  };
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back({firstId + static_cast<std::int64_t>(i),
                      {number(-3, 5), number(-40, -30), number(0, 1)},
                      static_cast<float>(i % 32) / 16});
  }
  return points;
}

// Attributes in the order in which OpenVDB lays the points out.
template <class Value, class Codec, class Get>
void fill(PointDataGrid& grid, const openvdb::tools::PointIndexGrid& indices, const std::vector<Point>& points,
          const char* name, const Get& get) {
  openvdb::points::appendAttribute<Value, Codec>(grid.tree(), name);
  std::vector<Value> values;
  for (const Point& point : points) values.push_back(get(point));
  const openvdb::points::PointAttributeVector<Value> wrapper(values);
  openvdb::points::populateAttribute<openvdb::points::PointDataTree, openvdb::tools::PointIndexTree,
                                     openvdb::points::PointAttributeVector<Value>>(grid.tree(), indices.tree(), name,
                                                                                   wrapper);
}

template <class PlaceCodec>
PointDataGrid::Ptr pointGrid(const std::vector<Point>& points, const std::string& name, bool attributes = true) {
  openvdb::initialize();
  std::vector<openvdb::Vec3s> places;
  for (const Point& point : points) places.push_back(point.place);
  const openvdb::points::PointAttributeVector<openvdb::Vec3s> wrapper(places);
  auto transform = openvdb::math::Transform::createLinearTransform(0.25);
  transform->postTranslate({1, 2, 3});
  const auto indices = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
  auto grid = openvdb::points::createPointDataGrid<PlaceCodec, PointDataGrid>(*indices, wrapper, *transform);
  grid->setName(name);
  if (!attributes) return grid;
  using openvdb::points::NullCodec;
  fill<std::int64_t, NullCodec>(*grid, *indices, points, "id", [](const Point& p) { return p.id; });
  fill<float, openvdb::points::TruncateCodec>(*grid, *indices, points, "pscale",
                                              [](const Point& p) { return p.radius; });
  fill<double, NullCodec>(*grid, *indices, points, "age", [](const Point& p) { return 0.5 * double(p.radius); });
  fill<std::int32_t, NullCodec>(*grid, *indices, points, "life", [](const Point&) { return 7; });
  fill<openvdb::Vec3s, NullCodec>(*grid, *indices, points, "Cd",
                                  [](const Point& p) { return openvdb::Vec3s(p.radius, 0.5f, 0.25f); });
  openvdb::points::appendGroup(grid->tree(), "some");
  return grid;
}

void write(const std::string& path, const openvdb::GridCPtrVec& grids,
           std::uint32_t compression = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::io::File file(path);
  file.setCompression(compression);
  file.write(grids);
}

// Each point is there under its id, no further from its place than `error`.
void expectCloud(const PointFrame& frame, const std::vector<Point>& points, float error) {
  ASSERT_EQ(frame.places.size(), points.size());
  ASSERT_EQ(frame.ids.size(), points.size());
  ASSERT_EQ(frame.radii.size(), points.size());
  EXPECT_FALSE(frame.ordered);
  std::vector<bool> seen(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto n = static_cast<std::size_t>(frame.ids[i] - points[0].id);
    ASSERT_LT(n, points.size());
    EXPECT_FALSE(seen[n]);
    seen[n] = true;
    for (std::size_t a = 0; a < 3; ++a) ASSERT_NEAR(frame.places[i][a], points[n].place[static_cast<int>(a)], error);
    ASSERT_EQ(frame.radii[i], points[n].radius);
    ASSERT_EQ(frame.ages[i], points[n].radius / 2);
    ASSERT_EQ(frame.lives[i], 7);
    ASSERT_EQ(frame.colours[i], (std::array<float, 3>{points[n].radius, 0.5f, 0.25f}));
  }
}

TEST(VdbPoints, ComeBackFromEveryCompression) {
  const TempFolder folder;
  const std::vector<Point> points = cloud(2000, 5000000000);
  using openvdb::points::FixedPointCodec;
  const auto exact = pointGrid<openvdb::points::NullCodec>(points, "a");
  const auto coarse = pointGrid<FixedPointCodec<true>>(points, "a"),
             fine = pointGrid<FixedPointCodec<false>>(points, "a");
  for (const std::uint32_t compression : {0u, 1u, 2u, 4u, 6u}) {
    write(folder / "p.vdb", {exact}, compression);
    expectCloud(readPoints(folder / "p.vdb", 1, tests::usualAttributes(), 65536), points, 1e-5f);
  }
  write(folder / "p.vdb", {coarse});
  expectCloud(readPoints(folder / "p.vdb", 1, tests::usualAttributes(), 65536), points, 0.25f / 255 + 1e-5f);
  write(folder / "p.vdb", {fine});
  expectCloud(readPoints(folder / "p.vdb", 1, tests::usualAttributes(), 65536), points, 0.25f / 65535 + 1e-5f);
}

TEST(VdbPoints, OfSeveralGridsAllOrTheAskedFor) {
  const TempFolder folder;
  const std::vector<Point> points = cloud(900, 10);
  const std::vector<Point> first(points.begin(), points.begin() + 300), second(points.begin() + 300, points.end());
  auto density = openvdb::FloatGrid::create();
  density->setName("density");
  density->tree().setValue({1, 2, 3}, 4);
  write(folder / "p.vdb", {pointGrid<openvdb::points::NullCodec>(first, "dust"), density,
                           pointGrid<openvdb::points::NullCodec>(second, "sparks")});
  expectCloud(readPoints(folder / "p.vdb", 1, tests::usualAttributes(), 900), points, 1e-5f);
  PointAttributes attributes = tests::usualAttributes();
  attributes.grids = {"sparks"};
  expectCloud(readPoints(folder / "p.vdb", 1, attributes, 900), second, 1e-5f);
  const auto errorOf = [&](std::uint32_t most) {
    try {
      readPoints(folder / "p.vdb", 7, attributes, most);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(has(errorOf(599), "particles in grid 'sparks'; expected at most 599")) << errorOf(599);
  attributes.grids = {"smoke"};
  EXPECT_TRUE(has(errorOf(900), "p.vdb: frame 7: no point grid of that name; there is: 'dust' of type"));
  attributes.grids = {};
  attributes.radius = {{"size"}, true};
  EXPECT_TRUE(has(errorOf(900), "no attribute 'size' of a fitting type; there is: Cd, P, ")) << errorOf(900);
  attributes.radius = {{"Cd"}, true};
  EXPECT_TRUE(has(errorOf(900), "no attribute 'Cd' of a fitting type"));
}

// One file that another program wrote: OpenVDB counts as many points, within the same box.
TEST(VdbPoints, OfARealFile) {
  const char* data = std::getenv("BILLOW_DATA");
  const std::string path = std::string(data == nullptr ? "" : data) + "/edge/type_points.vdb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no test data";
  const PointFrame frame = readPoints(path, 0, tests::usualAttributes(), 1u << 20);
  openvdb::initialize();
  openvdb::io::File file(path);
  file.open(false);
  std::uint64_t count = 0;
  const openvdb::GridPtrVecPtr grids = file.getGrids();
  for (const auto& base : *grids) {
    const auto grid = openvdb::gridPtrCast<PointDataGrid>(base);
    if (grid) count += openvdb::points::pointCount(grid->tree());
  }
  EXPECT_GT(count, 0u);
  EXPECT_EQ(frame.places.size(), count);
  for (const auto& place : frame.places) EXPECT_TRUE(std::isfinite(place[0] + place[1] + place[2]));
}

// A description in the folder over dust_N.vdb.
format::EffectTables tablesOf(const TempFolder& folder) {
  const std::string path = folder / "dust.effect.json";
  std::ofstream(path) << R"({"name": "dust", "duration": 1, "emitters": [{"name": "dust",
      "particles": {"files": "dust_#.vdb", "framesPerSecond": 10, "error": 0.001},
      "primitive": {"kind": "sphere", "density": {"extinction": 2}}}]})";
  const EffectDescription effect = readEffect(path);
  format::PackTables tables;
  bakeEffects({&effect, 1}, tables);
  return tables.effects;
}

TEST(VdbPoints, DriveAnEffectByTheirIds) {
  const TempFolder folder;
  std::vector<Point> points = cloud(500, 1);
  for (int frame = 0; frame < 3; ++frame) {
    std::shuffle(points.begin(), points.end(), std::mt19937(static_cast<std::uint32_t>(frame)));
    std::vector<Point> moved = points;
    for (Point& point : moved) point.place[0] += 0.5f * static_cast<float>(frame);
    write(folder / ("dust_" + std::to_string(frame) + ".vdb"), {pointGrid<openvdb::points::NullCodec>(moved, "a")});
  }
  const format::EffectTables tables = tablesOf(folder);
  ASSERT_EQ(tables.given.size(), 500u);
  const auto particles = format::particlesAt(tables, 0, 0.15);
  ASSERT_EQ(particles.size(), 500u);
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.id < b.id; });
  for (std::size_t i = 0; i < 500; ++i) {
    EXPECT_EQ(tables.given[i].id, i + 1);
    EXPECT_NEAR(particles[i].center[0], points[i].place[0] + 0.75f, 0.002f);
    EXPECT_NEAR(particles[i].center[1], points[i].place[1], 0.002f);
    EXPECT_NEAR(particles[i].radius, points[i].radius, 0.002f);
  }
  for (int frame = 0; frame < 3; ++frame) {
    write(folder / ("dust_" + std::to_string(frame) + ".vdb"),
          {pointGrid<openvdb::points::NullCodec>(points, "a", /*attributes=*/false)});
  }
  try {
    tablesOf(folder);
    FAIL();
  } catch (const Error& error) {
    EXPECT_TRUE(has(error.what(), "have no ids")) << error.what();
  }
}

// Damage is refused in a line that names the file, or does not matter.
void readDamaged(const std::string& path) {
  try {
    const PointFrame frame = readPoints(path, 1, tests::usualAttributes(), 4096);
    EXPECT_LE(frame.places.size(), 4096u);
    EXPECT_TRUE(frame.ids.empty() || frame.ids.size() == frame.places.size());
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input) << error.what();
    EXPECT_TRUE(has(error.what(), path)) << error.what();
  }
}

TEST(VdbPoints, DamageDoesNoHarm) {
  const TempFolder folder;
  const std::string path = folder / "damaged.vdb";
  std::mt19937 random(5);
  for (const std::uint32_t compression : {0u, 6u}) {
    write(folder / "p.vdb", {pointGrid<openvdb::points::FixedPointCodec<false>>(cloud(700, 1), "a")}, compression);
    const std::string whole = readFile(folder / "p.vdb");
    for (std::size_t size = 0; size < whole.size(); size += size < 1500 ? 7 : 701) {
      std::ofstream(path, std::ios::binary) << whole.substr(0, size);
      EXPECT_THROW(readPoints(path, 1, tests::usualAttributes(), 4096), Error) << size;
    }
    for (int round = 0; round < 300; ++round) {
      std::string bytes = whole;
      for (std::uint32_t i = 0; i < 1 + random() % 4; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
      std::ofstream(path, std::ios::binary) << bytes;
      readDamaged(path);
    }
  }
}

}  // namespace
}  // namespace billow::compiler
