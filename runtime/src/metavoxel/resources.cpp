#include "resources.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "billow/format/gpu_size.h"
#include "params.h"

namespace billow::runtime {
namespace {

constexpr std::uint32_t kFace = gpu::kCubeFaceTexels;
static_assert(kFace == format::kCubeEdge + 2 && gpu::kCubeLayers == format::kCubeFaces);
static_assert(format::kGpuCubeBytes == std::uint64_t{kFace} * kFace * gpu::kCubeLayers);

template <class T>
Result<void> keep(Result<T> made, T& place) {
  if (!made) return tl::unexpected(made.error());
  place = std::move(*made);
  return {};
}

// The sections of the tables' staging memory, and where all but the last go.
struct TableParts {
  std::uint64_t materials, curves, ramps, emitters, points, radii, given, surfaces, cubes, bytes;
};

TableParts tableParts(const MetavoxelSizes& sizes) {
  const MetavoxelRegions& regions = sizes.regions;
  TableParts parts{};
  parts.curves = regions.curves - regions.materials;
  parts.ramps = regions.ramps - regions.materials;
  parts.emitters = regions.emitters - regions.materials;
  parts.points = regions.points - regions.materials;
  parts.radii = regions.radii - regions.materials;
  parts.given = regions.given - regions.materials;
  parts.surfaces = regions.surfaces - regions.materials;
  parts.cubes = regions.columns - regions.materials;
  parts.bytes = parts.cubes + std::uint64_t{sizes.cubeLayers} * kFace * kFace;
  return parts;
}

// A face with the texels of its neighbours around it, so that hardware filters across the edges of the cube as
// DecodedCube::sample does.
void writeFace(const format::DecodedCube& cube, std::uint32_t face, std::span<std::byte> out) {
  constexpr auto kEdge = static_cast<float>(format::kCubeEdge);
  const auto index = [](float share) {
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(share * kEdge), 0, int{format::kCubeEdge} - 1));
  };
  for (std::uint32_t y = 0; y < kFace; ++y) {
    for (std::uint32_t x = 0; x < kFace; ++x) {
      const auto share = [](std::uint32_t at) { return (static_cast<float>(at) - 0.5f) / kEdge; };
      const format::CubePoint point = format::cubePoint(format::cubeDirection({face, share(x), share(y)}));
      const float value = cube.texel(point.face, index(point.u), index(point.v));
      out[y * kFace + x] = static_cast<std::byte>(std::lround(value * 255));
    }
  }
}

void imageBarrier(const Device& device, VkCommandBuffer commands, const Image& image, VkImageLayout from,
                  VkImageLayout to) {
  auto barrier = begin<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  barrier.srcStageMask = barrier.dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  barrier.srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;
  barrier.oldLayout = from;
  barrier.newLayout = to;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image.handle();
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  auto info = begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  device.api.vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace

MetavoxelResources::~MetavoxelResources() {
  if (sampler != VK_NULL_HANDLE)
    device_.api.vkDestroySampler(device_.host.device, sampler, device_.host.allocationCallbacks);
}

std::uint64_t MetavoxelResources::bytes() const {
  std::uint64_t sum = 0;
  for (const Buffer* buffer : {&arrays, &uploads, &counters, &tables_}) sum += buffer->allocationSize();
  for (const Image* image : {&pool, &cubes, &shadow, &pyramid, &field}) sum += image->allocationSize();
  return sum;
}

MetavoxelUpload MetavoxelResources::uploadOf(std::uint32_t inFlight) const {
  const std::uint64_t at = inFlight * uploadStride_;
  const std::uint64_t space = at + kMarchStride * (1 + layers_);
  return {.view = at, .layers = at + kMarchStride, .space = space, .particles = space + kMarchStride};
}

void MetavoxelResources::addAddresses(gpu::MetavoxelParams& params) const {
  const MetavoxelRegions& r = sizes_.regions;
  const auto both = [&](std::uint64_t a, std::uint64_t b) { return addresses(address(a), address(b)); };
  params.cells = both(r.words, r.positions);
  params.items = both(r.found, r.cellAt);
  params.lists = both(r.lists, r.cursors);
  params.entries = both(r.entries, r.particles);
  params.texels = both(r.emission, r.columns);
  params.tables = both(r.materials, r.curves);
  params.ramps = both(r.ramps, r.counters);
  params.rounds = both(r.rounds, r.blocks);
  params.work = both(r.volumeWork, r.fillWork);
  params.emitters = both(r.emitters, r.points);
  params.spawn = both(r.jobs, 0);
  params.surfaces = both(r.surfaces, r.given);
  params.radii = both(r.radii, 0);
  params.radii.z = hasRadii_ ? 1 : 0;
  params.kept = both(r.kept, r.slots);
  params.spare = both(r.spare, r.fills);
  params.matter.x = both(r.albedo, 0).x;
  params.matter.y = both(r.albedo, 0).y;
  params.fieldMatter = both(r.fieldMatter, 0);
}

Result<void> MetavoxelResources::create(const MetavoxelConfig& config) {
  const std::size_t maps = config.tables != nullptr ? config.tables->maps.size() : 0;
  if (maps > device_.maxImageExtent3D / gpu::kCubeLayers) {
    return failure(ErrorCode::argument, "MetavoxelConfig: tables have " + std::to_string(maps) +
                                            " cube maps; this device takes " +
                                            std::to_string(device_.maxImageExtent3D / gpu::kCubeLayers));
  }
  layers_ = config.maxVolumes * kMostLayers;
  hasRadii_ = config.tables != nullptr && format::haveRadii(config.tables->tracks);
  const std::uint64_t particleBytes = std::uint64_t{config.maxParticles} * sizeof(format::Particle);
  static_assert(sizeof(gpu::MetavoxelParams) <= kMarchStride);
  uploadStride_ = (kMarchStride * (2 + layers_) + particleBytes + 255) / 256 * 256;
  const std::uint64_t slotBytes = texelBytes(config) * config.edge * config.edge * config.edge;
  // What the device asks for is known only once objects are made, so the pool shrinks until all of it fits.
  std::uint64_t slots = config.maxMetavoxels + 63;
  for (;;) {
    if (auto made = makeAll(config, slots); !made) return made;
    const std::uint64_t needed = bytes();
    if (needed <= config.memoryBudget) break;
    const std::uint64_t excess = (needed - config.memoryBudget + slotBytes - 1) / slotBytes;
    if (excess >= sizes_.slots()) {
      return failure(ErrorCode::budget, "MetavoxelConfig: memoryBudget is " + std::to_string(config.memoryBudget) +
                                            " bytes, but lists and one metavoxel take " +
                                            std::to_string(needed - (sizes_.slots() - 1) * slotBytes));
    }
    slots = sizes_.slots() - excess;
  }
  if (sizes_.rounds > kMostRounds) {
    return failure(ErrorCode::budget, "MetavoxelConfig: memoryBudget leaves room for " +
                                          std::to_string(sizes_.slots()) + " metavoxels of maxMetavoxels " +
                                          std::to_string(sizes_.most) + "; at least a 256th is needed");
  }
  if (auto bound = bindAll(); !bound) return bound;
  fillTables(config);
  return createSampler();
}

Result<void> MetavoxelResources::makeAll(const MetavoxelConfig& config, std::uint64_t slots) {
  sizes_ = metavoxelSizes(config, slots, device_.maxImageExtent3D);
  const std::uint32_t edge = sizes_.edge, shadowEdge = sizes_.shadowEdge();
  const VkBufferUsageFlags transfer = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  const VkImageUsageFlags used = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT;
  if (auto made =
          keep(Buffer::make(device_, "billow metavoxel arrays", sizes_.regions.bytes,
                            transfer | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                                VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT),
               arrays);
      !made) {
    return made;
  }
  if (auto made = keep(Buffer::make(device_, "billow metavoxel uploads", uploadStride_ * config.recordsInFlight,
                                    VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT),
                       uploads);
      !made) {
    return made;
  }
  if (auto made =
          keep(Buffer::make(device_, "billow metavoxel counters",
                            sizeof(gpu::MetavoxelCounters) * config.recordsInFlight, VK_BUFFER_USAGE_TRANSFER_DST_BIT),
               counters);
      !made) {
    return made;
  }
  if (auto made = keep(
          Buffer::make(device_, "billow metavoxel tables", tableParts(sizes_).bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT),
          tables_);
      !made) {
    return made;
  }
  if (auto made = keep(Image::make(device_, "billow metavoxel pool",
                                   {.format = VK_FORMAT_R16G16B16A16_SFLOAT,
                                    .extent = {sizes_.slotsX * edge, sizes_.slotsY * edge, sizes_.slotsZ * edge},
                                    .usage = used}),
                       pool);
      !made) {
    return made;
  }
  if (auto made = keep(Image::make(device_, "billow displacement maps",
                                   {.format = VK_FORMAT_R8_UNORM, .extent = {kFace, kFace, sizes_.cubeLayers}}),
                       cubes);
      !made) {
    return made;
  }
  if (auto made = keep(Image::make(device_, "billow shadow",
                                   {.format = VK_FORMAT_R32_SFLOAT,
                                    .extent = {shadowEdge, shadowEdge, 1},
                                    .type = VK_IMAGE_TYPE_2D,
                                    .usage = used | VK_IMAGE_USAGE_TRANSFER_SRC_BIT}),
                       shadow);
      !made) {
    return made;
  }
  return sizes_.field.edge != 0 ? makeField() : Result<void>{};
}

Result<void> MetavoxelResources::makeField() {
  const FieldSizes& sizes = sizes_.field;
  const VkImageUsageFlags used = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT;
  if (auto made = keep(Image::make(device_, "billow light pyramid",
                                   {.format = VK_FORMAT_R16G16B16A16_SFLOAT,
                                    .extent = {sizes.image[0], sizes.image[1], sizes.image[2]},
                                    .usage = used | VK_IMAGE_USAGE_TRANSFER_DST_BIT}),
                       pyramid);
      !made) {
    return made;
  }
  return keep(
      Image::make(
          device_, "billow light field",
          {.format = VK_FORMAT_R16G16B16A16_SFLOAT, .extent = {sizes.edge, sizes.edge, sizes.edge}, .usage = used}),
      field);
}

Result<void> MetavoxelResources::bindAll() {
  if (auto bound = arrays.bind(Placement::device); !bound) return bound;
  for (Buffer* buffer : {&uploads, &counters, &tables_}) {
    if (auto bound = buffer->bind(Placement::mapped); !bound) return bound;
  }
  for (Image* image : {&pool, &cubes, &shadow, &pyramid, &field}) {
    if (image->handle() == VK_NULL_HANDLE) continue;
    if (auto bound = image->bind(); !bound) return bound;
  }
  const std::span<std::byte> read = counters.mapped();
  std::fill(read.begin(), read.end(), std::byte{0});
  return {};
}

Result<void> MetavoxelResources::createSampler() {
  auto info = begin<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
  info.magFilter = info.minFilter = VK_FILTER_LINEAR;
  info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  const VkResult result =
      device_.api.vkCreateSampler(device_.host.device, &info, device_.host.allocationCallbacks, &sampler);
  if (result != VK_SUCCESS) return vulkanError("vkCreateSampler", result);
  return {};
}

void MetavoxelResources::fillTables(const MetavoxelConfig& config) {
  const std::span<std::byte> bytes = tables_.mapped();
  std::fill(bytes.begin(), bytes.end(), std::byte{0});
  if (config.tables == nullptr) return;
  const TableParts parts = tableParts(sizes_);
  const auto copy = [&](const auto& rows, std::uint64_t at) {
    const auto from = std::as_bytes(std::span(rows));
    if (!from.empty()) std::memcpy(bytes.subspan(at, from.size()).data(), from.data(), from.size());
  };
  copy(config.tables->materials, parts.materials);
  copy(config.tables->curves, parts.curves);
  copy(config.tables->ramps, parts.ramps);
  copy(config.tables->emitters, parts.emitters);
  copy(config.tables->given, parts.given);
  copy(config.tables->surfacePoints, parts.surfaces);
  static_assert(sizeof(format::TrackPoint) == 16);
  std::uint64_t at = parts.points;
  for (const auto& frame : config.tables->trackPoints) {
    copy(frame, at);
    at += frame.size() * sizeof(format::TrackPoint);
  }
  at = parts.radii;
  for (std::size_t f = 0; hasRadii_ && f < config.tables->trackPoints.size(); ++f) {
    std::vector<float> radii = config.tables->trackRadii[f];
    radii.resize(config.tables->trackPoints[f].size(), 1);
    copy(radii, at);
    at += radii.size() * sizeof(float);
  }
  at = parts.cubes;
  for (const format::CubeMap& map : config.tables->maps) {
    const format::DecodedCube cube(map);
    for (std::uint32_t face = 0; face < format::kCubeFaces; ++face, at += kFace * kFace) {
      writeFace(cube, face, bytes.subspan(at, kFace * kFace));
    }
  }
}

void MetavoxelResources::recordFirst(VkCommandBuffer commands) const {
  const TableParts parts = tableParts(sizes_);
  const MetavoxelRegions& regions = sizes_.regions;
  for (const Image* image : {&pool, &shadow, &pyramid, &field}) {
    if (image->handle() == VK_NULL_HANDLE) continue;
    imageBarrier(device_, commands, *image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL);
  }
  imageBarrier(device_, commands, cubes, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  device_.api.vkCmdFillBuffer(commands, arrays.handle(), 0, regions.particles, 0);
  device_.api.vkCmdFillBuffer(commands, arrays.handle(), regions.blocks, sizes_.blocks() * 4, gpu::kBlockStale);
  if (pyramid.handle() != VK_NULL_HANDLE) {
    // Borders stay empty. What lies beyond them is read with a weight of 0, and must be a number.
    const VkClearColorValue none{};
    const VkImageSubresourceRange whole{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    device_.api.vkCmdClearColorImage(commands, pyramid.handle(), VK_IMAGE_LAYOUT_GENERAL, &none, 1, &whole);
  }
  const VkBufferCopy copy{parts.materials, regions.materials, parts.cubes};
  device_.api.vkCmdCopyBuffer(commands, tables_.handle(), arrays.handle(), 1, &copy);
  VkBufferImageCopy faces{};
  faces.bufferOffset = parts.cubes;
  faces.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  faces.imageExtent = cubes.extent();
  device_.api.vkCmdCopyBufferToImage(commands, tables_.handle(), cubes.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                     1, &faces);
  imageBarrier(device_, commands, cubes, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
               VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

}  // namespace billow::runtime
