#include "stream/load_plan.h"

#include <algorithm>
#include <bit>
#include <string>

#include "api.h"
#include "billow/format/affine.h"
#include "billow/format/brick.h"
#include "billow/format/rule.h"
#include "stream/distance_field.h"
#include "stream/means_builder.h"
#include "stream/page_items.h"

namespace billow::runtime {
namespace {

using format::Stream;
using Items = std::array<std::uint64_t, format::kStreamCount>;

constexpr std::uint64_t kMostContent = std::uint64_t{1} << 32;  // as format::GridView
constexpr std::uint64_t kDecodedUnits = format::kBrickVoxels / format::kBrickUnitBytes;

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + kSectionAlign - 1) / kSectionAlign * kSectionAlign;
}

std::uint64_t of(const Items& items, Stream stream) {
  return items[static_cast<std::size_t>(stream)];
}

void countItems(Items& items, const format::PageRecord& page) {
  for (std::uint32_t s = 0; s < format::kStreamCount; ++s) items[s] += page.streams[s].count;
}

// Whether `pages`, which ascend, have all of `list`, which does too. Counts the list's items.
bool havePages(std::span<const StoredPage> pages, std::span<const std::uint32_t> list, const format::Pack& pack,
               Items& items) {
  auto next = pages.begin();
  for (const std::uint32_t number : list) {
    while (next != pages.end() && next->number < number) ++next;
    if (next == pages.end() || next->number != number) return false;
    countItems(items, pack.pages()[number]);
  }
  return true;
}

// Counts that no tree in these pages can have; null where there are none.
const char* impossibleCount(const format::GridFrame& frame, const Items& items) {
  const auto units = [&](format::BrickClass which) {
    return std::uint64_t{frame.brickUnits[static_cast<std::uint32_t>(which)]};
  };
  if (frame.node4Count > of(items, Stream::node4)) return "Node4s";
  if (frame.node3Count > of(items, Stream::node3)) return "Node3s";
  if (frame.maskCount > of(items, Stream::mask)) return "masks";
  if (frame.tileCount > std::uint64_t{frame.node4Count} + 1) return "values of tiles";
  // Each distinct node is a child once at least.
  if (frame.childCount < std::uint64_t{frame.node4Count} + frame.node3Count) return "child list entries";
  if (frame.childCount > 32768 + std::uint64_t{frame.node4Count} * 4096) return "child list entries";
  // The same blocks may be read along each of three axes.
  const std::uint64_t bc7 = units(format::BrickClass::bc7);
  if (bc7 != std::uint64_t{frame.brickCount[0]} * 4 || bc7 > 3 * of(items, Stream::unit)) return "BC7 units";
  const std::uint64_t others =
      units(format::BrickClass::uniform) + units(format::BrickClass::local) + units(format::BrickClass::coarse);
  return others > of(items, Stream::unit) ? "units" : nullptr;
}

// Node4s stand in as many places as the root has children: all child list entries but those of Node3s, of which each
// has one at least.
std::uint64_t mostPlaces(const format::GridFrame& frame) {
  return std::min<std::uint64_t>(frame.childCount - frame.node3Count, 32768);
}

void sizeGrid(GridPlan& grid) {
  const format::GridFrame& frame = *grid.frame;
  const std::uint64_t places = mostPlaces(frame);
  grid.records.count = std::uint64_t{frame.node3Count} + frame.tileCount;
  grid.masks = frame.maskCount;
  grid.blocks = frame.brickCount[static_cast<std::uint32_t>(format::BrickClass::bc7)];
  for (std::uint32_t c = 1; c < format::kBrickClassCount; ++c) grid.units += frame.brickUnits[c];
  switch (grid.index) {
    case Index::flat:
      grid.table.count = grid.cells.count();
      break;
    case Index::tree:
      grid.table.count = gpu::kTreeNode5Words;
      grid.node4.count = places * gpu::kTreeNode4Words;
      grid.children.count = frame.childCount - frame.node4Count;
      break;
    default:
      grid.table.count = 32768;
      grid.node4.count = places * 4096;
  }
}

void sizeMeans(GridPlan& grid) {
  const std::uint64_t bricks = std::min(grid.cells.count(), 8 * mostPlaces(*grid.frame));
  grid.table.count = grid.cells.count();
  grid.records.count = bricks + grid.frame->tileCount;
  grid.masks = bricks;
  grid.units = bricks * format::brickUnits(encodingOfMeans(*grid.frame));
}

Result<void> planGrid(GridPlan& grid, const LoadRequest& request, std::span<const StoredPage> pages) {
  const format::Pack& pack = *request.pack;
  const format::GridFrame& frame = *grid.frame;
  Items items{};
  if (!havePages(pages, pack.pagesOf(frame), pack, items)) {
    return failure(ErrorCode::argument, "a page that the frame needs was not given");
  }
  if (const char* what = impossibleCount(frame, items)) {
    return packError(format::makeIssue(format::Rule::counts, gridPlace(request, grid.number),
                                       std::string("Its pages cannot have so many ") + what + "."));
  }
  const format::GridFrame means = frameOfMeans(frame);
  if (request.means && !format::invertible(means.indexToWorld)) {
    return failure(ErrorCode::unsupported, "the frame's voxels are too large for coarser ones");
  }
  grid.cells = format::cellBox(request.means ? means : frame);
  grid.index = request.means ? Index::flat : chooseIndex(frame, request.index);
  if (grid.cells.count() == 0) return {};
  grid.tileSlots = std::bit_ceil(std::uint64_t{frame.tileCount} * 2 + 1);
  request.means ? sizeMeans(grid) : sizeGrid(grid);
  return {};
}

void place(Section& section, std::uint64_t itemBytes, std::uint64_t& at) {
  section.at = at;
  at += aligned(section.count * itemBytes);
}

Result<void> placeSections(LoadPlan& plan, const LoadRequest& request) {
  std::uint64_t at = 0, blocks = 0;
  for (GridPlan& grid : plan.grids) {
    if (grid.frame == nullptr || grid.cells.count() == 0) continue;
    place(grid.table, 4, at);
    place(grid.records, sizeof(GpuRecord), at);
    place(grid.node4, 4, at);
    place(grid.children, 4, at);
    plan.masks.count += grid.masks;
    plan.bricks.count += grid.units;
    blocks += grid.blocks;
  }
  plan.inAtlas = request.bc7 && blocks >= std::max(request.leastAtlasBricks, 1u);
  if (!plan.inAtlas) plan.bricks.count += blocks * kDecodedUnits;
  place(plan.bricks, format::kBrickUnitBytes, at);
  if (at / format::kBrickUnitBytes > format::kBrickUnitMask) {
    return failure(ErrorCode::unsupported, "the frame has more than 4 GiB of bricks");
  }
  place(plan.masks, sizeof(format::Mask3), at);
  if (plan.masks.count == 0 && at != 0) at += kSectionAlign;
  plan.bufferBytes = at;
  if (!plan.inAtlas) return {};
  const auto shape = blocks <= format::kBrickUnitMask
                         ? atlasShape(static_cast<std::uint32_t>(blocks), request.maxImageExtent3D)
                         : std::nullopt;
  if (!shape) {
    return failure(ErrorCode::unsupported, "the frame has more bricks than the device's largest 3D image holds");
  }
  plan.shape = *shape;
  return {};
}

void sumScratch(LoadPlan& plan, std::size_t pageCount) {
  for (const GridPlan& grid : plan.grids) {
    plan.tileSlots = std::max(plan.tileSlots, grid.tileSlots);
    if (grid.frame == nullptr || grid.index != Index::flat) continue;
    plan.distanceBytes = std::max(plan.distanceBytes, DistanceField::scratchOf(grid.cells));
  }
  plan.scratch = plan.contentBytes + format::kStreamCount * scratchBytes(pageCount * sizeof(PageItems::Run));
  for (const Stream stream : {Stream::unit, Stream::mask, Stream::node3, Stream::node4}) {
    plan.scratch += scratchBytes(of(plan.items, stream) * 4);
  }
  plan.scratch += scratchBytes(plan.tileSlots * 4) + scratchBytes(plan.distanceBytes) + scratchBytes(plan.bufferBytes) +
                  scratchBytes(plan.means * sizeof(float));
  if (plan.inAtlas) plan.scratch += scratchBytes(plan.shape.bytes());
}

}  // namespace

std::array<std::uint32_t, gpu::kGridSlots> gridsBySlot(const GridChoice& choice) {
  return {choice.extinction, choice.temperature, choice.flames, choice.velocityX, choice.velocityY, choice.velocityZ};
}

bool isPresent(const format::GridFrame& frame) {
  return (frame.flags & format::kGridPresent) != 0 && frame.node5 != format::kNone;
}

Index chooseIndex(const format::GridFrame& frame, Index wanted) {
  if (wanted != Index::automatic) return wanted;
  return format::gpuBytes(frame).index == format::GpuIndex::flat ? Index::flat : Index::tree;
}

format::Place gridPlace(const LoadRequest& request, std::uint32_t grid) {
  const format::VolumeRecord& volume = request.pack->volumes()[request.volume];
  return {.section = "GFRM",
          .volume = request.volume,
          .frame = request.pack->framesOf(volume)[request.frame].number,
          .grid = grid};
}

tl::unexpected<Error> packError(const format::Issue& issue) {
  return tl::unexpected(Error{.code = ErrorCode::pack, .message = toString(issue), .issue = issue});
}

Result<LoadPlan> planLoad(const LoadRequest& request, std::span<const StoredPage> pages) {
  const format::Pack& pack = *request.pack;
  if (request.volume >= pack.volumes().size()) return failure(ErrorCode::argument, "the pack has no such volume");
  const format::VolumeRecord& volume = pack.volumes()[request.volume];
  if (request.frame >= volume.frameCount) return failure(ErrorCode::argument, "the volume has no such frame");
  LoadPlan plan;
  plan.means = request.means ? kNode4Cells : 0;
  std::uint64_t content = 0;
  for (std::size_t i = 0; i < pages.size(); ++i) {
    const std::uint32_t number = pages[i].number;
    if (number >= pack.pages().size() || (i > 0 && number <= pages[i - 1].number)) {
      return failure(ErrorCode::argument, "pages are not the pack's, or not in order");
    }
    countItems(plan.items, pack.pages()[number]);
    content += pack.pages()[number].rawSize;
    plan.contentBytes += scratchBytes(pack.pages()[number].rawSize);
  }
  if (content > kMostContent) {
    return packError(format::makeIssue(
        format::Rule::frameLimit, gridPlace(request, 0),
        "Its " + std::to_string(pages.size()) + " pages unpack to " + std::to_string(content) + " bytes."));
  }
  const auto numbers = gridsBySlot(request.grids);
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (numbers[slot] == format::kNone) continue;
    if (numbers[slot] >= volume.gridCount) return failure(ErrorCode::argument, "the volume has no such grid");
    const format::GridFrame& frame = pack.gridFrame(volume, request.frame, numbers[slot]);
    if (!isPresent(frame)) continue;
    GridPlan& grid = plan.grids[slot];
    grid.frame = &frame;
    grid.number = numbers[slot];
    if (auto done = planGrid(grid, request, pages); !done) return tl::unexpected(done.error());
  }
  if (auto placed = placeSections(plan, request); !placed) return tl::unexpected(placed.error());
  sumScratch(plan, pages.size());
  return plan;
}

std::vector<std::uint32_t> pagesOf(const LoadRequest& request) {
  const format::Pack& pack = *request.pack;
  const format::VolumeRecord& volume = pack.volumes()[request.volume];
  std::vector<std::uint32_t> pages;
  for (const std::uint32_t number : gridsBySlot(request.grids)) {
    if (number == format::kNone) continue;
    const auto list = pack.pagesOf(pack.gridFrame(volume, request.frame, number));
    pages.insert(pages.end(), list.begin(), list.end());
  }
  std::sort(pages.begin(), pages.end());
  pages.erase(std::unique(pages.begin(), pages.end()), pages.end());
  return pages;
}

std::uint64_t scratchBound(const LoadRequest& request) {
  std::vector<StoredPage> pages;
  for (const std::uint32_t number : pagesOf(request)) pages.push_back({.number = number, .bytes = {}});
  const auto plan = planLoad(request, pages);
  return plan ? plan->scratch + format::PageUnpacker::workBytes() : 0;
}

}  // namespace billow::runtime
