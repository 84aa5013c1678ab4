// Detail levels: what a coarser grid holds, where it lies, and whether the error that a pack states is the true one.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>

#include "billow/format/grid_view.h"
#include "billow/format/validate.h"
#include "compile.h"
#include "grids.h"
#include "import/vdb_write.h"
#include "level/coarsen.h"
#include "level/level_error.h"

namespace billow::compiler {
namespace {

using Voxel = std::array<std::int32_t, 3>;
using Voxels = std::map<Voxel, float>;  // the active ones

// Plainly, voxel by voxel. For grids without large tiles.
Voxels voxelsOf(const ImportedGrid& grid) {
  Voxels voxels;
  for (const Leaf& leaf : grid.leaves) {
    for (std::int32_t i = 0; i < 512; ++i) {
      if (!format::maskBit(leaf.active, static_cast<std::uint32_t>(i))) continue;
      voxels[{leaf.origin[0] + (i >> 6), leaf.origin[1] + (i >> 3 & 7), leaf.origin[2] + (i & 7)}] =
          leaf.values[static_cast<std::size_t>(i)];
    }
  }
  for (const Tile& tile : grid.tiles) {
    const auto dim = static_cast<std::int32_t>(tile.dim);
    for (std::int32_t i = 0; i < dim * dim * dim; ++i) {
      voxels[{tile.origin[0] + i / (dim * dim), tile.origin[1] + i / dim % dim, tile.origin[2] + i % dim}] = tile.value;
    }
  }
  return voxels;
}

// Leaves and tiles of 8^3 at random on both sides of zero, with random masks.
ImportedGrid randomGrid(std::uint32_t seed, float background) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-1, 3);
  ImportedGrid grid = tests::emptyGrid();
  grid.background = grid.min = grid.max = background;
  grid.indexToWorld = {0.1, 0.02, 0, 5, 0, 0.2, 0.03, -7, 0.01, 0, 0.4, 0.5};
  std::set<Voxel> places;
  while (places.size() < 40) {
    const auto at = [&] { return (static_cast<std::int32_t>(random() % 9) - 5) * 8; };
    places.insert({at(), at(), at()});
  }
  for (const Voxel& origin : places) {
    if (random() % 5 == 0) {
      grid.tiles.push_back({origin, 8, value(random)});
      grid.activeVoxels += 512;
      grid.min = std::min(grid.min, grid.tiles.back().value);
      grid.max = std::max(grid.max, grid.tiles.back().value);
      continue;
    }
    Leaf leaf{};
    leaf.origin = origin;
    leaf.values.fill(background);
    const std::uint32_t share = random() % 8 + 1;
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (random() % 8 >= share && i != 0) continue;
      leaf.active.words[i >> 5] |= 1u << (i & 31);
      leaf.values[i] = value(random);
      grid.min = std::min(grid.min, leaf.values[i]);
      grid.max = std::max(grid.max, leaf.values[i]);
      ++grid.activeVoxels;
    }
    grid.leaves.push_back(leaf);
  }
  return grid;
}

std::int32_t floorDivide(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(std::floor(static_cast<double>(a) / b));
}

TEST(Coarsen, VoxelsAreMeansAndNothingIsLost) {
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const float background = seed % 3 == 0 ? 0.75f : 0;
    const ImportedGrid fine = randomGrid(seed, background);
    const std::uint32_t log2 = seed % 3 + 1;
    const std::int32_t factor = 1 << log2;
    const ImportedGrid coarse = coarsen(fine, log2);
    std::map<Voxel, std::pair<double, int>> sums;
    double mass = 0;
    for (const auto& [at, value] : voxelsOf(fine)) {
      auto& sum = sums[{floorDivide(at[0], factor), floorDivide(at[1], factor), floorDivide(at[2], factor)}];
      sum.first += static_cast<double>(value) - static_cast<double>(background);
      ++sum.second;
      mass += static_cast<double>(value) - static_cast<double>(background);
    }
    const Voxels voxels = voxelsOf(coarse);
    ASSERT_EQ(voxels.size(), sums.size());
    EXPECT_EQ(coarse.activeVoxels, sums.size());
    double coarseMass = 0;
    for (const auto& [at, sum] : sums) {
      ASSERT_TRUE(voxels.contains(at));
      const double mean = sum.first / (factor * factor * factor) + static_cast<double>(background);
      EXPECT_NEAR(static_cast<double>(voxels.at(at)), mean, 1e-6);
      EXPECT_LE(coarse.min, voxels.at(at));
      EXPECT_GE(coarse.max, voxels.at(at));
      coarseMass += (static_cast<double>(voxels.at(at)) - static_cast<double>(background)) * factor * factor * factor;
    }
    EXPECT_NEAR(coarseMass, mass, 1e-6 * std::abs(mass) + 1e-2);
    EXPECT_TRUE(std::ranges::is_sorted(coarse.leaves, {}, &Leaf::origin));
    EXPECT_TRUE(std::ranges::is_sorted(coarse.tiles, {}, &Tile::origin));
  }
}

TEST(Coarsen, CentresLieInTheMidstOfWhatTheyCover) {
  const ImportedGrid fine = randomGrid(3, 0);
  for (const std::uint32_t log2 : {1u, 2u}) {
    const std::int32_t factor = 1 << log2;
    const ImportedGrid coarse = coarsen(fine, log2);
    const auto world = [](const ImportedGrid& grid, const Voxel& at, std::size_t row) {
      const double* m = &grid.indexToWorld[4 * row];
      return m[0] * at[0] + m[1] * at[1] + m[2] * at[2] + m[3];
    };
    for (const Voxel& at : {Voxel{0, 0, 0}, Voxel{-3, 7, 100}}) {
      for (std::size_t row = 0; row < 3; ++row) {
        double sum = 0;
        for (std::int32_t i = 0; i < factor * factor * factor; ++i) {
          sum += world(fine,
                       {at[0] * factor + i / (factor * factor), at[1] * factor + i / factor % factor,
                        at[2] * factor + i % factor},
                       row);
        }
        EXPECT_NEAR(world(coarse, at, row), sum / (factor * factor * factor), 1e-9);
      }
    }
  }
}

TEST(Coarsen, TwiceIsOnceByFour) {
  const ImportedGrid fine = randomGrid(8, 0.5f);
  const Voxels twice = voxelsOf(coarsen(coarsen(fine, 1), 1)), once = voxelsOf(coarsen(fine, 2));
  ASSERT_EQ(twice.size(), once.size());
  for (const auto& [at, value] : once) EXPECT_NEAR(twice.at(at), value, 1e-6f);
}

TEST(Coarsen, LargeTilesStayTiles) {
  ImportedGrid grid = tests::emptyGrid();
  for (std::int32_t i = 0; i < 8; ++i) {
    grid.tiles.push_back({{-256 + 128 * (i >> 2), 128 * (i >> 1 & 1), 128 * (i & 1)}, 128, 2});
  }
  grid.tiles.push_back({{512, 0, 0}, 128, 3});
  const ImportedGrid coarse = coarsen(grid, 1);
  ASSERT_EQ(coarse.tiles.size(), 1 + 512u);  // eight are one, and the one alone fills an eighth
  EXPECT_EQ(coarse.tiles.front().origin, (Voxel{-128, 0, 0}));
  EXPECT_EQ(coarse.tiles.front().dim, 128u);
  EXPECT_EQ(coarse.activeVoxels, 9u * 64 * 64 * 64);
  EXPECT_EQ(coarse.max, 3);
  EXPECT_EQ(measureLevel(grid, coarse, 1).missed, 0u);
  ImportedGrid root = tests::emptyGrid();
  root.tiles.push_back({{-4096, 0, 4096}, 4096, 1});
  const ImportedGrid blocks = coarsen(root, 2);
  ASSERT_EQ(blocks.tiles.size(), 512u);
  EXPECT_EQ(blocks.tiles.front().origin, (Voxel{-1024, 0, 1024}));
  EXPECT_EQ(blocks.activeVoxels, std::uint64_t{1} << 30);
}

TEST(Coarsen, AbsentAndEmptyGridsStaySo) {
  EXPECT_FALSE(coarsen(ImportedGrid(), 1).present);
  const ImportedGrid empty = coarsen(tests::emptyGrid(), 2);
  EXPECT_TRUE(empty.present);
  EXPECT_EQ(empty.activeVoxels, 0u);
}

// By definition: every voxel of a box that holds all that either has.
LevelDifference measurePlainly(const Voxels& source, const Voxels& level, std::int32_t factor, double background) {
  Voxel low{1 << 20, 1 << 20, 1 << 20}, high{-(1 << 20), -(1 << 20), -(1 << 20)};
  for (const auto& [at, value] : level) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], (at[a] - 1) * factor);
      high[a] = std::max(high[a], (at[a] + 2) * factor);
    }
  }
  const auto get = [&](const Voxels& voxels, const Voxel& at) {
    const auto found = voxels.find(at);
    return found == voxels.end() ? background : static_cast<double>(found->second);
  };
  LevelDifference difference;
  for (std::int32_t x = low[0]; x < high[0]; ++x) {
    for (std::int32_t y = low[1]; y < high[1]; ++y) {
      for (std::int32_t z = low[2]; z < high[2]; ++z) {
        const Voxel at{x, y, z};
        double weights[3];
        Voxel first{};
        for (std::size_t a = 0; a < 3; ++a) {
          const double place = (at[a] + 0.5) / factor - 0.5;
          first[a] = static_cast<std::int32_t>(std::floor(place));
          weights[a] = place - std::floor(place);
        }
        double value = 0;
        for (std::int32_t c = 0; c < 8; ++c) {
          const std::int32_t step[3] = {c >> 2, c >> 1 & 1, c & 1};
          double weight = 1;
          Voxel corner{};
          for (std::size_t a = 0; a < 3; ++a) {
            weight *= step[a] != 0 ? weights[a] : 1 - weights[a];
            corner[a] = first[a] + step[a];
          }
          value += weight * get(level, corner);
        }
        const double error = value - get(source, at);
        difference.squaredError += error * error;
        difference.maxError = std::max(difference.maxError, std::abs(error));
      }
    }
  }
  return difference;
}

void expectSame(const LevelDifference& measured, const LevelDifference& plain) {
  EXPECT_NEAR(measured.squaredError, plain.squaredError, 1e-9 * plain.squaredError + 1e-12);
  EXPECT_NEAR(measured.maxError, plain.maxError, 2e-7 * plain.maxError);  // stated in single precision, rounded up
}

TEST(LevelError, IsThatOfTheDefinition) {
  for (std::uint32_t seed = 20; seed < 24; ++seed) {
    const float background = seed % 2 == 0 ? 0.25f : 0;
    const ImportedGrid fine = randomGrid(seed, background);
    const std::uint32_t log2 = seed % 2 + 1;
    ImportedGrid coarse = coarsen(fine, log2);
    // As if it had been encoded.
    for (Leaf& leaf : coarse.leaves) {
      for (std::uint32_t i = 0; i < 512; ++i) leaf.values[i] += format::maskBit(leaf.active, i) ? 0.01f : 0;
    }
    const LevelDifference measured = measureLevel(fine, coarse, log2);
    EXPECT_EQ(measured.missed, 0u);
    expectSame(measured, measurePlainly(voxelsOf(fine), voxelsOf(coarse), 1 << log2, background));
  }
}

TEST(LevelError, OfATileIsThatOfItsVoxels) {
  ImportedGrid tile = tests::emptyGrid();
  tile.tiles.push_back({{-128, 0, 128}, 128, 2});
  ImportedGrid leaves = tests::emptyGrid();
  for (std::int32_t i = 0; i < 4096; ++i) {
    Leaf leaf{};
    leaf.origin = {-128 + 8 * (i >> 8), 8 * (i >> 4 & 15), 128 + 8 * (i & 15)};
    std::ranges::fill(leaf.active.words, ~0u);
    leaf.values.fill(2);
    leaves.leaves.push_back(leaf);
  }
  const LevelDifference a = measureLevel(tile, coarsen(tile, 1), 1), b = measureLevel(leaves, coarsen(leaves, 1), 1);
  EXPECT_GT(a.squaredError, 0);  // what is linear across the faces
  EXPECT_EQ(a.squaredError, b.squaredError);
  EXPECT_EQ(a.maxError, b.maxError);
  // The level as one tile, and the tile's inside alone differs.
  ImportedGrid other = tile;
  other.tiles[0].value = 2.5f;
  ImportedGrid level = tests::emptyGrid();
  level.tiles.push_back({{-128, 0, 128}, 128, 2});
  ImportedGrid source = tests::emptyGrid();
  for (std::int32_t i = 0; i < 8; ++i) {
    source.tiles.push_back({{-256 + 128 * (i >> 2), 128 * (i >> 1 & 1), 256 + 128 * (i & 1)}, 128, 2.5f});
  }
  const LevelDifference c = measureLevel(source, level, 1);
  EXPECT_GT(c.squaredError, 0.25 * 224 * 224 * 224);
  EXPECT_EQ(c.missed, 0u);
}

TEST(LevelError, CountsWhatTheLevelHasNot) {
  const ImportedGrid fine = randomGrid(5, 0);
  ImportedGrid coarse = coarsen(fine, 1);
  coarse.leaves.clear();
  coarse.tiles.clear();
  EXPECT_EQ(measureLevel(fine, coarse, 1).missed, fine.activeVoxels);
}

class LevelPack : public testing::Test {
 protected:
  LevelPack() : folder_(testing::TempDir() + "levels_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~LevelPack() override { std::filesystem::remove_all(folder_); }

  // Three frames of a ball that moves, with a velocity; frame 1002 is missing.
  void addFrames() {
    for (const std::int32_t frame : {1000, 1001, 1003}) {
      std::array<ImportedGrid, 4> grids;
      for (std::int32_t g = 0; g < 4; ++g) {
        grids[static_cast<std::size_t>(g)] =
            tests::ballGrid({-16 + 8 * (frame - 1000), 0, -8}, [&](float density, auto) {
              return density * (1 + static_cast<float>(g)) *
                     (1 + 0.3f * std::sin(density * 40 + static_cast<float>(frame)));
            });
        grids[static_cast<std::size_t>(g)].indexToWorld = {0.5, 0, 0, 3, 0, 0.5, 0, 0, 0, 0, 0.5, -20};
      }
      const VdbOutput outputs[] = {{"density", true, {&grids[0]}},
                                   {"velocity", false, {&grids[1], &grids[2], &grids[3]}}};
      writeVdb(folder_ + "/s_" + std::to_string(frame) + ".vdb", outputs);
    }
  }
  CompileReport compileTo(const std::string& name, const CompileOptions& options) {
    return compile({folder_ + "/s_####.vdb"}, folder_ + "/" + name, options, [](const std::string&) {});
  }
  static CompileOptions withLevels(std::uint32_t levels) {
    CompileOptions options;
    options.import.levels = levels;
    options.import.missing = MissingFrames::hold;
    return options;
  }
  std::string bytesOf(const std::string& name) const {
    std::ifstream file(folder_ + "/" + name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  format::Pack open(const std::string& name) const {
    const std::string path = folder_ + "/" + name;
    format::validate(**format::openFileSource(path), {},
                     [](const format::Issue& issue) { ADD_FAILURE() << toString(issue); });
    return std::move(*format::Pack::openFile(path));
  }

  std::string folder_;
};

Voxels voxelsOf(const format::GridView& view) {
  Voxels voxels;
  for (const format::GridView::Leaf& leaf : view.leaves()) {
    format::Values values;
    format::Mask3 active;
    format::decodeBrick(leaf.node, leaf.mask, leaf.brick, view.frame().background, values, active);
    for (std::uint32_t i = 0; i < 512; ++i) {
      if (!format::maskBit(active, i)) continue;
      const std::uint32_t step[3] = {i >> 6, i >> 3 & 7, i & 7};
      Voxel at{};
      for (std::size_t a = 0; a < 3; ++a) {
        at[a] = static_cast<std::int32_t>(leaf.origin[a] + step[a]) + view.frame().origin[a];
      }
      voxels[at] = values[i];
    }
  }
  EXPECT_TRUE(view.tiles().empty());
  return voxels;
}

TEST_F(LevelPack, StatesTheTrueErrorOfEveryGridAndFrame) {
  addFrames();
  CompileOptions options = withLevels(2);
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_EQ(report.frames, 4u);
  const format::Pack pack = open("a.blw");
  ASSERT_EQ(pack.volumes().size(), 3u);
  const format::VolumeRecord& full = pack.volumes()[0];
  const auto levels = pack.levelsOf(0);
  ASSERT_EQ(levels.size(), 2u);
  Plan plan = planInputs({folder_ + "/s_####.vdb"}, options.import, [](const std::string&) {});
  for (const format::LevelRecord& level : levels) {
    const format::VolumeRecord& record = pack.volumes()[level.level];
    EXPECT_EQ(pack.string(record.name), level.log2 == 1 ? "s 1:2" : "s 1:4");
    float largest = 0;
    for (std::uint32_t f = 0; f < full.frameCount; ++f) {
      const ImportedFrame source = importFrame(plan.volumes[0], plan.volumes[0].frames[f], options.import, {});
      for (std::uint32_t g = 0; g < full.gridCount; ++g) {
        const Voxels voxels = voxelsOf(*format::GridView::load(pack, pack.gridFrame(record, f, g)));
        const LevelDifference plain = measurePlainly(voxelsOf(source.grids[g]), voxels, 1 << level.log2, 0);
        const format::LevelError& stated = pack.levelError(level, f, g);
        expectSame({stated.squaredError, static_cast<double>(stated.maxError), 0}, plain);
        EXPECT_GE(static_cast<double>(stated.maxError), plain.maxError * (1 - 1e-12));
        largest = std::max(largest, stated.maxError);
        // What a ray gathers stays, but for what the encoding may err.
        double mass = 0, levelMass = 0;
        for (const auto& [at, value] : voxelsOf(source.grids[g])) mass += static_cast<double>(value);
        for (const auto& [at, value] : voxels) levelMass += static_cast<double>(value);
        EXPECT_NEAR(levelMass * std::pow(8, level.log2), mass, 0.005 * mass);
      }
    }
    float reported = 0;
    for (const GridReport& grid : report.grids) {
      if (grid.level == level.log2) reported = std::max(reported, grid.levelMaxError);
      EXPECT_GE(grid.worstPsnr, 47);  // against the means too
    }
    EXPECT_EQ(reported, largest);
  }
}

TEST_F(LevelPack, LevelsAndFullVolumesShareNoPage) {
  addFrames();
  compileTo("a.blw", withLevels(2));
  const format::Pack pack = open("a.blw");
  std::vector<std::set<std::uint32_t>> pages(3);
  for (std::size_t v = 0; v < 3; ++v) {
    const format::VolumeRecord& volume = pack.volumes()[v];
    for (std::uint32_t i = 0; i < volume.frameCount * volume.gridCount; ++i) {
      const auto list = pack.pagesOf(pack.gridFrames()[volume.firstGridFrame + i]);
      pages[v].insert(list.begin(), list.end());
    }
    EXPECT_FALSE(pages[v].empty());
  }
  EXPECT_LT(*pages[0].rbegin(), *pages[1].begin());
  EXPECT_LT(*pages[1].rbegin(), *pages[2].begin());
}

TEST_F(LevelPack, AreTheSameWhateverTheThreads) {
  addFrames();
  CompileOptions options = withLevels(2);
  std::set<std::string> all;
  for (const unsigned threads : {1u, 2u, 8u}) {
    options.threads = threads;
    compileTo("a.blw", options);
    all.insert(bytesOf("a.blw"));
  }
  EXPECT_EQ(all.size(), 1u);
}

// The full volume's tables and pages do not change with what stands behind them.
TEST_F(LevelPack, FullVolumesAreWhatTheyAreWithoutLevels) {
  addFrames();
  compileTo("with.blw", withLevels(1));
  compileTo("without.blw", withLevels(0));
  const format::Pack with = open("with.blw"), without = open("without.blw");
  EXPECT_TRUE(without.levels().empty());
  EXPECT_EQ(without.volumes().size(), 1u);
  const auto same = [](const auto& a, const auto& b) {
    return std::memcmp(a.data(), b.data(), std::as_bytes(b).size()) == 0;
  };
  EXPECT_TRUE(same(with.gridFrames(), without.gridFrames()));
  EXPECT_TRUE(same(with.pages(), without.pages()));
  // Nor does a pack without levels know of them.
  for (const format::SectionEntry& section : without.sections()) EXPECT_NE(section.type, format::kSectionLevels);
}

TEST_F(LevelPack, ABudgetCoversAllLevels) {
  addFrames();
  CompileOptions options = withLevels(2);
  const std::uint64_t all = compileTo("a.blw", options).gpuBytes;
  options.budget.gpu = all * 3 / 4;
  const CompileReport report = compileTo("b.blw", options);
  EXPECT_LE(report.gpuBytes, *options.budget.gpu);
  EXPECT_GE(report.gpuBytes, *options.budget.gpu / 2);
  EXPECT_EQ(open("b.blw").levelsOf(0).size(), 2u);
}

TEST_F(LevelPack, ManifestAndCommandLineSayHowMany) {
  addFrames();
  const std::string manifest = folder_ + "/m.json";
  std::ofstream(manifest) << R"({"volumes": [{"name": "a", "inputs": ["s_####.vdb"], "missing": "hold", "levels": 1},
                                             {"name": "b", "inputs": ["s_1000.vdb"]},
                                             {"name": "c", "inputs": ["s_1001.vdb"], "levels": 2}]})";
  const auto levelsOf = [&](const CompileOptions& options) {
    compile({manifest}, folder_ + "/m.blw", options, [](const std::string&) {});
    const format::Pack pack = open("m.blw");
    std::vector<std::size_t> counts;
    for (std::uint32_t v = 0; v < 3; ++v) counts.push_back(pack.levelsOf(v).size());
    for (std::uint32_t v = 0; v < pack.volumes().size(); ++v) EXPECT_EQ(pack.isLevel(v), v >= 3);
    return counts;
  };
  EXPECT_EQ(levelsOf({}), (std::vector<std::size_t>{1, kDefaultLevels, 2}));
  CompileOptions options;
  options.import.levels = 1;
  EXPECT_EQ(levelsOf(options), (std::vector<std::size_t>{1, 1, 1}));
  std::ofstream(manifest) << R"({"volumes": [{"name": "a", "inputs": ["s_1000.vdb"], "levels": 1},
                                             {"name": "a 1:2", "inputs": ["s_1001.vdb"]}]})";
  try {
    levelsOf({});
    FAIL() << "two volumes of one name";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("'a 1:2'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace billow::compiler
