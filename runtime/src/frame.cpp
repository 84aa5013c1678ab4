#include "frame.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "billow/format/rule.h"
#include "stream/load_plan.h"

namespace billow::runtime {
namespace {

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + kSectionAlign - 1) / kSectionAlign * kSectionAlign;
}

void fillStaging(const LoadedFrame& loaded, const FrameObjects& objects) {
  const std::span<std::byte> bytes = objects.staging.mapped();
  const auto put = [&](std::uint64_t at, std::span<const std::byte> from) {
    if (!from.empty()) std::memcpy(bytes.subspan(at, from.size()).data(), from.data(), from.size());
  };
  put(0, loaded.buffer);
  put(objects.atlasOffset, loaded.atlas);
  if (loaded.atlas.empty()) bytes[objects.atlasOffset] = std::byte{0};
}

Result<void> createObjects(Device& device, const LoadedFrame& loaded, FrameObjects& objects) {
  ResidentFrame& frame = *objects.frame;
  auto memory = std::make_unique<OwnMemory>();
  objects.memory = memory.get();
  frame.memory_ = std::move(memory);
  objects.bufferBytes = loaded.buffer.size();
  const std::uint64_t bufferBytes = std::max<std::uint64_t>(loaded.buffer.size(), kSectionAlign);
  auto buffer = Buffer::make(device, "billow frame", bufferBytes,
                             VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                 VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT);
  if (!buffer) return tl::unexpected(buffer.error());
  objects.memory->buffer = std::move(*buffer);
  frame.stats_.allocatedBytes = objects.memory->buffer.allocationSize();
  frame.shape_ = loaded.shape;
  auto image =
      Image::make(device, "billow frame atlas", {.format = loaded.shape.format(), .extent = loaded.shape.extent()});
  if (!image) return tl::unexpected(image.error());
  objects.memory->atlas = std::move(*image);
  frame.stats_.allocatedBytes += objects.memory->atlas.allocationSize();
  objects.atlasOffset = aligned(bufferBytes);
  auto staging = Buffer::make(device, "billow staging", objects.atlasOffset + loaded.shape.bytes(),
                              VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
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

// The request for a frame of a volume that exists; its grids are.
Result<GridChoice> chosenGrids(const format::Pack& pack, const format::VolumeRecord& volume,
                               const UploadOptions& options) {
  const GridChoice choice = options.grids.value_or(chooseGrids(pack, volume));
  for (const std::uint32_t number : gridsBySlot(choice)) {
    if (number == format::kNone || number < volume.gridCount) continue;
    return failure(ErrorCode::argument, "the volume has no such grid");
  }
  return choice;
}

// Reads the stored bytes of pages into `room`.
Result<std::vector<StoredPage>> readPages(const format::Pack& pack, std::span<const std::uint32_t> numbers,
                                          std::vector<std::byte>& room) {
  std::size_t bytes = 0;
  for (const std::uint32_t number : numbers) bytes += pack.pages()[number].storedSize;
  room.resize(bytes);
  std::vector<StoredPage> pages;
  std::span<std::byte> rest(room);
  for (const std::uint32_t number : numbers) {
    const format::Place place = format::placeOfPage(pack, number);
    const std::span<std::byte> page = rest.first(pack.pages()[number].storedSize);
    rest = rest.subspan(page.size());
    if (!place.offset || !pack.source().read(*place.offset, page)) {
      return packError(
          format::makeIssue(format::Rule::cannotRead, place, std::to_string(page.size()) + " bytes cannot be read."));
    }
    pages.push_back({.number = number, .bytes = page});
  }
  return pages;
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
  const auto choice = chosenGrids(pack, volume, options);
  if (!choice) return tl::unexpected(choice.error());
  const auto numbers = gridsBySlot(*choice);
  FrameIndices indices;
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (numbers[slot] == format::kNone) continue;
    const format::GridFrame& gridFrame = pack.gridFrame(volume, frame, numbers[slot]);
    if (isPresent(gridFrame)) indices[slot] = options.means ? Index::flat : chooseIndex(gridFrame, options.index);
  }
  return indices;
}

bool ResidentFrame::empty() const {
  return std::none_of(grids_.begin(), grids_.begin() + gpu::kMatterSlots,
                      [](const ResidentGrid& grid) { return grid.present; });
}

FrameIndices matterOf(FrameIndices indices) {
  std::fill(indices.begin() + gpu::kMatterSlots, indices.end(), std::nullopt);
  return indices;
}

Result<LoadedFrame> readFrame(const Device& device, const format::Pack& pack, std::uint32_t volume, std::uint32_t frame,
                              const UploadOptions& options, FrameLoader& loader) {
  if (volume >= pack.volumes().size()) return failure(ErrorCode::argument, "the pack has no such volume");
  const format::VolumeRecord& record = pack.volumes()[volume];
  if (frame >= record.frameCount) return failure(ErrorCode::argument, "the volume has no such frame");
  const auto grids = chosenGrids(pack, record, options);
  if (!grids) return tl::unexpected(grids.error());
  const LoadRequest request{.pack = &pack,
                            .volume = volume,
                            .frame = frame,
                            .grids = *grids,
                            .index = options.index,
                            .means = options.means,
                            .bc7 = device.bc7,
                            .leastAtlasBricks = device.leastAtlasBricks,
                            .maxImageExtent3D = device.maxImageExtent3D};
  std::vector<std::byte> room;
  const auto pages = readPages(pack, pagesOf(request), room);
  if (!pages) return tl::unexpected(pages.error());
  return loader.load(request, *pages);
}

ResidentGrid residentGrid(const LoadedGrid& grid, VkDeviceAddress buffer) {
  ResidentGrid resident{grid};
  for (VkDeviceAddress* at :
       {&resident.table, &resident.records, &resident.masks, &resident.node4, &resident.children}) {
    *at += buffer;
  }
  return resident;
}

Result<FrameObjects> makeFrameObjects(Device& device, const LoadedFrame& loaded) {
  FrameObjects objects;
  objects.frame = std::make_unique<ResidentFrame>();
  objects.frame->stats_ = loaded.stats;
  if (auto made = createObjects(device, loaded, objects); !made) return tl::unexpected(made.error());
  if (auto fits = checkBudget(device, objects); !fits) return tl::unexpected(fits.error());
  if (auto bound = bindObjects(objects); !bound) return tl::unexpected(bound.error());
  objects.frame->number_ = ++device.frames;
  objects.frame->bricks_ = objects.memory->buffer.address();
  objects.frame->atlas_ = objects.memory->atlas.view();
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (loaded.grids[slot].present) {
      objects.frame->grids_[slot] = residentGrid(loaded.grids[slot], objects.frame->bricks_);
    }
  }
  fillStaging(loaded, objects);
  return objects;
}

}  // namespace billow::runtime
