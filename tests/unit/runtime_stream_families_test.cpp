// Uploads on a queue family of their own, as graphics cards have it. The device here may have one family alone, so a
// second one is pretended: what billow asks for by it is noted, and done by the real one.
#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <string_view>
#include <vector>

#include "stream_fixture.h"

namespace billow::tests {
namespace {

constexpr std::uint32_t kPretended = 7;

struct Families {
  PFN_vkGetInstanceProcAddr instanceProc = nullptr;
  PFN_vkGetDeviceProcAddr deviceProc = nullptr;
  PFN_vkGetPhysicalDeviceQueueFamilyProperties properties = nullptr;
  PFN_vkCreateBuffer createBuffer = nullptr;
  PFN_vkCreateImage createImage = nullptr;
  PFN_vkCreateCommandPool createPool = nullptr;
  std::uint32_t real = 0;
  VkExtent3D granularity{1, 1, 1};  // of the pretended family
  std::mutex mutex;
  std::uint32_t made = 0, shared = 0, pools = 0;  // objects, those of both families, command pools of the pretended one
};
Families* families = nullptr;

// An info as the real device may have it.
template <class Info>
Info noted(const Info& info) {
  const std::lock_guard lock(families->mutex);
  ++families->made;
  if (info.sharingMode == VK_SHARING_MODE_CONCURRENT) {
    const std::set<std::uint32_t> both(info.pQueueFamilyIndices, info.pQueueFamilyIndices + info.queueFamilyIndexCount);
    families->shared += both == std::set<std::uint32_t>{families->real, kPretended} ? 1 : 0;
  }
  Info real = info;
  real.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  real.queueFamilyIndexCount = 0;
  real.pQueueFamilyIndices = nullptr;
  return real;
}

VKAPI_ATTR VkResult VKAPI_CALL createBuffer(VkDevice device, const VkBufferCreateInfo* info,
                                            const VkAllocationCallbacks* callbacks, VkBuffer* buffer) {
  const VkBufferCreateInfo real = noted(*info);
  return families->createBuffer(device, &real, callbacks, buffer);
}

VKAPI_ATTR VkResult VKAPI_CALL createImage(VkDevice device, const VkImageCreateInfo* info,
                                           const VkAllocationCallbacks* callbacks, VkImage* image) {
  const VkImageCreateInfo real = noted(*info);
  return families->createImage(device, &real, callbacks, image);
}

VKAPI_ATTR VkResult VKAPI_CALL createPool(VkDevice device, const VkCommandPoolCreateInfo* info,
                                          const VkAllocationCallbacks* callbacks, VkCommandPool* pool) {
  VkCommandPoolCreateInfo real = *info;
  if (real.queueFamilyIndex == kPretended) ++families->pools;
  real.queueFamilyIndex = families->real;
  return families->createPool(device, &real, callbacks, pool);
}

VKAPI_ATTR void VKAPI_CALL properties(VkPhysicalDevice device, std::uint32_t* count, VkQueueFamilyProperties* all) {
  if (all == nullptr) {
    *count = kPretended + 1;
    return;
  }
  std::vector<VkQueueFamilyProperties> real(64);
  auto there = static_cast<std::uint32_t>(real.size());
  families->properties(device, &there, real.data());
  for (std::uint32_t i = 0; i < *count; ++i) all[i] = real[i < there ? i : families->real];
  if (*count > kPretended) {
    all[kPretended].queueFlags = VK_QUEUE_TRANSFER_BIT;
    all[kPretended].minImageTransferGranularity = families->granularity;
  }
}

template <class Function>
PFN_vkVoidFunction swap(PFN_vkVoidFunction real, Function& kept, Function own) {
  kept = reinterpret_cast<Function>(real);
  return reinterpret_cast<PFN_vkVoidFunction>(own);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL deviceProc(VkDevice device, const char* name) {
  const std::string_view wanted = name;
  const PFN_vkVoidFunction real = families->deviceProc(device, name);
  if (wanted == "vkCreateBuffer") return swap(real, families->createBuffer, &createBuffer);
  if (wanted == "vkCreateImage") return swap(real, families->createImage, &createImage);
  if (wanted == "vkCreateCommandPool") return swap(real, families->createPool, &createPool);
  return real;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instanceProc(VkInstance instance, const char* name) {
  const std::string_view wanted = name;
  const PFN_vkVoidFunction real = families->instanceProc(instance, name);
  if (wanted == "vkGetDeviceProcAddr") return swap(real, families->deviceProc, &deviceProc);
  if (wanted == "vkGetPhysicalDeviceQueueFamilyProperties") return swap(real, families->properties, &properties);
  return real;
}

class StreamFamilies : public StreamTest {
 protected:
  runtime::HostDevice host() {
    runtime::HostDevice host = gpu().host();
    families = &families_;
    families_.instanceProc = host.getInstanceProcAddr;
    families_.real = host.drawFamily;
    host.getInstanceProcAddr = &instanceProc;
    host.uploadFamily = kPretended;
    return host;
  }
  Families families_;
};

// Both families use what frames lie in and come through, at the same time, so that nothing is handed over.
TEST_F(StreamFamilies, UploadsHaveTheirOwnAndShareWhatDrawsRead) {
  const auto pack = openStream(streamPack(3, 400));
  const auto renderer =
      valueOf(runtime::Renderer::create(host(), {.blocks = runtime::BlockUse::native}), "the renderer");
  const std::uint32_t before = families_.pools;
  const auto transport = makeTransport(*renderer, smallConfig());
  EXPECT_EQ(families_.pools, before + 1) << "uploads are recorded for their family";
  auto frames = loadAll(*transport, pack, {0, 1, 2});
  EXPECT_GT(families_.made, 5u);
  EXPECT_EQ(families_.shared, families_.made);
  for (std::uint32_t number = 0; number < 3; ++number) expectSame(*renderer, *pack, number, *frames[number]);
}

// Some such families copy no less than whole slices, or whole images.
TEST_F(StreamFamilies, CoarseCopiesGiveTheSameFrames) {
  const auto pack = openStream(streamPack(2, 400));
  for (const VkExtent3D granularity : {VkExtent3D{16, 16, 8}, VkExtent3D{0, 0, 0}}) {
    families_.granularity = granularity;
    const auto renderer =
        valueOf(runtime::Renderer::create(host(), {.blocks = runtime::BlockUse::native}), "the renderer");
    runtime::StreamConfig config = smallConfig();
    config.stagingBytes = 2u << 20;
    const auto transport = makeTransport(*renderer, config);
    auto frames = loadAll(*transport, pack, {0, 1});
    for (std::uint32_t number = 0; number < 2; ++number) expectSame(*renderer, *pack, number, *frames[number]);
  }
}

TEST_F(StreamFamilies, AFamilyThatIsNotThereIsRefused) {
  runtime::HostDevice host = gpu().host();
  host.uploadFamily = 1000;
  const auto renderer = runtime::Renderer::create(host, {});
  ASSERT_FALSE(renderer);
  EXPECT_EQ(renderer.error().code, runtime::ErrorCode::argument);
  EXPECT_NE(renderer.error().message.find("1000"), std::string::npos) << renderer.error().message;
}

}  // namespace
}  // namespace billow::tests
