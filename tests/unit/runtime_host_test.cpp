// What the runtime does with what the host lends, seen from between it and Vulkan, and what it refuses.
#include <gtest/gtest.h>

#include <limits>
#include <string_view>

#include "gpu_fixture.h"

namespace billow::tests {
namespace {

using runtime::Filter;

std::vector<std::byte> onePack() {
  return oneGridPack(0, [](GridFrameBuilder& grid) {
    grid.brick({1, 1, 1}, format::kEncodingConstant, {}, 1, 0, format::kMaskAll);
  });
}

// Calls that are counted on their way to the device.
struct Spied {
  PFN_vkGetInstanceProcAddr instanceProc = nullptr;
  PFN_vkGetDeviceProcAddr deviceProc = nullptr;
  PFN_vkCreateComputePipelines createPipelines = nullptr;
  PFN_vkAllocateCommandBuffers allocate = nullptr;
  PFN_vkFreeCommandBuffers free = nullptr;
  VkPipelineCache cache = VK_NULL_HANDLE;
  PFN_vkQueueSubmit2 submit = nullptr;
  bool refuse = false;
  int pipelines = 0;
  int commandBuffers = 0;  // that live
};
Spied spied;

VKAPI_ATTR VkResult VKAPI_CALL createPipelines(VkDevice device, VkPipelineCache cache, std::uint32_t count,
                                               const VkComputePipelineCreateInfo* infos,
                                               const VkAllocationCallbacks* callbacks, VkPipeline* pipelines) {
  ++spied.pipelines;
  spied.cache = cache;
  return spied.createPipelines(device, VK_NULL_HANDLE, count, infos, callbacks, pipelines);
}

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkCommandBufferAllocateInfo* info,
                                        VkCommandBuffer* commands) {
  ++spied.commandBuffers;
  return spied.allocate(device, info, commands);
}

VKAPI_ATTR void VKAPI_CALL freeCommands(VkDevice device, VkCommandPool pool, std::uint32_t count,
                                        const VkCommandBuffer* commands) {
  --spied.commandBuffers;
  spied.free(device, pool, count, commands);
}

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo2* infos, VkFence fence) {
  return spied.refuse ? VK_ERROR_OUT_OF_HOST_MEMORY : spied.submit(queue, count, infos, fence);
}

template <class Function>
PFN_vkVoidFunction swap(PFN_vkVoidFunction real, Function& kept, Function own) {
  kept = reinterpret_cast<Function>(real);
  return reinterpret_cast<PFN_vkVoidFunction>(own);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL deviceProc(VkDevice device, const char* name) {
  const std::string_view wanted = name;
  const PFN_vkVoidFunction real = spied.deviceProc(device, name);
  if (wanted == "vkCreateComputePipelines") return swap(real, spied.createPipelines, &createPipelines);
  if (wanted == "vkAllocateCommandBuffers") return swap(real, spied.allocate, &allocate);
  if (wanted == "vkFreeCommandBuffers") return swap(real, spied.free, &freeCommands);
  if (wanted == "vkQueueSubmit2") return swap(real, spied.submit, &submit);
  return real;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instanceProc(VkInstance instance, const char* name) {
  const PFN_vkVoidFunction real = spied.instanceProc(instance, name);
  if (std::string_view(name) == "vkGetDeviceProcAddr") return swap(real, spied.deviceProc, &deviceProc);
  return real;
}

class Host : public GpuTest {
 protected:
  static runtime::HostDevice spiedHost() {
    runtime::HostDevice host = gpu().host();
    spied = {};
    spied.instanceProc = host.getInstanceProcAddr;
    host.getInstanceProcAddr = &instanceProc;
    return host;
  }
};

TEST_F(Host, RefusedUploadsFreeTheirCommands) {
  const auto renderer = valueOf(runtime::Renderer::create(spiedHost(), {}), "the renderer");
  const std::uint64_t before = renderer->bytesInUse();
  spied.refuse = true;
  const auto frame = renderer->upload(openPack(onePack()), 0, 0, {});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, runtime::ErrorCode::vulkan);
  EXPECT_EQ(spied.commandBuffers, 0);
  EXPECT_EQ(renderer->bytesInUse(), before);
}

TEST_F(Host, PreparesWithTheHostsCacheAndOnce) {
  runtime::HostDevice host = spiedHost();
  host.pipelineCache = reinterpret_cast<VkPipelineCache>(std::uintptr_t{0x40});  // goes no further than the spy
  const auto renderer = valueOf(runtime::Renderer::create(host, {}), "the renderer");
  const format::Pack pack = openPack(onePack());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(renderer->prepare(pack, 0, {}, {}, runtime::ColorFormat::half));
    EXPECT_EQ(spied.pipelines, 1);
  }
  const auto frame = upload(*renderer, pack);
  ASSERT_TRUE(gpu().render(*renderer, {.frame = frame.get(), .width = 4, .height = 4}));
  EXPECT_EQ(spied.pipelines, 1);
  EXPECT_EQ(spied.cache, host.pipelineCache);
  EXPECT_FALSE(renderer->prepare(pack, 1, {}, {}, runtime::ColorFormat::half));
  EXPECT_FALSE(renderer->prepare(pack, 0, {}, {.filter = Filter::none}, runtime::ColorFormat::half));
  EXPECT_EQ(spied.pipelines, 1);
}

TEST_F(Host, NamesTheFieldThatIsOutOfRange) {
  const format::Pack pack = openPack(onePack());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto expectRefused = [&](const char* field, auto change) {
    runtime::DrawInfo draw;
    draw.frame = frame.get();
    draw.width = draw.height = 4;
    change(draw);
    const auto picture = gpu().render(*renderer, draw);
    ASSERT_FALSE(picture) << field;
    EXPECT_EQ(picture.error().code, runtime::ErrorCode::argument) << field;
    EXPECT_NE(picture.error().message.find(field), std::string::npos) << picture.error().message;
  };
  expectRefused("view.eye", [](auto& d) { d.view.eye[1] = std::numeric_limits<double>::infinity(); });
  expectRefused("view.right, up, forward", [](auto& d) { d.view.up[2] = kNan; });
  expectRefused("sun.irradiance", [](auto& d) { d.sun.irradiance[0] = -1; });
  expectRefused("sun.irradiance", [](auto& d) { d.sun.irradiance[2] = kNan; });
  expectRefused("background.bottom, top", [](auto& d) { d.background.top[0] = kNan; });
  expectRefused("background.opacity", [](auto& d) { d.background.opacity = 1.5f; });
  expectRefused("look.albedo", [](auto& d) { d.look.albedo[1] = 1.01f; });
  expectRefused("look.ambient", [](auto& d) { d.look.ambient[1] = kNan; });
  expectRefused("quality.step", [](auto& d) { d.quality.step = 0.04f; });
  expectRefused("quality.shadowStep", [](auto& d) { d.quality.shadowStep = 0.04f; });
  const auto looked = gpu().lookup(*renderer, *frame, 0, Filter::none, {8, 8, 8});
  ASSERT_FALSE(looked);
  EXPECT_EQ(looked.error().code, runtime::ErrorCode::argument);
  gpu().waitIdle();
}

}  // namespace
}  // namespace billow::tests
