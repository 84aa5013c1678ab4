// The frame loader: what the GPU will read is what a checked view of the pack says; memory is what was promised; no
// bytes of a page do harm.
#include "stream/load_frame.h"

#include <gtest/gtest.h>

#include <memory_resource>
#include <optional>

#include "billow/format/grid_view.h"
#include "interface.h"
#include "loaded_frame.h"
#include "pack_image.h"
#include "sample_pack.h"

namespace billow::tests {
namespace {

using format::GridView;
using runtime::ErrorCode;
using runtime::FrameLoader;
using runtime::Index;
using runtime::LoadedFrame;
using runtime::LoadRequest;
using runtime::Verify;

format::Pack open(std::vector<std::byte> bytes) {
  auto pack = format::Pack::open(format::makeMemorySource(std::move(bytes)));
  if (!pack) ADD_FAILURE() << toString(pack.error());
  return std::move(*pack);
}

format::Mask3 someMask(std::uint32_t seed) {
  std::mt19937 random(seed);
  format::Mask3 mask;
  for (std::uint32_t& word : mask.words) word = static_cast<std::uint32_t>(random());
  return mask;
}

// Two grids with every encoding, all kinds of masks, and tiles, in pages of about 4 KB.
std::vector<std::byte> everything(format::Compression compression) {
  format::PackWriter::Options options;
  options.pageBytes = 4096;
  options.compression = compression;
  return writePack(options, [](format::PackWriter& writer) {
    using namespace format;
    PackTables tables = sampleTables("v", {"density", "temperature"}, 1);
    for (std::uint32_t g = 0; g < 2; ++g) {
      GridFrameBuilder grid(writer, g == 0 ? 0 : 0.0625f);
      for (std::uint32_t i = 0; i < 3 * kEncodingCount; ++i) {
        const std::uint32_t encoding = i / 3;
        const float scale = encoding == kEncodingConstant ? 0 : 0.9f / static_cast<float>(largestTexel(encoding));
        const std::uint32_t kind = i % 3 == 2 && indexBits(encoding) == 0 ? 1 : i % 3;
        const std::uint32_t word = kind == 0 ? kMaskAll : kind == 1 ? 0 : kMaskTexel;
        grid.brick({14 + i % 5, 13 + i / 5, 15 + kind}, encoding, randomBytes(*brickBytes(encoding), i + 100 * g),
                   0.1f + static_cast<float>(g), scale, word, someMask(i));
      }
      grid.tile({3, 0, 0}, 2);
      grid.tile({0, 2, 2}, 2);
      grid.tile({2, 0, 3}, g == 0 ? 3.0f : 0.0625f);
      tables.gridFrames.push_back(grid.finish(tables));
    }
    return tables;
  });
}

LoadRequest requestOf(const format::Pack& pack) {
  return {.pack = &pack, .grids = {.extinction = 0, .temperature = 1}, .maxImageExtent3D = 2048};
}

// Counts what is taken, and refuses what is too much.
class Counting : public std::pmr::memory_resource {
 public:
  std::uint64_t now = 0, most = 0, limit = ~std::uint64_t{0}, calls = 0;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (bytes > limit - now) throw std::bad_alloc();
    now += bytes;
    most = std::max(most, now);
    ++calls;
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override {
    now -= bytes;
    std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

void expectSameValues(const LoadedFrame& loaded, std::uint32_t slot, const GridView& view) {
  const FrameReader reader(loaded);
  const runtime::LoadedGrid& grid = loaded.grids[slot];
  std::size_t wrong = 0;
  const auto compare = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const float is = reader.voxel(grid, x, y, z), expected = view.voxel(x, y, z);
    if (std::bit_cast<std::uint32_t>(is) == std::bit_cast<std::uint32_t>(expected) || ++wrong > 5) return;
    ADD_FAILURE() << "(" << x << ", " << y << ", " << z << "): " << is << ", expected " << expected;
  };
  for (const GridView::Leaf& leaf : view.leaves()) {
    for (int i = 0; i < 1000; ++i) {
      compare(leaf.origin[0] + i / 100 - 1, leaf.origin[1] + i / 10 % 10 - 1, leaf.origin[2] + i % 10 - 1);
    }
  }
  for (const GridView::Tile& tile : view.tiles()) {
    for (std::int64_t i = 0; i < 64; ++i) {
      const std::int64_t offsets[4] = {-1, 0, tile.dim - 1, tile.dim};
      compare(tile.origin[0] + offsets[i / 16], tile.origin[1] + offsets[i / 4 % 4], tile.origin[2] + offsets[i % 4]);
    }
  }
  EXPECT_EQ(wrong, 0u);
}

struct LoadCase {
  Index index;
  bool bc7;
  format::Compression compression;
};

class Load : public testing::TestWithParam<LoadCase> {};

TEST_P(Load, GivesTheValuesOfTheView) {
  const format::Pack pack = open(everything(GetParam().compression));
  LoadRequest request = requestOf(pack);
  request.index = GetParam().index;
  request.bc7 = GetParam().bc7;
  request.leastAtlasBricks = 1;
  FrameLoader loader(std::pmr::new_delete_resource());
  const ReadPages read(request);
  ASSERT_GT(read.pages.size(), 3u);
  const auto loaded = loader.load(request, read.pages);
  ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
  EXPECT_EQ(loaded->atlas.size(), GetParam().bc7 ? loaded->shape.bytes() : 0);
  EXPECT_EQ(loaded->stats.bc7Bricks, GetParam().bc7 ? 18u : 0u);
  for (std::uint32_t slot = 0; slot < 2; ++slot) {
    const auto view = GridView::load(pack, pack.gridFrames()[slot]);
    ASSERT_TRUE(view.has_value());
    ASSERT_TRUE(loaded->grids[slot].present);
    expectSameValues(*loaded, slot, *view);
  }
  EXPECT_FALSE(loaded->grids[2].present);
}

INSTANTIATE_TEST_SUITE_P(All, Load,
                         testing::Values(LoadCase{Index::flat, true, format::Compression::fast},
                                         LoadCase{Index::flat, false, format::Compression::small},
                                         LoadCase{Index::tree, true, format::Compression::fast},
                                         LoadCase{Index::tree, false, format::Compression::fast},
                                         LoadCase{Index::dense, true, format::Compression::fast}));

TEST(LoadMemory, IsWhatTheTablesSay) {
  const format::Pack pack = open(everything(format::Compression::fast));
  const LoadRequest request = requestOf(pack);
  const ReadPages read(request);
  Counting memory;
  memory.limit = scratchBound(request);
  std::optional<FrameLoader> loader(std::in_place, &memory);
  ASSERT_TRUE(loader->load(request, read.pages).has_value());
  EXPECT_LE(memory.most, memory.limit);
  const std::uint64_t calls = memory.calls;
  ASSERT_TRUE(loader->load(request, read.pages).has_value());
  EXPECT_EQ(memory.calls, calls);
  loader.reset();
  EXPECT_EQ(memory.now, 0u);
  memory.limit = scratchBound(request) / 2;
  const auto refused = FrameLoader(&memory).load(request, read.pages);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::memory);
  EXPECT_EQ(memory.now, 0u);
}

TEST(LoadVerify, FollowsThePolicy) {
  const format::Pack pack = open(everything(format::Compression::fast));
  LoadRequest request = requestOf(pack);
  ReadPages read(request);
  FrameLoader loader(std::pmr::new_delete_resource());
  std::vector<std::atomic<std::uint32_t>> verified(pack.pages().size() / 32 + 1);
  request.verified = verified;
  request.verify = Verify::once;
  ASSERT_TRUE(loader.load(request, read.pages).has_value());
  const std::uint32_t number = read.pages[1].number;
  EXPECT_NE(verified[number / 32].load() >> number % 32 & 1, 0u);
  // The last byte of a raw literal: the page still unpacks, to something else.
  read.bytes[1].back() ^= std::byte{1};
  const auto always = [&](Verify verify) {
    request.verify = verify;
    return loader.load(request, read.pages);
  };
  const auto refused = always(Verify::always);
  ASSERT_FALSE(refused.has_value());
  ASSERT_TRUE(refused.error().issue.has_value());
  EXPECT_EQ(refused.error().issue->kind->id, 301);
  EXPECT_EQ(refused.error().issue->place.page, number);
  const auto once = always(Verify::once);
  EXPECT_TRUE(once.has_value() || once.error().issue->kind->id != 301) << once.error().message;
  for (auto& word : verified) word = 0;
  EXPECT_EQ(always(Verify::once).error().issue->kind->id, 301);
  EXPECT_EQ(verified[number / 32].load() >> number % 32 & 1, 0u);
}

TEST(LoadErrors, NameWhatIsWrong) {
  const format::Pack pack = open(everything(format::Compression::fast));
  const LoadRequest request = requestOf(pack);
  const ReadPages read(request);
  FrameLoader loader(std::pmr::new_delete_resource());
  const auto codeOf = [&](const LoadRequest& bad) { return loader.load(bad, read.pages).error().code; };
  LoadRequest bad = request;
  bad.volume = 1;
  EXPECT_EQ(codeOf(bad), ErrorCode::argument);
  bad = request;
  bad.frame = 1;
  EXPECT_EQ(codeOf(bad), ErrorCode::argument);
  bad = request;
  bad.grids.flames = 2;
  EXPECT_EQ(codeOf(bad), ErrorCode::argument);
  EXPECT_EQ(loader.load(request, std::span(read.pages).subspan(1)).error().code, ErrorCode::argument);
  std::vector<runtime::StoredPage> shortened = read.pages;
  shortened[2].bytes = shortened[2].bytes.subspan(1);
  const auto refused = loader.load(request, shortened);
  ASSERT_TRUE(!refused.has_value() && refused.error().issue.has_value());
  EXPECT_EQ(refused.error().issue->place.page, shortened[2].number);
}

TEST(LoadErrors, CountsThatThePagesCannotHold) {
  const PackImage sound = PackImage::of(everything(format::Compression::fast));
  const auto tryCount = [&](std::uint32_t format::GridFrame::*count, std::uint32_t value) {
    PackImage image = sound;
    image.gridFrames[0].*count = value;
    const format::Pack pack = open(image.assemble());
    const LoadRequest request = requestOf(pack);
    const ReadPages read(request);
    const auto loaded = FrameLoader(std::pmr::new_delete_resource()).load(request, read.pages);
    ASSERT_FALSE(loaded.has_value()) << value;
    EXPECT_EQ(loaded.error().issue->kind->id, 601) << loaded.error().message;
    EXPECT_TRUE(loaded.error().issue->place.grid.has_value());
  };
  const format::GridFrame& frame = sound.gridFrames[0];
  for (const std::uint32_t wrong : {0u, 1u, 0x7fffffffu, 0xffffffffu}) {
    tryCount(&format::GridFrame::node3Count, wrong);
    tryCount(&format::GridFrame::childCount, wrong);
    tryCount(&format::GridFrame::tileCount, wrong == 1 ? 3 : wrong);
  }
  tryCount(&format::GridFrame::maskCount, 0);
  tryCount(&format::GridFrame::node3Count, frame.node3Count - 1);
  tryCount(&format::GridFrame::node4Count, 0xffffffffu);
}

// Each voxel of the means is the average of 8^3 voxels, within half a step of the encoding.
TEST(LoadMeans, AreAveragesOfTheGrid) {
  const format::Pack pack = open(everything(format::Compression::fast));
  LoadRequest request = requestOf(pack);
  request.means = true;
  const ReadPages read(request);
  Counting memory;
  memory.limit = scratchBound(request);
  FrameLoader loader(&memory);
  const auto loaded = loader.load(request, read.pages);
  ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
  const FrameReader reader(*loaded);
  for (std::uint32_t slot = 0; slot < 2; ++slot) {
    const auto view = GridView::load(pack, pack.gridFrames()[slot]);
    ASSERT_TRUE(view.has_value());
    const runtime::LoadedGrid& grid = loaded->grids[slot];
    EXPECT_EQ(grid.index, Index::flat);
    const double step = (double{grid.frame.valueMax} - double{grid.frame.valueMin}) / 65535;
    std::uint64_t active = 0;
    for (std::int64_t i = 0; i < 70 * 50 * 70; ++i) {
      const std::int64_t x = i / (50 * 70) - 1, y = i / 70 % 50 - 1, z = i % 70 - 1;
      double sum = 0;
      for (std::int64_t v = 0; v < 512; ++v) {
        sum += double{view->voxel(8 * x + (v >> 6), 8 * y + (v >> 3 & 7), 8 * z + (v & 7))};
      }
      const float is = reader.voxel(grid, x, y, z);
      ASSERT_NEAR(is, sum / 512, step) << x << " " << y << " " << z;
      active += is != grid.frame.background ? 1 : 0;
    }
    EXPECT_EQ(grid.frame.activeVoxels, 57u + 3u * 16 * 16 * 16);
    EXPECT_GE(grid.frame.activeVoxels, active);
    // The first voxel's centre lies in the middle of the grid's first 8^3.
    const double* fine = view->frame().indexToWorld;
    for (int row = 0; row < 3; ++row) {
      const double* means = grid.frame.indexToWorld + 4 * row;
      EXPECT_DOUBLE_EQ(means[3], fine[4 * row + 3] + 3.5 * (fine[4 * row] + fine[4 * row + 1] + fine[4 * row + 2]));
      EXPECT_DOUBLE_EQ(means[row], 8 * fine[4 * row + row]);
    }
  }
}

// The distances of a flat table, by looking at every pair.
TEST(LoadIndex, DistancesAreThoseToTheNearestCell) {
  std::mt19937 random(3);
  for (int round = 0; round < 12; ++round) {
    const std::uint32_t bricks = 1 + static_cast<std::uint32_t>(random() % 6);
    std::set<std::array<std::uint32_t, 3>> cells;
    while (cells.size() < bricks) {
      cells.insert({20 + static_cast<std::uint32_t>(random() % 9), 7 + static_cast<std::uint32_t>(random() % 17),
                    40 + static_cast<std::uint32_t>(random() % 23)});
    }
    const format::Pack pack = open(writePack({}, [&](format::PackWriter& writer) {
      format::PackTables tables = sampleTables("v", {"density"}, 1);
      GridFrameBuilder grid(writer, 0);
      for (const auto& cell : cells) grid.brick(cell, format::kEncodingConstant, {}, 1, 0, format::kMaskAll);
      tables.gridFrames.push_back(grid.finish(tables));
      return tables;
    }));
    const LoadRequest request{.pack = &pack, .grids = {.extinction = 0}, .index = Index::flat};
    FrameLoader loader(std::pmr::new_delete_resource());
    const ReadPages read(request);
    const auto loaded = loader.load(request, read.pages);
    ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
    const runtime::LoadedGrid& grid = loaded->grids[0];
    const FrameReader reader(*loaded);
    for (std::uint32_t i = 0; i < grid.cells.count(); ++i) {
      const std::uint32_t* dim = grid.cells.dim;
      const std::array<std::uint32_t, 3> at{grid.cells.min[0] + i / (dim[1] * dim[2]),
                                            grid.cells.min[1] + i / dim[2] % dim[1], grid.cells.min[2] + i % dim[2]};
      std::uint32_t nearest = 255;
      for (const auto& cell : cells) {
        std::uint32_t away = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          // From the cell before on, upper taps reach into it.
          const std::uint32_t low = cell[axis] - 1, high = cell[axis];
          away = std::max(away, at[axis] < low ? low - at[axis] : at[axis] > high ? at[axis] - high : 0);
        }
        nearest = std::min(nearest, away);
      }
      const std::uint32_t entry = reader.flatEntry(grid, at);
      const bool busy = cells.contains(at);
      ASSERT_EQ(entry >= runtime::gpu::kSkip ? entry & 0xff : 0, nearest) << i << " of round " << round;
      ASSERT_EQ(entry != 0 && entry < runtime::gpu::kSkip, busy);
    }
  }
}

// Changed bytes behind right checksums: an error, or a frame in which every look-up stays inside.
TEST(LoadErrors, NoBytesOfAPageDoHarm) {
  std::mt19937 random(11);
  std::size_t refused = 0;
  const std::vector<std::byte> sound = everything(format::Compression::fast);
  const PackImage image = PackImage::of(sound);
  const format::Pack pack = open(image.assemble());
  LoadRequest request = requestOf(pack);
  request.verify = Verify::never;
  request.bc7 = true;
  request.leastAtlasBricks = 1;
  FrameLoader loader(std::pmr::new_delete_resource());
  for (int round = 0; round < 3000; ++round) {
    request.index = static_cast<Index>(round % 3);
    request.means = round % 5 == 0;
    request.bc7 = round % 2 == 0;
    ReadPages read(request);
    for (int change = 0; change < 3; ++change) {
      auto& page = read.bytes[random() % read.bytes.size()];
      // Nodes lie at the end.
      const std::size_t back = 1 + random() % std::min<std::size_t>(page.size(), 900);
      page[page.size() - back] = static_cast<std::byte>(random());
    }
    const auto loaded = loader.load(request, read.pages);
    if (!loaded) {
      ++refused;
      ASSERT_TRUE(loaded.error().issue.has_value()) << loaded.error().message;
      EXPECT_TRUE(loaded.error().issue->place.page.has_value()) << loaded.error().message;
      continue;
    }
    const FrameReader reader(*loaded);
    for (std::uint32_t slot = 0; slot < 2; ++slot) {
      for (std::int64_t i = 0; i < 9 * 16 * 6; ++i) {
        reader.voxel(loaded->grids[slot], 8 * (12 + i / 96) + i % 8, 8 * (11 + i / 6 % 16) + i % 7, 8 * (14 + i % 6));
      }
    }
  }
  EXPECT_GT(refused, 300u);
  EXPECT_LT(refused, 2900u);
}

}  // namespace
}  // namespace billow::tests
