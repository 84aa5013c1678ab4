#include <cmath>
#include <string>
#include <utility>

#include "billow/runtime/runtime.h"
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

Result<void> describeDevice(Device& device, BlockUse use) {
  auto properties = begin<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  device.api.vkGetPhysicalDeviceProperties2(device.host.physicalDevice, &properties);
  if (properties.properties.apiVersion < VK_API_VERSION_1_3) {
    return failure(ErrorCode::unsupported, std::string(properties.properties.deviceName) + " has no Vulkan 1.3");
  }
  device.maxImageExtent3D = properties.properties.limits.maxImageDimension3D;
  device.api.vkGetPhysicalDeviceMemoryProperties(device.host.physicalDevice, &device.memory);
  device.bc7 = device.host.textureCompressionBc && sampled3D(device, VK_FORMAT_BC7_UNORM_BLOCK);
  device.bc4 = true;
  // In software a block is decoded anew for each texel that is read: six times as slow as R8.
  const bool software = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  if (use == BlockUse::decoded || (use == BlockUse::automatic && software)) device.bc7 = device.bc4 = false;
  return {};
}

bool finite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

// Names the first field that is outside of what runtime.h allows, or null.
const char* badField(const DrawInfo& draw) {
  const auto positive = [](float value) { return std::isfinite(value) && value > 0; };
  if (draw.frame == nullptr) return "frame";
  if (draw.width == 0 || draw.height == 0) return "width, height";
  if (draw.color == VK_NULL_HANDLE || draw.depth == VK_NULL_HANDLE) return "color, depth";
  if (!positive(draw.view.tanHalfHeight)) return "view.tanHalfHeight";
  const std::array<float, 3>& sun = draw.sun.direction;
  if (!finite(sun) || sun == std::array<float, 3>{0, 0, 0}) return "sun.direction";
  if (!(std::abs(draw.look.anisotropy) < 1)) return "look.anisotropy";
  if (draw.look.scatteringOrders < 1 || draw.look.scatteringOrders > 8) return "look.scatteringOrders";
  if (!positive(draw.look.heatMax)) return "look.heatMax";
  if (!positive(draw.look.referenceKelvin)) return "look.referenceKelvin";
  if (!positive(draw.quality.step)) return "quality.step";
  if (!positive(draw.quality.shadowStep) || draw.quality.shadowSteps == 0) return "quality.shadowStep, shadowSteps";
  if (draw.quality.filter == Filter::none) return "quality.filter";
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
    uploads_.collect();
    const auto staged = stageFrame(device_, pack, volume, frame, options);
    if (!staged) return tl::unexpected(staged.error());
    auto objects = makeFrameObjects(device_, *staged);
    if (!objects) return tl::unexpected(objects.error());
    if (auto done = uploads_.submit(*objects); !done) return tl::unexpected(done.error());
    return std::unique_ptr<Frame>(std::move(objects->frame));
  }

  VkSemaphore uploadSemaphore() const override { return uploads_.semaphore(); }

  Result<void> record(VkCommandBuffer commands, const DrawInfo& draw) override {
    if (const char* field = badField(draw)) {
      return failure(ErrorCode::argument, std::string("DrawInfo: ") + field + " is outside of its range");
    }
    const auto& frame = static_cast<const ResidentFrame&>(*draw.frame);
    const Shader shader = draw.colorFormat == ColorFormat::half ? Shader::marchHalf : Shader::marchSingle;
    const auto pipeline = passes_.pipeline(passKey(frame, shader, draw.quality.filter, draw.quality.shadows));
    if (!pipeline) return tl::unexpected(pipeline.error());
    const auto params = marchParams(frame, draw);
    if (!params) return tl::unexpected(params.error());
    passes_.bind(commands, frame, *params, draw.color, draw.depth);
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *pipeline);
    device_.api.vkCmdDispatch(commands, (draw.width + 7) / 8, (draw.height + 7) / 8, 1);
    return {};
  }

  Result<void> recordLookup(VkCommandBuffer commands, const LookupInfo& lookup) override {
    const auto* frame = static_cast<const ResidentFrame*>(lookup.frame);
    if (frame == nullptr || lookup.slot >= gpu::kGridSlots || !frame->grids_[lookup.slot].present) {
      return failure(ErrorCode::argument, "LookupInfo: the frame has no grid in this slot");
    }
    // Every device takes 65535 groups; voxels.comp has 64 lookups in each.
    if (lookup.count == 0 || lookup.count > 65535 * 64) {
      return failure(ErrorCode::argument, "LookupInfo: count is outside of its range");
    }
    const auto pipeline = passes_.pipeline(passKey(*frame, Shader::voxels, lookup.filter, Filter::none));
    if (!pipeline) return tl::unexpected(pipeline.error());
    const auto params = lookupParams(*frame, lookup.filter);
    if (!params) return tl::unexpected(params.error());
    passes_.bind(commands, *frame, *params, VK_NULL_HANDLE, VK_NULL_HANDLE);
    const auto low = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x & 0xffffffffu); };
    const auto high = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x >> 32); };
    const std::uint32_t push[6] = {low(lookup.positions), high(lookup.positions), low(lookup.values),
                                   high(lookup.values),   lookup.count,           lookup.slot};
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *pipeline);
    device_.api.vkCmdPushConstants(commands, passes_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), push);
    device_.api.vkCmdDispatch(commands, (lookup.count + 63) / 64, 1, 1);
    return {};
  }

  std::uint64_t bytesInUse() const override { return device_.used; }

 private:
  Device device_;
  Passes passes_;
  Uploads uploads_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(const HostDevice& host, const Config& config) {
  if (host.getInstanceProcAddr == nullptr || host.device == VK_NULL_HANDLE || host.uploadQueue == VK_NULL_HANDLE) {
    return failure(ErrorCode::argument, "HostDevice: a handle is missing");
  }
  if (config.recordsInFlight == 0) return failure(ErrorCode::argument, "Config: recordsInFlight is 0");
  const auto api = loadApi(host);
  if (!api) return tl::unexpected(api.error());
  auto renderer = std::make_unique<RendererImpl>(host, *api, config);
  if (auto ready = renderer->initialise(config); !ready) return tl::unexpected(ready.error());
  return std::unique_ptr<Renderer>(std::move(renderer));
}

}  // namespace billow::runtime
