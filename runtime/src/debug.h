// Names and labels for debuggers and captures; nothing where the host has no VK_EXT_debug_utils.
#ifndef BILLOW_RUNTIME_DEBUG_H
#define BILLOW_RUNTIME_DEBUG_H

#include "api.h"

namespace billow::runtime {

// A label around what is recorded while it lives.
class DebugLabel {
 public:
  DebugLabel(const Api& api, VkCommandBuffer commands, const char* name) : api_(api), commands_(commands) {
    if (api.vkCmdBeginDebugUtilsLabelEXT == nullptr) return;
    auto label = begin<VkDebugUtilsLabelEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT);
    label.pLabelName = name;
    api.vkCmdBeginDebugUtilsLabelEXT(commands, &label);
  }
  DebugLabel(const DebugLabel&) = delete;
  DebugLabel& operator=(const DebugLabel&) = delete;
  ~DebugLabel() {
    if (api_.vkCmdBeginDebugUtilsLabelEXT != nullptr) api_.vkCmdEndDebugUtilsLabelEXT(commands_);
  }

 private:
  const Api& api_;
  VkCommandBuffer commands_;
};

template <class Handle>
void nameObject(const Device& device, VkObjectType type, Handle handle, const char* name) {
  if (device.api.vkSetDebugUtilsObjectNameEXT == nullptr) return;
  auto info = begin<VkDebugUtilsObjectNameInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT);
  info.objectType = type;
  info.objectHandle = reinterpret_cast<std::uint64_t>(handle);
  info.pObjectName = name;
  // A name that is refused is no reason to fail.
  (void)device.api.vkSetDebugUtilsObjectNameEXT(device.host.device, &info);
}

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_DEBUG_H
