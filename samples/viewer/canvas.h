// The picture: drawn in linear light, shown as 8 bits of sRGB.
#ifndef BILLOW_VIEWER_CANVAS_H
#define BILLOW_VIEWER_CANVAS_H

#include <memory>

#include "billow/headless/target.h"
#include "gpu.h"

namespace billow::viewer {

class Canvas {
 public:
  explicit Canvas(const headless::VulkanDevice& device);

  // Waits for the device where the size changes; both edges are 1 or more. What was drawn is lost then.
  void resize(VkExtent2D size);
  VkExtent2D size() const { return size_; }
  VkImageView color() const { return color_->view; }
  VkImageView depth() const { return depth_->view; }
  VkImage shown() const { return shown_->image; }

  // Before a draw into color() and depth(), and after it: shown() is then readable by transfers. `exposure` in stops.
  void recordBegin(VkCommandBuffer commands) const;
  void recordEnd(VkCommandBuffer commands, float exposure) const;

 private:
  const headless::VulkanDevice& device_;
  DescriptorSetLayout setLayout_;
  PipelineLayout layout_;
  Pipeline pipeline_;
  DescriptorPool pool_;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  std::unique_ptr<headless::Target> color_, depth_, shown_;
  VkExtent2D size_{};
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_CANVAS_H
