// Frames of real sequences, from `billow compile` to what the GPU will read: voxel for voxel what a checked view says.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "billow/format/grid_view.h"
#include "loaded_frame.h"
#include "run_command.h"

namespace billow::tests {
namespace {

using format::GridView;
using runtime::Index;

// All voxels of all leaves and of one layer around each; a voxel in every tile.
std::size_t differences(const FrameReader& reader, const runtime::LoadedGrid& grid, const GridView& view) {
  std::size_t wrong = 0;
  const auto compare = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const float is = reader.voxel(grid, x, y, z), expected = view.voxel(x, y, z);
    wrong += std::bit_cast<std::uint32_t>(is) != std::bit_cast<std::uint32_t>(expected) ? 1 : 0;
  };
  for (const GridView::Leaf& leaf : view.leaves()) {
    // Layers take turns: reading one voxel decodes blocks anew.
    for (int i = static_cast<int>(leaf.index % 3); i < 1000; i += 3) {
      compare(leaf.origin[0] + i / 100 - 1, leaf.origin[1] + i / 10 % 10 - 1, leaf.origin[2] + i % 10 - 1);
    }
  }
  for (const GridView::Tile& tile : view.tiles())
    compare(tile.origin[0] + 5, tile.origin[1] + 77, tile.origin[2] + 127);
  return wrong;
}

void expectFrame(runtime::FrameLoader& loader, const runtime::LoadRequest& request) {
  const ReadPages read(request);
  const auto loaded = loader.load(request, read.pages);
  ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
  const format::VolumeRecord& volume = request.pack->volumes()[request.volume];
  const std::uint32_t numbers[] = {request.grids.extinction, request.grids.temperature, request.grids.flames};
  for (std::uint32_t slot = 0; slot < 3; ++slot) {
    if (numbers[slot] == format::kNone || !loaded->grids[slot].present) continue;
    const format::GridFrame& gridFrame = request.pack->gridFrame(volume, request.frame, numbers[slot]);
    const auto view = GridView::load(*request.pack, gridFrame);
    ASSERT_TRUE(view.has_value());
    EXPECT_EQ(differences(FrameReader(*loaded), loaded->grids[slot], *view), 0u)
        << "frame " << request.frame << ", grid " << numbers[slot];
  }
}

void expectSequence(const std::string& pathOfPack) {
  const auto pack = format::Pack::openFile(pathOfPack);
  ASSERT_TRUE(pack.has_value()) << toString(pack.error());
  runtime::FrameLoader loader(std::pmr::new_delete_resource());
  const format::VolumeRecord& volume = pack->volumes()[0];
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    for (std::uint32_t grid = 0; grid < volume.gridCount; grid += 3) {
      const auto number = [&](std::uint32_t i) { return grid + i < volume.gridCount ? grid + i : format::kNone; };
      expectFrame(loader, {.pack = &*pack,
                           .frame = frame,
                           .grids = {.extinction = number(0), .temperature = number(1), .flames = number(2)},
                           .index = static_cast<Index>(frame % 4),
                           .bc7 = frame % 2 == 0,
                           .leastAtlasBricks = 1,
                           .maxImageExtent3D = 2048});
    }
  }
}

// Compiles a folder of frames; false where there is no command to do it.
bool compile(const std::string& source, const std::string& pack, const std::string& compress) {
  if (std::getenv("BILLOW") == nullptr) {
    std::cout << "skipped: BILLOW does not name the built command\n";
    return false;
  }
  const CommandResult done = billow("compile " + source + " -o " + pack + " --compress " + compress);
  EXPECT_EQ(done.code, 0) << done.err;
  return done.code == 0;
}

TEST(LoadSequence, TheSampleGivesTheValuesOfItsViews) {
  const TempFolder folder;
  for (const char* compress : {"small", "fast"}) {
    const std::string pack = folder / "p.blw";
    if (compile(BILLOW_SOURCE_DIR "/samples/fire", pack, compress)) expectSequence(pack);
  }
}

TEST(LoadSequence, SharedSequencesGiveTheValuesOfTheirViews) {
  const char* data = std::getenv("BILLOW_DATA");
  const TempFolder folder;
  for (const char* name : {"ember", "ember_start", "smoke", "smoke_vel", "blast", "dust"}) {
    const std::filesystem::path source = std::filesystem::path(data != nullptr ? data : "") / name;
    if (!std::filesystem::is_directory(source)) {
      std::cout << "skipped: BILLOW_DATA has no folder " << name << "\n";
      continue;
    }
    const std::string pack = folder / "p.blw";
    if (compile(source.string(), pack, "fast")) expectSequence(pack);
  }
}

}  // namespace
}  // namespace billow::tests
