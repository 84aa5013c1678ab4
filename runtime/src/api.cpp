#include "api.h"

#include <utility>

namespace billow::runtime {

tl::unexpected<Error> failure(ErrorCode code, std::string message) {
  return tl::unexpected(Error{.code = code, .message = std::move(message)});
}

tl::unexpected<Error> vulkanError(const char* call, VkResult result) {
  const ErrorCode code = result == VK_ERROR_DEVICE_LOST ? ErrorCode::deviceLost : ErrorCode::vulkan;
  return failure(code, std::string(call) + " failed with VkResult " + std::to_string(result));
}

Device& deviceOf(Renderer& renderer) {
  return renderer.device();
}

bool takeBytes(Device& device, std::uint64_t bytes) {
  std::uint64_t used = device.used;
  do {
    if (bytes > device.budget - used) return false;
  } while (!device.used.compare_exchange_weak(used, used + bytes));
  return true;
}

Result<Api> loadApi(const HostDevice& host) {
  Api api;
#define BILLOW_LOAD(name)                                                                  \
  api.name = reinterpret_cast<PFN_##name>(host.getInstanceProcAddr(host.instance, #name)); \
  if (api.name == nullptr) return failure(ErrorCode::unsupported, "the Vulkan instance lacks " #name);
  BILLOW_INSTANCE_FUNCTIONS(BILLOW_LOAD)
#undef BILLOW_LOAD
#define BILLOW_LOAD(name)                                                               \
  api.name = reinterpret_cast<PFN_##name>(api.vkGetDeviceProcAddr(host.device, #name)); \
  if (api.name == nullptr) return failure(ErrorCode::unsupported, "the Vulkan device lacks " #name);
  BILLOW_DEVICE_FUNCTIONS(BILLOW_LOAD)
#undef BILLOW_LOAD
#define BILLOW_LOAD(name) api.name = reinterpret_cast<PFN_##name>(host.getInstanceProcAddr(host.instance, #name));
  BILLOW_DEBUG_FUNCTIONS(BILLOW_LOAD)
#undef BILLOW_LOAD
  return api;
}

}  // namespace billow::runtime
