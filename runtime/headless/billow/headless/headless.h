// The smallest host for billow: a Vulkan device, and pictures read back to memory, no window needed. Used by the render
// command, the viewer, the tests and the benchmark; a game has all of this already.
#ifndef BILLOW_HEADLESS_HEADLESS_H
#define BILLOW_HEADLESS_HEADLESS_H

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "billow/headless/device.h"
#include "billow/runtime/metavoxel.h"
#include "billow/runtime/runtime.h"

namespace billow::headless {

// A picture that was drawn and read back.
struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgba;   // premultiplied linear, four a pixel, top row first
  std::vector<float> depth;  // one a pixel
};

// Texels on the device, in VK_IMAGE_LAYOUT_GENERAL: what a game has of its scene. Destroyed before its Headless.
class SceneImage {
 public:
  virtual ~SceneImage() = default;
  virtual VkImageView view() const = 0;
};

using PassTimes = std::array<double, runtime::kMetavoxelTimestamps - 1>;

class Headless {
 public:
  // Loads libvulkan at run time; its absence is an error, as is a machine without a device that fits.
  static Result<std::unique_ptr<Headless>> create(const DeviceOptions& options);
  virtual ~Headless() = default;

  virtual const runtime::HostDevice& host() const = 0;
  virtual const std::string& deviceName() const = 0;
  virtual const VulkanDevice& device() const = 0;
  // What the validation layer has said so far: empty is good.
  virtual const std::vector<std::string>& validationMessages() const = 0;

  // Draws one frame in draw.colorFormat and waits for it. draw.color and draw.depth are filled in.
  virtual Result<Picture> render(runtime::Renderer& renderer, runtime::DrawInfo draw) = 0;

  // Draws `count` times and returns each dispatch's GPU time in milliseconds.
  virtual Result<std::vector<double>> time(runtime::Renderer& renderer, runtime::DrawInfo draw,
                                           std::uint32_t count) = 0;

  // The same with metavoxels of this renderer. `sceneDepth` is one a pixel, or empty for none.
  virtual Result<Picture> render(runtime::Renderer& renderer, runtime::Metavoxels& metavoxels,
                                 runtime::MetavoxelDraw draw, std::span<const float> sceneDepth) = 0;

  // An image of one or four floats a texel, row by row; for storage and for sampling.
  virtual Result<std::unique_ptr<SceneImage>> sceneImage(std::uint32_t width, std::uint32_t height,
                                                         std::span<const float> texels) = 0;

  virtual Result<std::vector<float>> read(const SceneImage& image) = 0;

  // Runs what `record` records, and waits for it.
  virtual Result<void> run(const std::function<Result<void>(VkCommandBuffer)>& record) = 0;

  // The texels of Metavoxels::shadow() after a draw, row by row.
  virtual Result<std::vector<float>> readShadow(runtime::Renderer& renderer, const runtime::Metavoxels& metavoxels) = 0;

  // Metavoxels::particles() after a draw; their centres are in the world.
  virtual Result<std::vector<format::Particle>> readParticles(runtime::Renderer& renderer,
                                                              const runtime::Metavoxels& metavoxels) = 0;

  // Milliseconds between MetavoxelDraw::timestamps, one row a draw.
  virtual Result<std::vector<PassTimes>> time(runtime::Renderer& renderer, runtime::Metavoxels& metavoxels,
                                              runtime::MetavoxelDraw draw, std::uint32_t count) = 0;

  // One value per position (three floats each, pack index space) of the frame's grid in `slot`.
  virtual Result<std::vector<float>> lookup(runtime::Renderer& renderer, const runtime::Frame& frame,
                                            std::uint32_t slot, runtime::Filter filter,
                                            const std::vector<float>& positions) = 0;

  // Waits until the device is idle, as a host must before it destroys frames.
  virtual void waitIdle() = 0;
};

}  // namespace billow::headless

#endif  // BILLOW_HEADLESS_HEADLESS_H
