#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "billow/runtime/runtime.h"
#include "checks.h"
#include "debug.h"
#include "frame.h"
#include "params.h"
#include "passes.h"
#include "upload.h"

namespace billow::runtime {
namespace {

bool sampled3D(const Device& device, VkFormat format) {
  VkFormatProperties properties{};
  device.api.vkGetPhysicalDeviceFormatProperties(device.host.physicalDevice, format, &properties);
  if ((properties.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT) == 0) return false;
  VkImageFormatProperties limits{};
  return device.api.vkGetPhysicalDeviceImageFormatProperties(
             device.host.physicalDevice, format, VK_IMAGE_TYPE_3D, VK_IMAGE_TILING_OPTIMAL,
             VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT, 0, &limits) == VK_SUCCESS;
}

Result<void> describeFamilies(Device& device) {
  std::uint32_t count = 0;
  device.api.vkGetPhysicalDeviceQueueFamilyProperties(device.host.physicalDevice, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  device.api.vkGetPhysicalDeviceQueueFamilyProperties(device.host.physicalDevice, &count, families.data());
  for (const auto& [family, what] :
       {std::pair{device.host.uploadFamily, "uploads"}, std::pair{device.host.drawFamily, "draws"}}) {
    if (family < count) continue;
    return failure(ErrorCode::argument,
                   "HostDevice: there is no queue family " + std::to_string(family) + " for " + what);
  }
  device.uploadGranularity = families[device.host.uploadFamily].minImageTransferGranularity;
  return {};
}

Result<void> describeDevice(Device& device, BlockUse use) {
  auto allocations =
      begin<VkPhysicalDeviceMaintenance3Properties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES);
  auto buffers =
      begin<VkPhysicalDeviceMaintenance4Properties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES);
  auto properties = begin<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  properties.pNext = &allocations;
  allocations.pNext = &buffers;
  device.api.vkGetPhysicalDeviceProperties2(device.host.physicalDevice, &properties);
  if (properties.properties.apiVersion < VK_API_VERSION_1_3) {
    return failure(ErrorCode::unsupported, std::string(properties.properties.deviceName) + " has no Vulkan 1.3");
  }
  device.maxImageExtent3D = properties.properties.limits.maxImageDimension3D;
  device.mostAllocation = std::min<std::uint64_t>(allocations.maxMemoryAllocationSize, buffers.maxBufferSize);
  device.imageGranularity = properties.properties.limits.bufferImageGranularity;
  device.api.vkGetPhysicalDeviceMemoryProperties(device.host.physicalDevice, &device.memory);
  device.bc7 = device.host.textureCompressionBc && sampled3D(device, VK_FORMAT_BC7_UNORM_BLOCK);
  // In software a block is decoded anew for each texel that is read, which takes several times as long.
  const bool software = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  if (use == BlockUse::decoded || (use == BlockUse::automatic && software)) device.bc7 = false;
  device.leastAtlasBricks = use == BlockUse::native ? 1 : kLeastAtlasBricks;
  return describeFamilies(device);
}

// Every feature that is not enabled, with what it is for; "" where none is missing.
std::string missingFeatures(const EnabledFeatures& features) {
  const std::pair<bool, const char*> needed[] = {
      {features.bufferDeviceAddress, "bufferDeviceAddress (shaders find frames by address)"},
      {features.timelineSemaphore, "timelineSemaphore (uploads are waited for by value)"},
      {features.synchronization2, "synchronization2 (barriers and submissions)"}};
  std::string missing;
  for (const auto& [enabled, name] : needed) {
    if (enabled) continue;
    missing += missing.empty() ? "HostDevice: the device was created without " : ", ";
    missing += name;
  }
  return missing;
}

const char* badField(const DrawInfo& draw) {
  if (const char* field = badLayers(draw.frame, draw.layers)) return field;
  if (draw.width == 0 || draw.height == 0) return "width, height";
  if (draw.color == VK_NULL_HANDLE || draw.depth == VK_NULL_HANDLE) return "color, depth";
  for (const char* field : {badView(draw.view), badSun(draw.sun), badBackground(draw.background), badLook(draw.look),
                            badQuality(draw.quality)}) {
    if (field != nullptr) return field;
  }
  return nullptr;
}

class RendererImpl final : public Renderer {
 public:
  RendererImpl(const HostDevice& host, const Api& api, const Config& config)
      : device_{.host = host, .api = api, .memory = {}, .budget = config.gpuBudget},
        passes_(device_, config.recordsInFlight),
        uploads_(device_) {}

  Result<void> initialise(const Config& config) {
    if (auto known = describeDevice(device_, config.blocks); !known) return known;
    if (auto made = passes_.create(); !made) return made;
    return uploads_.create();
  }

  Result<std::unique_ptr<Frame>> upload(const format::Pack& pack, std::uint32_t volume, std::uint32_t frame,
                                        const UploadOptions& options) override {
    return guarded<std::unique_ptr<Frame>>([&]() -> Result<std::unique_ptr<Frame>> {
      uploads_.collect();
      FrameLoader loader(std::pmr::new_delete_resource());
      const auto loaded = readFrame(device_, pack, volume, frame, options, loader);
      if (!loaded) return tl::unexpected(loaded.error());
      auto objects = makeFrameObjects(device_, *loaded);
      if (!objects) return tl::unexpected(objects.error());
      if (auto done = uploads_.submit(*objects); !done) return tl::unexpected(done.error());
      return std::unique_ptr<Frame>(std::move(objects->frame));
    });
  }

  Result<void> prepare(const format::Pack& pack, std::uint32_t volume, const UploadOptions& options,
                       const Quality& quality, ColorFormat colorFormat) override {
    return guarded<void>([&]() -> Result<void> {
      if (const char* field = badQuality(quality)) return failure(ErrorCode::argument, badMessage(field));
      if (volume >= pack.volumes().size()) return failure(ErrorCode::argument, "the pack has no such volume");
      for (std::uint32_t frame = 0; frame < pack.volumes()[volume].frameCount; ++frame) {
        const auto indices = frameIndices(pack, pack.volumes()[volume], frame, options);
        if (!indices) return tl::unexpected(indices.error());
        const auto made =
            passes_.pipeline(passKey(matterOf(*indices), marchOf(colorFormat), quality.filter, quality.shadows));
        if (!made) return tl::unexpected(made.error());
      }
      return {};
    });
  }

  VkSemaphore uploadSemaphore() const override { return uploads_.semaphore(); }

  Result<void> record(VkCommandBuffer commands, const DrawInfo& draw) override {
    return guarded<void>([&] { return recordMarch(commands, draw); });
  }

  Result<void> recordLookup(VkCommandBuffer commands, const LookupInfo& lookup) override {
    return guarded<void>([&] { return recordVoxels(commands, lookup); });
  }

  std::uint64_t bytesInUse() const override { return device_.used; }

 private:
  Device& device() override { return device_; }
  static std::string badMessage(const char* field) {
    return std::string("DrawInfo: ") + field + " is outside of its range";
  }
  static Shader marchOf(ColorFormat format) {
    return format == ColorFormat::half ? Shader::marchHalf : Shader::marchSingle;
  }

  Result<void> recordMarch(VkCommandBuffer commands, const DrawInfo& draw) {
    if (const char* field = badField(draw)) return failure(ErrorCode::argument, badMessage(field));
    const std::vector<Layer> layers = layersOf(draw.frame, draw.layers);
    const PassKey key = keyOf(layers, draw);
    const auto pipeline = passes_.pipeline(key);
    if (!pipeline) return tl::unexpected(pipeline.error());
    const DebugLabel label(device_.api, commands, "billow march");
    bindMarch(commands, layers, draw);
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *pipeline);
    device_.api.vkCmdDispatch(commands, (draw.width + 7) / 8, (draw.height + 7) / 8, 1);
    return {};
  }

  // Nothing, or one layer that stays where it is: these have a shader of their own.
  static bool plain(std::span<const Layer> layers) { return layers.size() <= 1; }

  static PassKey keyOf(std::span<const Layer> layers, const DrawInfo& draw) {
    const Quality& quality = draw.quality;
    const bool half = draw.colorFormat == ColorFormat::half;
    const Shader shader = plain(layers) ? marchOf(draw.colorFormat)
                          : half        ? Shader::marchLayersHalf
                                        : Shader::marchLayersSingle;
    PassKey key = passKey(layers, shader, quality.filter, quality.shadows);
    if (plain(layers)) key.layers = 1;
    return key;
  }

  void bindMarch(VkCommandBuffer commands, std::span<const Layer> layers, const DrawInfo& draw) {
    std::vector<VkImageView> atlases;
    for (const Layer& layer : layers) atlases.push_back(frameOf(layer).atlas_);
    if (!plain(layers)) {
      const LayeredParams params = layeredParams(layers, draw);
      passes_.bind(commands, atlases, std::as_bytes(std::span(&params, 1)), draw.color, draw.depth);
      return;
    }
    // Of nothing, any frame's atlas is bound, and not read.
    const Layer any{.frame = draw.frame != nullptr ? draw.frame : draw.layers[0].frame};
    const Layer& layer = layers.empty() ? any : layers[0];
    if (layers.empty()) atlases.push_back(frameOf(any).atlas_);
    DrawInfo weighted = draw;
    weighted.look.extinctionScale *= layer.weight;
    weighted.look.emissionScale *= layer.weight;
    const gpu::MarchParams params = marchParams(frameOf(layer), weighted);
    passes_.bind(commands, atlases, std::as_bytes(std::span(&params, 1)), draw.color, draw.depth);
  }

  Result<void> recordVoxels(VkCommandBuffer commands, const LookupInfo& lookup) {
    const auto* frame = static_cast<const ResidentFrame*>(lookup.frame);
    if (frame == nullptr || lookup.slot >= gpu::kGridSlots || !frame->grids_[lookup.slot].present) {
      return failure(ErrorCode::argument, "LookupInfo: the frame has no grid in this slot");
    }
    // Every device takes 65535 groups; voxels.comp has 64 lookups in each.
    if (lookup.count == 0 || lookup.count > 65535 * 64) {
      return failure(ErrorCode::argument, "LookupInfo: count is outside of its range");
    }
    if (lookup.filter == Filter::none) return failure(ErrorCode::argument, "LookupInfo: filter is none");
    const auto pipeline = passes_.pipeline(passKey(frame->indices(), Shader::voxels, lookup.filter, Filter::none));
    if (!pipeline) return tl::unexpected(pipeline.error());
    const gpu::MarchParams params = lookupParams(*frame, lookup.filter);
    passes_.bind(commands, {&frame->atlas_, 1}, std::as_bytes(std::span(&params, 1)), VK_NULL_HANDLE, VK_NULL_HANDLE);
    const auto low = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x & 0xffffffffu); };
    const auto high = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x >> 32); };
    const std::uint32_t push[6] = {low(lookup.positions), high(lookup.positions), low(lookup.values),
                                   high(lookup.values),   lookup.count,           lookup.slot};
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *pipeline);
    device_.api.vkCmdPushConstants(commands, passes_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), push);
    device_.api.vkCmdDispatch(commands, (lookup.count + 63) / 64, 1, 1);
    return {};
  }

  Device device_;
  Passes passes_;
  Uploads uploads_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(const HostDevice& host, const Config& config) {
  if (host.getInstanceProcAddr == nullptr || host.device == VK_NULL_HANDLE || host.uploadQueue == VK_NULL_HANDLE) {
    return failure(ErrorCode::argument, "HostDevice: a handle is missing");
  }
  if (std::string missing = missingFeatures(host.features); !missing.empty()) {
    return failure(ErrorCode::unsupported, std::move(missing));
  }
  if (config.recordsInFlight == 0) return failure(ErrorCode::argument, "Config: recordsInFlight is 0");
  return guarded<std::unique_ptr<Renderer>>([&]() -> Result<std::unique_ptr<Renderer>> {
    const auto api = loadApi(host);
    if (!api) return tl::unexpected(api.error());
    auto renderer = std::make_unique<RendererImpl>(host, *api, config);
    if (auto ready = renderer->initialise(config); !ready) return tl::unexpected(ready.error());
    return std::unique_ptr<Renderer>(std::move(renderer));
  });
}

}  // namespace billow::runtime
