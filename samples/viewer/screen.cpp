#include "screen.h"

#include <imgui.h>
#include <imgui/backends/imgui_impl_vulkan.h>

#include <algorithm>

namespace billow::viewer {
namespace {

constexpr ImageUse kAcquired{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_NONE};
constexpr ImageUse kFilled{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                           VK_ACCESS_2_TRANSFER_WRITE_BIT};
constexpr VkClearColorValue kEmpty{{0.05f, 0.05f, 0.055f, 1}};

VkSubpassDependency dependency(std::uint32_t from, std::uint32_t to) {
  VkSubpassDependency order{};
  order.srcSubpass = from;
  order.dstSubpass = to;
  order.srcStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  order.dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  order.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  order.dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  return order;
}

}  // namespace

Screen::Screen(const headless::VulkanDevice& device, VkSurfaceKHR surface) : device_(device), surface_(surface) {
  chooseFormat();
  makeRenderPass();
  makeSlots();
  startPanels();
}

Screen::~Screen() {
  vkDeviceWaitIdle(device_.host.device);
  ImGui_ImplVulkan_Shutdown();
  images_.clear();
  swapchain_ = {};
  vkDestroySurfaceKHR(device_.host.instance, surface_, nullptr);
}

// 8 bits that are shown as they are written: the picture and the panels come as sRGB.
void Screen::chooseFormat() {
  std::uint32_t count = 0;
  check(vkGetPhysicalDeviceSurfaceFormatsKHR(device_.host.physicalDevice, surface_, &count, nullptr),
        "vkGetPhysicalDeviceSurfaceFormatsKHR");
  std::vector<VkSurfaceFormatKHR> formats(count);
  vkGetPhysicalDeviceSurfaceFormatsKHR(device_.host.physicalDevice, surface_, &count, formats.data());
  const auto fits = [](const VkSurfaceFormatKHR& format) {
    return (format.format == VK_FORMAT_B8G8R8A8_UNORM || format.format == VK_FORMAT_R8G8B8A8_UNORM) &&
           format.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR;
  };
  const auto found = std::find_if(formats.begin(), formats.end(), fits);
  if (found == formats.end()) throw GpuFailure(device_.name + ": the window takes no image of 8 bits a channel");
  format_ = *found;
}

void Screen::makeRenderPass() {
  VkAttachmentDescription color{};
  color.format = format_.format;
  color.samples = VK_SAMPLE_COUNT_1_BIT;
  color.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
  color.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  color.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  color.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  color.initialLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  color.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  const VkAttachmentReference reference{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &reference;
  const VkSubpassDependency order = dependency(VK_SUBPASS_EXTERNAL, 0);
  auto info = headless::begin<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
  info.attachmentCount = 1;
  info.pAttachments = &color;
  info.subpassCount = 1;
  info.pSubpasses = &subpass;
  info.dependencyCount = 1;
  info.pDependencies = &order;
  renderPass_ = makeOwned<RenderPass>(device_.host.device, vkCreateRenderPass, "vkCreateRenderPass", info);
}

void Screen::makeSlots() {
  const VkDevice device = device_.host.device;
  for (Slot& slot : slots_) {
    auto poolInfo = headless::begin<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    poolInfo.queueFamilyIndex = device_.host.drawFamily;
    slot.pool = makeOwned<CommandPool>(device, vkCreateCommandPool, "vkCreateCommandPool", poolInfo);
    auto info = headless::begin<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    info.commandPool = slot.pool.get();
    info.commandBufferCount = 1;
    check(vkAllocateCommandBuffers(device, &info, &slot.commands), "vkAllocateCommandBuffers");
    auto fenceInfo = headless::begin<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    fenceInfo.flags = VK_FENCE_CREATE_SIGNALED_BIT;
    slot.done = makeOwned<Fence>(device, vkCreateFence, "vkCreateFence", fenceInfo);
    const auto semaphoreInfo = headless::begin<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
    slot.acquired = makeOwned<Semaphore>(device, vkCreateSemaphore, "vkCreateSemaphore", semaphoreInfo);
  }
}

void Screen::startPanels() {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  auto poolInfo = headless::begin<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  poolInfo.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
  poolInfo.maxSets = poolInfo.poolSizeCount = 1;
  poolInfo.pPoolSizes = &size;
  const VkDevice device = device_.host.device;
  descriptors_ = makeOwned<DescriptorPool>(device, vkCreateDescriptorPool, "vkCreateDescriptorPool", poolInfo);
  ImGui_ImplVulkan_InitInfo info{};
  info.Instance = device_.host.instance;
  info.PhysicalDevice = device_.host.physicalDevice;
  info.Device = device;
  info.QueueFamily = device_.host.drawFamily;
  info.Queue = device_.host.uploadQueue;
  info.DescriptorPool = descriptors_.get();
  info.MinImageCount = info.ImageCount = kFramesInFlight;
  info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
  info.CheckVkResultFn = [](VkResult result) { check(result, "Dear ImGui's Vulkan backend"); };
  if (!ImGui_ImplVulkan_Init(&info, renderPass_.get())) throw GpuFailure("Dear ImGui's Vulkan backend does not start");
  const VkCommandBuffer commands = slots_[0].commands;
  auto beginInfo = headless::begin<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  beginInfo.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(commands, &beginInfo), "vkBeginCommandBuffer");
  ImGui_ImplVulkan_CreateFontsTexture(commands);
  check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
  auto commandInfo = headless::begin<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
  commandInfo.commandBuffer = commands;
  auto submitInfo = headless::begin<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
  submitInfo.commandBufferInfoCount = 1;
  submitInfo.pCommandBufferInfos = &commandInfo;
  check(vkQueueSubmit2(device_.host.uploadQueue, 1, &submitInfo, VK_NULL_HANDLE), "vkQueueSubmit2");
  check(vkQueueWaitIdle(device_.host.uploadQueue), "vkQueueWaitIdle");
  ImGui_ImplVulkan_DestroyFontUploadObjects();
}

void Screen::rebuild(VkExtent2D pixels) {
  const VkDevice device = device_.host.device;
  check(vkDeviceWaitIdle(device), "vkDeviceWaitIdle");
  VkSurfaceCapabilitiesKHR can{};
  check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.host.physicalDevice, surface_, &can),
        "vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
  extent_ = can.currentExtent;
  if (extent_.width == UINT32_MAX) {
    extent_ = {std::clamp(pixels.width, can.minImageExtent.width, can.maxImageExtent.width),
               std::clamp(pixels.height, can.minImageExtent.height, can.maxImageExtent.height)};
  }
  if (extent_.width == 0 || extent_.height == 0) return;
  auto info = headless::begin<VkSwapchainCreateInfoKHR>(VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR);
  info.surface = surface_;
  info.minImageCount = std::max(can.minImageCount, kFramesInFlight + 1);
  if (can.maxImageCount != 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format_.format;
  info.imageColorSpace = format_.colorSpace;
  info.imageExtent = extent_;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  info.preTransform = can.currentTransform;
  info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
  info.clipped = VK_TRUE;
  info.oldSwapchain = swapchain_.get();
  images_.clear();
  swapchain_ = makeOwned<Swapchain>(device, vkCreateSwapchainKHR, "vkCreateSwapchainKHR", info);
  std::uint32_t count = 0;
  check(vkGetSwapchainImagesKHR(device, swapchain_.get(), &count, nullptr), "vkGetSwapchainImagesKHR");
  std::vector<VkImage> images(count);
  check(vkGetSwapchainImagesKHR(device, swapchain_.get(), &count, images.data()), "vkGetSwapchainImagesKHR");
  for (const VkImage image : images) {
    Image& made = images_.emplace_back();
    made.image = image;
    auto viewInfo = headless::begin<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    viewInfo.image = image;
    viewInfo.viewType = VK_IMAGE_VIEW_TYPE_2D;
    viewInfo.format = format_.format;
    viewInfo.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    made.view = makeOwned<ImageView>(device, vkCreateImageView, "vkCreateImageView", viewInfo);
    const VkImageView attachment = made.view.get();
    auto frameInfo = headless::begin<VkFramebufferCreateInfo>(VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO);
    frameInfo.renderPass = renderPass_.get();
    frameInfo.attachmentCount = 1;
    frameInfo.pAttachments = &attachment;
    frameInfo.width = extent_.width;
    frameInfo.height = extent_.height;
    frameInfo.layers = 1;
    made.framebuffer = makeOwned<Framebuffer>(device, vkCreateFramebuffer, "vkCreateFramebuffer", frameInfo);
    const auto semaphoreInfo = headless::begin<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
    made.drawn = makeOwned<Semaphore>(device, vkCreateSemaphore, "vkCreateSemaphore", semaphoreInfo);
  }
  stale_ = false;
}

VkCommandBuffer Screen::begin(VkExtent2D pixels) {
  if (stale_ || pixels.width != extent_.width || pixels.height != extent_.height) rebuild(pixels);
  if (extent_.width == 0 || extent_.height == 0) return VK_NULL_HANDLE;
  const VkDevice device = device_.host.device;
  Slot& slot = slots_[slot_];
  const VkFence done = slot.done.get();
  check(vkWaitForFences(device, 1, &done, VK_TRUE, UINT64_MAX), "vkWaitForFences");
  const VkResult result =
      vkAcquireNextImageKHR(device, swapchain_.get(), UINT64_MAX, slot.acquired.get(), VK_NULL_HANDLE, &image_);
  if (result == VK_ERROR_OUT_OF_DATE_KHR) {
    stale_ = true;
    return VK_NULL_HANDLE;
  }
  if (result == VK_SUBOPTIMAL_KHR) {
    stale_ = true;
  } else {
    check(result, "vkAcquireNextImageKHR");
  }
  check(vkResetFences(device, 1, &done), "vkResetFences");
  check(vkResetCommandPool(device, slot.pool.get(), 0), "vkResetCommandPool");
  auto info = headless::begin<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(slot.commands, &info), "vkBeginCommandBuffer");
  return slot.commands;
}

void Screen::recordPicture(VkCommandBuffer commands, VkImage into, const PictureSource& picture) const {
  recordBarrier(commands, into, kAcquired, kFilled);
  const VkImageSubresourceRange whole{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdClearColorImage(commands, into, kFilled.layout, &kEmpty, 1, &whole);
  if (picture.image == VK_NULL_HANDLE) return;
  recordBarrier(commands, into, kFilled, kFilled);
  const auto x = picture.place.offset.x, y = picture.place.offset.y;
  // A window that has just shrunk takes what fits.
  const auto right =
      std::min(x + static_cast<std::int32_t>(picture.place.extent.width), static_cast<std::int32_t>(extent_.width));
  const auto bottom =
      std::min(y + static_cast<std::int32_t>(picture.place.extent.height), static_cast<std::int32_t>(extent_.height));
  if (right <= x || bottom <= y) return;
  VkImageBlit blit{};
  blit.srcSubresource = blit.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  blit.srcOffsets[1] = {static_cast<std::int32_t>(picture.size.width), static_cast<std::int32_t>(picture.size.height),
                        1};
  blit.dstOffsets[0] = {x, y, 0};
  blit.dstOffsets[1] = {right, bottom, 1};
  vkCmdBlitImage(commands, picture.image, VK_IMAGE_LAYOUT_GENERAL, into, kFilled.layout, 1, &blit, VK_FILTER_LINEAR);
}

void Screen::end(const PictureSource& picture, ImDrawData* panels, const SemaphoreWait& wait) {
  const VkCommandBuffer commands = slots_[slot_].commands;
  recordPicture(commands, images_[image_].image, picture);
  auto info = headless::begin<VkRenderPassBeginInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO);
  info.renderPass = renderPass_.get();
  info.framebuffer = images_[image_].framebuffer.get();
  info.renderArea.extent = extent_;
  vkCmdBeginRenderPass(commands, &info, VK_SUBPASS_CONTENTS_INLINE);
  ImGui_ImplVulkan_RenderDrawData(panels, commands);
  vkCmdEndRenderPass(commands);
  check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
  submit(wait);
  const VkSemaphore drawn = images_[image_].drawn.get();
  const VkSwapchainKHR swapchain = swapchain_.get();
  auto present = headless::begin<VkPresentInfoKHR>(VK_STRUCTURE_TYPE_PRESENT_INFO_KHR);
  present.waitSemaphoreCount = 1;
  present.pWaitSemaphores = &drawn;
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain;
  present.pImageIndices = &image_;
  const VkResult result = vkQueuePresentKHR(device_.host.uploadQueue, &present);
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR) {
    stale_ = true;
  } else {
    check(result, "vkQueuePresentKHR");
  }
  slot_ = (slot_ + 1) % kFramesInFlight;
}

void Screen::submit(const SemaphoreWait& wait) {
  Slot& slot = slots_[slot_];
  auto commandInfo = headless::begin<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
  commandInfo.commandBuffer = slot.commands;
  std::array<VkSemaphoreSubmitInfo, 2> waits;
  waits.fill(headless::begin<VkSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO));
  waits[0].semaphore = slot.acquired.get();
  waits[1].semaphore = wait.semaphore;
  waits[1].value = wait.value;
  waits[0].stageMask = waits[1].stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  auto signal = headless::begin<VkSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO);
  signal.semaphore = images_[image_].drawn.get();
  signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  auto info = headless::begin<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
  info.waitSemaphoreInfoCount = wait.semaphore != VK_NULL_HANDLE ? 2 : 1;
  info.pWaitSemaphoreInfos = waits.data();
  info.commandBufferInfoCount = 1;
  info.pCommandBufferInfos = &commandInfo;
  info.signalSemaphoreInfoCount = 1;
  info.pSignalSemaphoreInfos = &signal;
  check(vkQueueSubmit2(device_.host.uploadQueue, 1, &info, slot.done.get()), "vkQueueSubmit2");
}

}  // namespace billow::viewer
