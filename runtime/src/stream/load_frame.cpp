#include "stream/load_frame.h"

#include <algorithm>
#include <cstring>

#include "checks.h"
#include "stream/brick_places.h"
#include "stream/load_plan.h"
#include "stream/means_builder.h"
#include "stream/page_items.h"

namespace billow::runtime {
namespace {

using format::Stream;

// One load: pages to items, grids to sections, then what is known of both.
class Load {
 public:
  Load(const LoadRequest& request, const LoadPlan& plan, Scratch& scratch, format::PageUnpacker& unpacker)
      : request_(request), plan_(plan), scratch_(scratch), unpacker_(unpacker) {}

  Result<LoadedFrame> run(std::span<const StoredPage> stored) {
    if (auto done = unpackPages(stored); !done) return tl::unexpected(done.error());
    buffer_ = scratch_.take<std::byte>(plan_.bufferBytes);
    if (plan_.inAtlas) atlas_ = scratch_.take<std::byte>(plan_.shape.bytes());
    if (auto done = buildGrids(); !done) return tl::unexpected(done.error());
    return std::move(frame_);
  }

 private:
  bool verifies(std::uint32_t page) const {
    if (request_.verify != Verify::once || request_.verified.empty()) return request_.verify != Verify::never;
    return (request_.verified[page / 32].load(std::memory_order_relaxed) >> page % 32 & 1) == 0;
  }

  void remember(std::uint32_t page) const {
    if (request_.verified.empty()) return;
    request_.verified[page / 32].fetch_or(1u << page % 32, std::memory_order_relaxed);
  }

  Result<void> unpackPages(std::span<const StoredPage> stored) {
    const format::Pack& pack = *request_.pack;
    for (std::uint32_t s = 0; s < format::kStreamCount; ++s) {
      items_.giveRoom(s, scratch_.take<PageItems::Run>(stored.size()));
    }
    for (const StoredPage& page : stored) {
      const bool verify = verifies(page.number);
      const auto content = contentOf(page, verify);
      if (!content) return packError(content.error());
      if (verify) remember(page.number);
      items_.add(pack.pages()[page.number], page.number, *content);
    }
    return {};
  }

  format::Result<const std::byte*> contentOf(const StoredPage& page, bool verify) {
    const format::PageRecord& record = request_.pack->pages()[page.number];
    // Nodes are read in place.
    const bool aligned = reinterpret_cast<std::uintptr_t>(page.bytes.data()) % alignof(format::Node3) == 0;
    if (record.codec == static_cast<std::uint32_t>(format::Codec::raw) && aligned) {
      const auto sound = unpacker_.checkRaw(*request_.pack, page.number, page.bytes, verify);
      if (!sound) return tl::unexpected(sound.error());
      return page.bytes.data();
    }
    const std::span<std::byte> content = scratch_.take<std::byte>(record.rawSize);
    const auto done = unpacker_.unpack(*request_.pack, page.number, page.bytes, verify, content);
    if (!done) return tl::unexpected(done.error());
    return content.data();
  }

  std::span<std::uint32_t> numbersOf(Stream stream) {
    return scratch_.take<std::uint32_t>(plan_.items[static_cast<std::size_t>(stream)]);
  }

  Result<void> buildGrids() {
    BrickPlaces bricks(plan_, numbersOf(Stream::unit), buffer_, atlas_);
    MaskTable masks{.numbers = numbersOf(Stream::mask),
                    .masks = {reinterpret_cast<format::Mask3*>(buffer_.data() + plan_.masks.at), plan_.masks.count}};
    std::fill(masks.numbers.begin(), masks.numbers.end(), 0u);
    const GridScratch scratch{.records = numbersOf(Stream::node3),
                              .lists = numbersOf(Stream::node4),
                              .tiles = scratch_.take<std::uint32_t>(plan_.tileSlots),
                              .distances = scratch_.take<std::uint8_t>(plan_.distanceBytes),
                              .means = scratch_.take<float>(plan_.means)};
    for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
      const GridPlan& grid = plan_.grids[slot];
      if (grid.frame == nullptr) continue;
      describe(grid, frame_.grids[slot]);
      if (request_.means) frame_.grids[slot].frame = frameOfMeans(*grid.frame);
      if (grid.cells.count() == 0) continue;
      TreeWalk walk(request_, grid, items_);
      if (request_.means) {
        MeansBuilder builder(walk, grid, bricks, masks, scratch, buffer_);
        if (!builder.build()) return packError(walk.issue());
        frame_.grids[slot].frame.activeVoxels = builder.activeVoxels();
      } else {
        GridBuilder builder(walk, grid, bricks, masks, scratch, buffer_);
        if (!builder.build()) return packError(walk.issue());
        frame_.grids[slot].absent5 = builder.absent5();
      }
    }
    bricks.finish();
    finish(bricks, masks);
    return {};
  }

  static void describe(const GridPlan& grid, LoadedGrid& loaded) {
    loaded = {.present = true,
              .frame = *grid.frame,
              .cells = grid.cells,
              .index = grid.index,
              .absent5 = 0,
              .skippable = grid.frame->background == 0,
              .table = grid.table.at,
              .records = grid.records.at,
              .masks = 0,
              .node4 = grid.node4.at,
              .children = grid.children.at};
  }

  // What several grids share was planned for each: masks move down to the bricks' end, and the buffer ends with them.
  void finish(const BrickPlaces& bricks, const MaskTable& masks) {
    if (buffer_.empty()) return;
    const std::uint64_t bricksEnd = plan_.bricks.at + bricks.unitsUsed() * format::kBrickUnitBytes;
    const std::uint64_t maskBytes = masks.used * sizeof(format::Mask3);
    if (bricksEnd != plan_.masks.at) {
      std::memmove(buffer_.data() + bricksEnd, buffer_.data() + plan_.masks.at, maskBytes);
    }
    std::uint64_t end = bricksEnd + maskBytes;
    if (masks.used == 0) {
      // The word past the last brick.
      std::fill_n(buffer_.begin() + static_cast<std::ptrdiff_t>(end), kSectionAlign, std::byte{0});
      end += kSectionAlign;
    }
    for (LoadedGrid& grid : frame_.grids) grid.masks = grid.present ? bricksEnd : 0;
    frame_.buffer = buffer_.first(end);
    frame_.atlas = atlas_;
    if (plan_.inAtlas) frame_.shape = plan_.shape;
    count(bricks, maskBytes);
  }

  void count(const BrickPlaces& bricks, std::uint64_t maskBytes) {
    FrameStats& stats = frame_.stats;
    for (const GridPlan& grid : plan_.grids) {
      stats.indexBytes += 4 * (grid.table.count + grid.node4.count + grid.children.count);
      stats.recordBytes += grid.records.count * sizeof(GpuRecord);
    }
    stats.maskBytes = maskBytes;
    stats.bc7Bricks = bricks.blocksUsed();
    stats.bufferBricks = bricks.bricksUsed();
    stats.brickBytes =
        bricks.unitsUsed() * format::kBrickUnitBytes + std::uint64_t{bricks.blocksUsed()} * kAtlasSlotBytes;
  }

  const LoadRequest& request_;
  const LoadPlan& plan_;
  Scratch& scratch_;
  format::PageUnpacker& unpacker_;
  PageItems items_;
  std::span<std::byte> buffer_, atlas_;
  LoadedFrame frame_;
};

}  // namespace

FrameLoader::FrameLoader(std::pmr::memory_resource* memory) : scratch_(memory), unpacker_(memory) {}

Result<LoadedFrame> FrameLoader::load(const LoadRequest& request, std::span<const StoredPage> stored) {
  return guarded<LoadedFrame>([&]() -> Result<LoadedFrame> {
    const auto plan = planLoad(request, stored);
    if (!plan) return tl::unexpected(plan.error());
    scratch_.reset(plan->scratch);
    return Load(request, *plan, scratch_, unpacker_).run(stored);
  });
}

}  // namespace billow::runtime
