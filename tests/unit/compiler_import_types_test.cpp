// Import of every grid type, tile level and transform, from files that OpenVDB writes here.
#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "import/vdb_write.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using openvdb::Coord;
using tests::TempFolder;

struct Imported {
  Plan plan;
  ImportedFrame frame;
  std::vector<std::string> warnings;
  std::string error;
  const ImportedGrid& grid(const std::string& name) const {
    for (std::size_t i = 0; i < plan.volumes.at(0).grids.size(); ++i) {
      if (plan.volumes[0].grids[i].name == name) return frame.grids.at(i);
    }
    throw std::runtime_error("no grid " + name + " (" + error + ")");
  }
};

Imported importGrids(const openvdb::GridPtrVec& grids, const ImportOptions& options = {}) {
  openvdb::initialize();
  const TempFolder folder;
  openvdb::io::File file(folder / "a.vdb");
  file.write(grids);
  file.close();
  Imported result;
  const Warn warn = [&](const std::string& text) { result.warnings.push_back(text); };
  try {
    result.plan = planInputs({folder / "a.vdb"}, options, warn);
    result.frame = importFrame(result.plan.volumes[0], result.plan.volumes[0].frames[0], options, warn);
  } catch (const Error& error) {
    result.error = error.what();
  }
  return result;
}

template <class GridT>
typename GridT::Ptr makeGrid(const std::string& name, typename GridT::ValueType background = {}) {
  auto grid = GridT::create(background);
  grid->setName(name);
  return grid;
}

// The value at a source index: of an active voxel or tile, else nullopt.
std::optional<float> activeAt(const ImportedGrid& grid, const Coord& at) {
  for (const Leaf& leaf : grid.leaves) {
    const Coord local = at - Coord(leaf.origin[0], leaf.origin[1], leaf.origin[2]);
    if (!openvdb::CoordBBox::createCube(Coord(0), 8).isInside(local)) continue;
    const std::uint32_t index =
        format::voxelIndex(static_cast<std::uint32_t>(local.x()), static_cast<std::uint32_t>(local.y()),
                           static_cast<std::uint32_t>(local.z()));
    return format::maskBit(leaf.active, index) ? std::optional(leaf.values[index]) : std::nullopt;
  }
  for (const Tile& tile : grid.tiles) {
    const Coord origin(tile.origin[0], tile.origin[1], tile.origin[2]);
    if (openvdb::CoordBBox::createCube(origin, static_cast<std::int32_t>(tile.dim)).isInside(at)) return tile.value;
  }
  return std::nullopt;
}

const Coord kAt(-5, 6, 1007);

template <class GridT>
openvdb::GridBase::Ptr oneValue(const std::string& name, const typename GridT::ValueType& value) {
  auto grid = makeGrid<GridT>(name);
  grid->tree().setValueOn(kAt, value);
  return grid;
}

TEST(ImportTypes, EveryScalarTypeBecomesFloat) {
  const Imported imported =
      importGrids({oneValue<openvdb::FloatGrid>("f", 0.5f), oneValue<openvdb::DoubleGrid>("d", 0.1),
                   oneValue<openvdb::Int32Grid>("i", -7), oneValue<openvdb::Int64Grid>("l", 1ll << 40),
                   oneValue<openvdb::BoolGrid>("b", true), oneValue<openvdb::MaskGrid>("m", true)});
  const std::pair<const char*, float> expected[] = {{"f", 0.5f},    {"d", 0.1f}, {"i", -7},
                                                    {"l", 0x1p40f}, {"b", 1},    {"m", 1}};
  for (const auto& [name, value] : expected) {
    EXPECT_EQ(activeAt(imported.grid(name), kAt), value) << name;
    EXPECT_EQ(imported.grid(name).activeVoxels, 1u) << name;
  }
  EXPECT_EQ(imported.grid("i").min, -7);
  EXPECT_EQ(imported.grid("i").max, 0);  // the background counts
  using format::SourceType;
  const SourceType types[] = {SourceType::boolean, SourceType::float64, SourceType::float32,
                              SourceType::int32,   SourceType::int64,   SourceType::mask};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(imported.plan.volumes[0].grids[i].sourceType, types[i]) << i;
}

TEST(ImportTypes, EveryVectorTypeBecomesThreeGrids) {
  const Imported imported =
      importGrids({oneValue<openvdb::Vec3SGrid>("s", {1, -2, 3}), oneValue<openvdb::Vec3DGrid>("d", {1, -2, 3}),
                   oneValue<openvdb::Vec3IGrid>("i", {1, -2, 3})});
  for (const char* name : {"s", "d", "i"}) {
    EXPECT_EQ(activeAt(imported.grid(std::string(name) + ".x"), kAt), 1) << name;
    EXPECT_EQ(activeAt(imported.grid(std::string(name) + ".y"), kAt), -2) << name;
    EXPECT_EQ(activeAt(imported.grid(std::string(name) + ".z"), kAt), 3) << name;
  }
}

TEST(ImportTypes, HalfIsReadAndNamed) {
  auto scalar = makeGrid<openvdb::FloatGrid>("f");
  scalar->tree().setValueOn(kAt, 0.25f);
  scalar->setSaveFloatAsHalf(true);
  auto vector = makeGrid<openvdb::Vec3SGrid>("v");
  vector->tree().setValueOn(kAt, openvdb::Vec3s(1, 2, -0.5f));
  vector->setSaveFloatAsHalf(true);
  const Imported imported = importGrids({scalar, vector});
  EXPECT_EQ(activeAt(imported.grid("f"), kAt), 0.25f);
  EXPECT_EQ(activeAt(imported.grid("v.z"), kAt), -0.5f);
  EXPECT_EQ(imported.plan.volumes[0].grids[0].sourceType, format::SourceType::float16);
}

TEST(ImportTypes, UnsupportedGridsAreNamedAndSkipped) {
  auto points = openvdb::points::PointDataGrid::create();
  points->setName("points");
  const Imported imported = importGrids({points, oneValue<openvdb::FloatGrid>("density", 1)});
  ASSERT_EQ(imported.warnings.size(), 1u);
  EXPECT_NE(imported.warnings[0].find("'points'"), std::string::npos);
  EXPECT_EQ(activeAt(imported.grid("density"), kAt), 1);
}

TEST(ImportTrees, TilesStayTilesAtEveryLevel) {
  auto grid = makeGrid<openvdb::FloatGrid>("density");
  grid->tree().addTile(3, Coord(4096, 0, 0), 3, true);
  grid->tree().addTile(2, Coord(-128, 0, 0), 2, true);
  grid->tree().addTile(1, Coord(8, 0, 0), 1, true);
  grid->tree().addTile(2, Coord(-256, 0, 0), 9, false);  // inactive: not there
  const Imported imported = importGrids({grid});
  const ImportedGrid& result = imported.grid("density");
  ASSERT_EQ(result.tiles.size(), 3u) << imported.error;
  EXPECT_EQ(result.tiles[0].dim, 128u);
  EXPECT_EQ(result.tiles[1].dim, 8u);
  EXPECT_EQ(result.tiles[2].dim, 4096u);
  EXPECT_EQ(result.tiles[2].value, 3);
  EXPECT_TRUE(result.leaves.empty());
  EXPECT_EQ(result.activeVoxels, (1ull << 36) + (1ull << 21) + 512);
}

TEST(ImportTrees, LeavesAreSortedAndInactiveValuesAreTheBackground) {
  auto grid = makeGrid<openvdb::FloatGrid>("density", 0.5f);
  for (const Coord& at : {Coord(300, 0, 0), Coord(-300, 0, 0), Coord(0, 200, 0), Coord(0, -200, 0)}) {
    grid->tree().setValueOn(at, 2);
    grid->tree().setValueOff(at + Coord(0, 0, 1), 77);
  }
  grid->tree().setValueOff(Coord(0, 0, 500), 1);  // a leaf without an active voxel
  const Imported imported = importGrids({grid});
  const ImportedGrid& result = imported.grid("density");
  ASSERT_EQ(result.leaves.size(), 4u);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(result.leaves[i - 1].origin, result.leaves[i].origin);
  for (const Leaf& leaf : result.leaves) {
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      EXPECT_EQ(leaf.values[v], format::maskBit(leaf.active, v) ? 2.0f : 0.5f);
    }
  }
  EXPECT_EQ(result.background, 0.5f);
  EXPECT_EQ(result.min, 0.5f);
  EXPECT_EQ(result.max, 2.0f);
}

TEST(ImportTrees, InstancesShareTheirTree) {
  auto first = makeGrid<openvdb::FloatGrid>("a");
  first->tree().setValueOn(kAt, 4);
  const openvdb::FloatGrid::Ptr second = openvdb::FloatGrid::create(first->treePtr());
  second->setName("b");
  second->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  const Imported imported = importGrids({first, second});
  EXPECT_EQ(activeAt(imported.grid("a"), kAt), 4) << imported.error;
  EXPECT_EQ(activeAt(imported.grid("b"), kAt), 4);
  EXPECT_EQ(imported.grid("a").indexToWorld[0], 1);
  EXPECT_EQ(imported.grid("b").indexToWorld[0], 0.5);
}

TEST(ImportTransform, AnyAffineOneIsTaken) {
  auto grid = makeGrid<openvdb::FloatGrid>("density");
  grid->tree().setValueOn(kAt, 1);
  auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  transform->preRotate(0.3, openvdb::math::X_AXIS);
  transform->preShear(0.2, openvdb::math::X_AXIS, openvdb::math::Y_AXIS);
  transform->postTranslate(openvdb::Vec3d(1, 2, 3));
  grid->setTransform(transform);
  const Imported imported = importGrids({grid});
  const auto& m = imported.grid("density").indexToWorld;
  const openvdb::Vec3d index(3, -4, 5), world = transform->indexToWorld(index);
  for (std::size_t row = 0; row < 3; ++row) {
    const double* r = &m[row * 4];
    EXPECT_NEAR(r[0] * index[0] + r[1] * index[1] + r[2] * index[2] + r[3], world[static_cast<int>(row)], 1e-12);
  }
}

// OpenVDB makes no such grid, but reads it: 2^-20 a voxel, where the file that it wrote had 2^-10.
TEST(ImportTransform, TinyVoxelsAreTaken) {
  openvdb::initialize();
  auto grid = makeGrid<openvdb::FloatGrid>("density");
  grid->tree().setValueOn(kAt, 1);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(std::exp2(-10)));
  const TempFolder folder;
  openvdb::io::File file(folder / "a.vdb");
  file.write({grid});
  file.close();
  std::string bytes = tests::readFile(folder / "a.vdb");
  const auto three = [](double value) {
    std::string text;
    for (int i = 0; i < 3; ++i) text.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return text;
  };
  const std::size_t at = bytes.find(three(std::exp2(-10)));
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 24, three(std::exp2(-20)));
  std::ofstream(folder / "a.vdb", std::ios::binary) << bytes;
  const Warn ignore = [](const std::string&) {};
  const Plan plan = planInputs({folder / "a.vdb"}, {}, ignore);
  const ImportedFrame frame = importFrame(plan.volumes[0], plan.volumes[0].frames[0], {}, ignore);
  EXPECT_EQ(frame.grids[0].indexToWorld[0], std::exp2(-20));
}

// One line, exit code 2 and no file, rather than a fault of our own.
TEST(WriteVdb, RefusesVoxelsThatOpenVdbDoes) {
  const TempFolder folder;
  ImportedGrid grid;
  grid.indexToWorld = {1e-6, 0, 0, 0, 0, 1e-6, 0, 0, 0, 0, 1e-6, 0};
  const std::vector<VdbOutput> outputs{{"density", true, {&grid}}};
  try {
    writeVdb(folder / "a.vdb", outputs);
    FAIL() << "written";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::file);
    EXPECT_NE(std::string(error.what()).find("too small for OpenVDB"), std::string::npos) << error.what();
  }
  EXPECT_EQ(folder.fileCount(), 0u);
}

TEST(ImportTransform, FrustumIsRefused) {
  auto grid = makeGrid<openvdb::FloatGrid>("density");
  grid->tree().setValueOn(Coord(1, 1, 1), 1);
  grid->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {10, 10, 10}), 0.5, 10));
  EXPECT_NE(importGrids({grid}).error.find("frustum"), std::string::npos);
}

TEST(ImportValues, NonFiniteOnesAreFoundWhereTheyCount) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  auto grid = makeGrid<openvdb::FloatGrid>("density");
  grid->tree().setValueOn(Coord(20, 0, 0), infinity);
  grid->tree().setValueOn(Coord(10, 0, 3), nan);
  grid->tree().setValueOn(Coord(10, 0, 4), 2);
  grid->tree().setValueOff(Coord(0, 0, 0), nan);  // inactive: nobody's
  const std::string error = importGrids({grid}).error;
  for (const char* text : {"a.vdb", "frame 0", "'density'", "2 active", "(10, 0, 3)", "nan", "--non-finite zero"}) {
    EXPECT_NE(error.find(text), std::string::npos) << text << "\n" << error;
  }
  ImportOptions options;
  options.nonFinite = NonFinite::zero;
  const Imported zeroed = importGrids({grid}, options);
  EXPECT_EQ(activeAt(zeroed.grid("density"), Coord(10, 0, 3)), 0);
  EXPECT_EQ(activeAt(zeroed.grid("density"), Coord(10, 0, 4)), 2);
  EXPECT_EQ(zeroed.grid("density").max, 2);
}

TEST(ImportValues, NonFiniteTilesAndBackgroundsAreFound) {
  const float infinity = std::numeric_limits<float>::infinity();
  auto tile = makeGrid<openvdb::FloatGrid>("density");
  tile->tree().addTile(2, Coord(128, 0, 0), infinity, true);
  EXPECT_NE(importGrids({tile}).error.find("(128, 0, 0)"), std::string::npos);
  auto background = makeGrid<openvdb::FloatGrid>("density", infinity);
  EXPECT_NE(importGrids({background}).error.find("background"), std::string::npos);
}

TEST(ImportValues, TooLargeForFloatSkipsTheGrid) {
  const Imported imported =
      importGrids({oneValue<openvdb::DoubleGrid>("big", -1e38), oneValue<openvdb::FloatGrid>("density", 1)});
  EXPECT_FALSE(imported.grid("big").present);
  EXPECT_TRUE(imported.grid("density").present);
  ASSERT_EQ(imported.warnings.size(), 1u);
  EXPECT_NE(imported.warnings[0].find("-1e+38"), std::string::npos) << imported.warnings[0];
  EXPECT_NE(importGrids({oneValue<openvdb::DoubleGrid>("big", 1e300)}).error.find("no grids"), std::string::npos);
}

TEST(ImportValues, DenormalsBecomeZeroWithAWarning) {
  const Imported imported = importGrids({oneValue<openvdb::FloatGrid>("density", 1e-40f)});
  EXPECT_EQ(activeAt(imported.grid("density"), kAt), 0);
  EXPECT_EQ(imported.warnings.size(), 1u);
}

TEST(ImportValues, RoundingThatShowsIsToldWithItsVoxel) {
  auto grid = makeGrid<openvdb::Int32Grid>("id", 1 << 30);
  grid->tree().setValueOn(kAt, (1 << 30) + 128);
  grid->tree().setValueOn(Coord(3, 4, 5), (1 << 30) + 33);
  const Imported imported = importGrids({grid});
  ASSERT_EQ(imported.warnings.size(), 1u);
  EXPECT_NE(imported.warnings[0].find("1 values are rounded to single precision, by 33 at most, at index (3, 4, 5)"),
            std::string::npos)
      << imported.warnings[0];
  auto fine = makeGrid<openvdb::DoubleGrid>("density");
  fine->tree().setValueOn(kAt, 0.1);
  EXPECT_TRUE(importGrids({fine}).warnings.empty());
}

TEST(ImportLevelSets, AreRefusedOrConverted) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(20, openvdb::Vec3f(0), 1);
  sphere->setName("surface");
  EXPECT_NE(importGrids({sphere}).error.find("--sdf-to-fog"), std::string::npos);
  ImportOptions options;
  options.sdfToFog = true;
  const Imported fog = importGrids({sphere}, options);
  const ImportedGrid& grid = fog.grid("surface");
  EXPECT_EQ(activeAt(grid, Coord(0, 0, 0)), 1);
  EXPECT_EQ(activeAt(grid, Coord(40, 0, 0)), std::nullopt);
  EXPECT_EQ(grid.min, 0);
  EXPECT_EQ(grid.max, 1);
}

}  // namespace
}  // namespace billow::compiler
