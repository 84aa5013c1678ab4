#include "billow/headless/device.h"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <cstring>
#include <string_view>

namespace billow::headless {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<VulkanDevice*>(user)->messages.emplace_back(data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo(VulkanDevice* device) {
  auto info = begin<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  info.pfnUserCallback = onMessage;
  info.pUserData = device;
  return info;
}

// The features that billow needs, chained.
struct Features {
  VkPhysicalDeviceFeatures2 core = begin<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
  VkPhysicalDeviceVulkan12Features v12 =
      begin<VkPhysicalDeviceVulkan12Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES);
  VkPhysicalDeviceVulkan13Features v13 =
      begin<VkPhysicalDeviceVulkan13Features>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES);
  Features() {
    core.pNext = &v12;
    v12.pNext = &v13;
  }
  Features(const Features&) = delete;
  Features& operator=(const Features&) = delete;
};

// Drivers and layers leave threads, exit handlers and memory behind, so they stay loaded when the loader lets go of
// them: unloading them has no use, and would leave leak checkers without a name for what they find.
int keepLoaded(dl_phdr_info* library, std::size_t, void*) {
  const std::string_view name = library->dlpi_name != nullptr ? library->dlpi_name : "";
  if (name.find("/libvulkan_") == std::string_view::npos && name.find("/libVkLayer") == std::string_view::npos)
    return 0;
  dlopen(library->dlpi_name, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE);
  return 0;
}

// Preference among devices: discrete, integrated, virtual, software.
int rank(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    default:
      return 3;
  }
}

bool fits(const Functions& vk, VkPhysicalDevice device, const VkPhysicalDeviceProperties& properties) {
  if (properties.apiVersion < VK_API_VERSION_1_3) return false;
  Features features;
  vk.vkGetPhysicalDeviceFeatures2(device, &features.core);
  return features.v12.bufferDeviceAddress && features.v12.timelineSemaphore && features.v13.synchronization2;
}

}  // namespace

tl::unexpected<runtime::Error> gpuError(const std::string& message) {
  return tl::unexpected(runtime::Error{.code = runtime::ErrorCode::vulkan, .message = message});
}

VulkanDevice::~VulkanDevice() {
  if (host.device != VK_NULL_HANDLE) vk.vkDestroyDevice(host.device, nullptr);
  if (messenger_ != VK_NULL_HANDLE) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vk.vkGetInstanceProcAddr(host.instance, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(host.instance, messenger_, nullptr);
  }
  if (host.instance != VK_NULL_HANDLE) vk.vkDestroyInstance(host.instance, nullptr);
  // The library stays loaded: drivers leave threads and exit handlers behind.
}

Result<void> VulkanDevice::open(const DeviceOptions& options) {
  if (auto done = loadLibrary(); !done) return done;
  if (auto done = createInstance(options); !done) return done;
  if (auto done = pickDevice(options); !done) return done;
  return createDevice(options.presents != nullptr);
}

Result<void> VulkanDevice::loadLibrary() {
  library_ = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library_ == nullptr) return gpuError("no Vulkan: libvulkan.so.1 cannot be loaded (Debian package libvulkan1)");
  vk.vkGetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library_, "vkGetInstanceProcAddr"));
  if (vk.vkGetInstanceProcAddr == nullptr) return gpuError("no Vulkan: libvulkan.so.1 lacks vkGetInstanceProcAddr");
#define BILLOW_LOAD(function) \
  vk.function = reinterpret_cast<PFN_##function>(vk.vkGetInstanceProcAddr(nullptr, #function));
  BILLOW_HEADLESS_GLOBAL(BILLOW_LOAD)
#undef BILLOW_LOAD
  host.getInstanceProcAddr = vk.vkGetInstanceProcAddr;
  return {};
}

Result<void> VulkanDevice::createInstance(const DeviceOptions& options) {
  auto application = begin<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "billow";
  application.apiVersion = VK_API_VERSION_1_3;
  const auto messenger = messengerInfo(this);
  std::vector<const char*> extensions = options.instanceExtensions;
  auto info = begin<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;
  if (options.validation) {
    info.pNext = &messenger;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  const VkResult result = vk.vkCreateInstance(&info, nullptr, &host.instance);
  if (result == VK_ERROR_LAYER_NOT_PRESENT) return gpuError(std::string("no ") + kValidationLayer);
  if (result != VK_SUCCESS) return gpuError("no Vulkan: vkCreateInstance gives VkResult " + std::to_string(result));
#define BILLOW_LOAD(function) \
  vk.function = reinterpret_cast<PFN_##function>(vk.vkGetInstanceProcAddr(host.instance, #function));
  BILLOW_HEADLESS_INSTANCE(BILLOW_LOAD)
#undef BILLOW_LOAD
  if (!options.validation) return {};
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vk.vkGetInstanceProcAddr(host.instance, "vkCreateDebugUtilsMessengerEXT"));
  if (create == nullptr || create(host.instance, &messenger, nullptr, &messenger_) != VK_SUCCESS) {
    return gpuError("the validation layer takes no messenger");
  }
  return {};
}

Result<void> VulkanDevice::pickDevice(const DeviceOptions& options) {
  std::uint32_t count = 0;
  vk.vkEnumeratePhysicalDevices(host.instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vk.vkEnumeratePhysicalDevices(host.instance, &count, devices.data());
  if (options.device && *options.device >= count) {
    return gpuError("no Vulkan device " + std::to_string(*options.device) + ": there are " + std::to_string(count));
  }
  int best = 4;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (options.device && *options.device != i) continue;
    VkPhysicalDeviceProperties properties{};
    vk.vkGetPhysicalDeviceProperties(devices[i], &properties);
    if (!fits(vk, devices[i], properties) || rank(properties.deviceType) >= best) continue;
    const auto family = familyOf(devices[i], options);
    if (!family) continue;
    host.uploadFamily = host.drawFamily = *family;
    best = rank(properties.deviceType);
    host.physicalDevice = devices[i];
    name = properties.deviceName;
    timestampPeriod = properties.limits.timestampPeriod;
  }
  if (host.physicalDevice == VK_NULL_HANDLE) {
    return gpuError(std::string("no usable Vulkan device: it must have Vulkan 1.3 with buffer device addresses") +
                    (options.presents ? " and present to the window" : "") +
                    " (a GPU driver, or Debian package mesa-vulkan-drivers to render on the CPU)");
  }
  return {};
}

std::optional<std::uint32_t> VulkanDevice::familyOf(VkPhysicalDevice device, const DeviceOptions& options) const {
  std::uint32_t count = 0;
  vk.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vk.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  VkQueueFlags wanted = VK_QUEUE_COMPUTE_BIT;
  if (options.presents) wanted |= VK_QUEUE_GRAPHICS_BIT;
  for (std::uint32_t family = 0; family < count; ++family) {
    if ((families[family].queueFlags & wanted) != wanted) continue;
    if (!options.presents || options.presents(host.instance, device, family)) return family;
  }
  return std::nullopt;
}

Result<void> VulkanDevice::createDevice(bool swapchains) {
  Features available;
  vk.vkGetPhysicalDeviceFeatures2(host.physicalDevice, &available.core);
  Features wanted;
  wanted.core.features.textureCompressionBC = available.core.features.textureCompressionBC;
  wanted.v12.bufferDeviceAddress = wanted.v12.timelineSemaphore = wanted.v13.synchronization2 = VK_TRUE;
  host.textureCompressionBc = available.core.features.textureCompressionBC == VK_TRUE;
  const float priority = 1;
  auto queueInfo = begin<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queueInfo.queueFamilyIndex = host.drawFamily;
  queueInfo.queueCount = 1;
  queueInfo.pQueuePriorities = &priority;
  auto info = begin<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.pNext = &wanted.core;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queueInfo;
  const char* const swapchain = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
  info.enabledExtensionCount = swapchains ? 1 : 0;
  info.ppEnabledExtensionNames = &swapchain;
  const VkResult result = vk.vkCreateDevice(host.physicalDevice, &info, nullptr, &host.device);
  if (result != VK_SUCCESS) return gpuError(name + ": vkCreateDevice gives VkResult " + std::to_string(result));
#define BILLOW_LOAD(function) \
  vk.function = reinterpret_cast<PFN_##function>(vk.vkGetDeviceProcAddr(host.device, #function));
  BILLOW_HEADLESS_DEVICE(BILLOW_LOAD)
#undef BILLOW_LOAD
  dl_iterate_phdr(keepLoaded, nullptr);
  vk.vkGetDeviceQueue(host.device, host.drawFamily, 0, &host.uploadQueue);
  return {};
}

}  // namespace billow::headless
