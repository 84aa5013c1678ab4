#include "frame.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace billow::runtime {
namespace {

// A slot of 32 bytes never lies in two sectors of a cache.
constexpr std::uint64_t kSectionAlign = format::kBrickUnitBytes;

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + kSectionAlign - 1) / kSectionAlign * kSectionAlign;
}

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& items) {
  return std::as_bytes(std::span(items));
}

// A grid's arrays in the order in which they lie in the buffer.
std::array<std::span<const std::byte>, 5> sectionsOf(const GpuGrid& grid) {
  return {bytesOf(grid.table), bytesOf(grid.records), bytesOf(grid.masks), bytesOf(grid.node4), bytesOf(grid.children)};
}

bool resident(const format::GridFrame& gridFrame) {
  return (gridFrame.flags & format::kGridPresent) != 0 && gridFrame.node5 != format::kNone;
}

Result<void> stageGrid(StagedFrame& staged, std::uint32_t slot, const format::Pack& pack,
                       const format::GridFrame& gridFrame, Index index) {
  if (!resident(gridFrame)) return {};
  auto view = format::GridView::load(pack, gridFrame);
  if (!view) {
    return tl::unexpected(Error{.code = ErrorCode::pack, .message = toString(view.error()), .issue = view.error()});
  }
  staged.views.push_back(std::move(*view));
  staged.grids[slot] = buildGpuGrid(staged.views.back(), index, staged.slots);
  for (const auto section : sectionsOf(*staged.grids[slot])) staged.bufferBytes += aligned(section.size());
  return {};
}

std::uint64_t bufferBrickBytes(const StagedFrame& staged) {
  return staged.slots.bufferSlots() * format::kBrickUnitBytes;
}

Result<void> placeBricks(StagedFrame& staged, std::uint32_t maxExtent) {
  if (staged.slots.bufferSlots() > format::kBrickUnitMask) {
    return failure(ErrorCode::unsupported, "the frame has more than 4 GiB of bricks");
  }
  staged.bufferBytes += bufferBrickBytes(staged);
  const auto atlasBricks = static_cast<std::uint32_t>(staged.slots.inAtlas().size());
  if (atlasBricks == 0) return {};
  const auto shape = atlasShape(atlasBricks, maxExtent);
  if (!shape) {
    return failure(ErrorCode::unsupported, "the frame has more bricks than the device's largest 3D image holds");
  }
  staged.shape = *shape;
  return {};
}

void countBytes(const StagedFrame& staged, FrameStats& stats) {
  for (const auto& grid : staged.grids) {
    if (!grid) continue;
    stats.indexBytes += grid->indexBytes();
    stats.recordBytes += grid->records.size() * sizeof(GpuRecord);
    stats.maskBytes += grid->masks.size() * sizeof(format::Mask3);
  }
  stats.bc7Bricks = static_cast<std::uint32_t>(staged.slots.inAtlas().size());
  stats.bufferBricks = static_cast<std::uint32_t>(staged.slots.inBuffer().size());
  stats.brickBytes = bufferBrickBytes(staged) + std::uint64_t{stats.bc7Bricks} * kAtlasSlotBytes;
}

ResidentGrid describe(const GpuGrid& grid, VkDeviceAddress& at) {
  ResidentGrid resident{.present = true,
                        .frame = grid.frame,
                        .cells = grid.cells,
                        .index = grid.index,
                        .absent5 = grid.absent5,
                        .skippable = grid.skippable};
  VkDeviceAddress* const addresses[] = {&resident.table, &resident.records, &resident.masks, &resident.node4,
                                        &resident.children};
  std::size_t next = 0;
  for (const auto section : sectionsOf(grid)) {
    *addresses[next++] = at;
    at += aligned(section.size());
  }
  return resident;
}

void fillStaging(const StagedFrame& staged, const FrameObjects& objects) {
  const std::span<std::byte> bytes = objects.staging.mapped();
  std::fill(bytes.begin(), bytes.end(), std::byte{0});
  for (const StoredBrick& brick : staged.slots.inBuffer()) writeBrick(brick, bytes);
  std::uint64_t at = bufferBrickBytes(staged);
  for (const auto& grid : staged.grids) {
    if (!grid) continue;
    for (const auto section : sectionsOf(*grid)) {
      if (!section.empty()) std::memcpy(bytes.subspan(at, section.size()).data(), section.data(), section.size());
      at += aligned(section.size());
    }
  }
  const std::span<std::byte> image = bytes.subspan(objects.atlasOffset, staged.shape.bytes());
  for (const StoredBrick& brick : staged.slots.inAtlas()) writeSlot(staged.shape, brick, image);
}

Result<void> createObjects(Device& device, const StagedFrame& staged, FrameObjects& objects) {
  ResidentFrame& frame = *objects.frame;
  auto memory = std::make_unique<OwnMemory>();
  objects.memory = memory.get();
  frame.memory_ = std::move(memory);
  objects.bufferBytes = staged.bufferBytes;
  const std::uint64_t bufferBytes = std::max<std::uint64_t>(staged.bufferBytes, kSectionAlign);
  auto buffer = Buffer::make(device, bufferBytes,
                             VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                 VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT);
  if (!buffer) return tl::unexpected(buffer.error());
  objects.memory->buffer = std::move(*buffer);
  frame.stats_.allocatedBytes = objects.memory->buffer.allocationSize();
  frame.shape_ = staged.shape;
  auto image = Image::make(device, {.format = staged.shape.format(), .extent = staged.shape.extent()});
  if (!image) return tl::unexpected(image.error());
  objects.memory->atlas = std::move(*image);
  frame.stats_.allocatedBytes += objects.memory->atlas.allocationSize();
  objects.atlasOffset = aligned(bufferBytes);
  auto staging = Buffer::make(device, objects.atlasOffset + staged.shape.bytes(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
  if (!staging) return tl::unexpected(staging.error());
  objects.staging = std::move(*staging);
  return {};
}

Result<void> checkBudget(const Device& device, const FrameObjects& objects) {
  const std::uint64_t needed = objects.frame->stats_.allocatedBytes + objects.staging.allocationSize();
  if (needed <= device.budget - device.used) return {};
  return failure(ErrorCode::budget, "the frame needs " + std::to_string(objects.frame->stats_.allocatedBytes) +
                                        " bytes on the GPU and " + std::to_string(objects.staging.allocationSize()) +
                                        " of staging, but only " + std::to_string(device.budget - device.used) +
                                        " of the budget of " + std::to_string(device.budget) + " are free");
}

Result<void> bindObjects(FrameObjects& objects) {
  if (auto bound = objects.memory->buffer.bind(Placement::device); !bound) return bound;
  if (auto bound = objects.memory->atlas.bind(); !bound) return bound;
  return objects.staging.bind(Placement::mapped);
}

// Grid numbers by slot, each the volume's or kNone.
Result<std::array<std::uint32_t, gpu::kGridSlots>> slotNumbers(const format::Pack& pack,
                                                               const format::VolumeRecord& volume,
                                                               const UploadOptions& options) {
  const GridChoice choice = options.grids.value_or(chooseGrids(pack, volume));
  const std::array<std::uint32_t, gpu::kGridSlots> numbers{choice.extinction, choice.temperature, choice.flames};
  for (const std::uint32_t number : numbers) {
    if (number == format::kNone || number < volume.gridCount) continue;
    return failure(ErrorCode::argument, "the volume has no such grid");
  }
  return numbers;
}

}  // namespace

FrameIndices ResidentFrame::indices() const {
  FrameIndices indices;
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (grids_[slot].present) indices[slot] = grids_[slot].index;
  }
  return indices;
}

Result<FrameIndices> frameIndices(const format::Pack& pack, const format::VolumeRecord& volume, std::uint32_t frame,
                                  const UploadOptions& options) {
  const auto numbers = slotNumbers(pack, volume, options);
  if (!numbers) return tl::unexpected(numbers.error());
  FrameIndices indices;
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if ((*numbers)[slot] == format::kNone) continue;
    const format::GridFrame& gridFrame = pack.gridFrame(volume, frame, (*numbers)[slot]);
    if (resident(gridFrame)) indices[slot] = chooseIndex(gridFrame, options.index);
  }
  return indices;
}

bool ResidentFrame::empty() const {
  return std::none_of(grids_.begin(), grids_.end(), [](const ResidentGrid& grid) { return grid.present; });
}

Result<StagedFrame> stageFrame(const Device& device, const format::Pack& pack, std::uint32_t volume,
                               std::uint32_t frame, const UploadOptions& options) {
  if (volume >= pack.volumes().size()) return failure(ErrorCode::argument, "the pack has no such volume");
  const format::VolumeRecord& record = pack.volumes()[volume];
  if (frame >= record.frameCount) return failure(ErrorCode::argument, "the volume has no such frame");
  const auto numbers = slotNumbers(pack, record, options);
  if (!numbers) return tl::unexpected(numbers.error());
  StagedFrame staged{.views = {}, .grids = {}, .shape = {}, .slots = BrickSlots(device.bc7), .bufferBytes = 0};
  // Views must not move while bricks and masks are read from them.
  staged.views.reserve(gpu::kGridSlots);
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    const std::uint32_t number = (*numbers)[slot];
    if (number == format::kNone) continue;
    const auto done = stageGrid(staged, slot, pack, pack.gridFrame(record, frame, number), options.index);
    if (!done) return tl::unexpected(done.error());
  }
  const auto placed = placeBricks(staged, device.maxImageExtent3D);
  if (!placed) return tl::unexpected(placed.error());
  return staged;
}

Result<FrameObjects> makeFrameObjects(Device& device, const StagedFrame& staged) {
  FrameObjects objects;
  objects.frame = std::make_unique<ResidentFrame>();
  countBytes(staged, objects.frame->stats_);
  if (auto made = createObjects(device, staged, objects); !made) return tl::unexpected(made.error());
  if (auto fits = checkBudget(device, objects); !fits) return tl::unexpected(fits.error());
  if (auto bound = bindObjects(objects); !bound) return tl::unexpected(bound.error());
  objects.frame->number_ = ++device.frames;
  objects.frame->bricks_ = objects.memory->buffer.address();
  objects.frame->atlas_ = objects.memory->atlas.view();
  VkDeviceAddress at = objects.frame->bricks_ + bufferBrickBytes(staged);
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (staged.grids[slot]) objects.frame->grids_[slot] = describe(*staged.grids[slot], at);
  }
  fillStaging(staged, objects);
  return objects;
}

}  // namespace billow::runtime
