// A volume's picture, drawn at the game's resolution or a lower one, into the game's image: without cracks where a
// coarse pixel has one surface and a fine one another.
//
//   auto compositor = billow::runtime::Compositor::create(*renderer, 3);
//   (*metavoxels)->record(commandBuffer, {..., .width = 960, .height = 540, .sceneDepth = halfDepth});
//   // the picture's writes before the composite's reads, then
//   (*compositor)->record(commandBuffer, {.width = 960, .height = 540, ..., .targetDepth = fullDepth});
#ifndef BILLOW_RUNTIME_COMPOSITE_H
#define BILLOW_RUNTIME_COMPOSITE_H

#include "billow/runtime/runtime.h"

namespace billow::runtime {

// All images are storage images in VK_IMAGE_LAYOUT_GENERAL; all depths are R32F, distances along the view's `forward`,
// infinity or any large number where nothing is.
struct CompositeDraw {
  std::uint32_t width = 0, height = 0;  // of color, depth and sceneDepth: the picture
  ColorFormat colorFormat = ColorFormat::half;
  VkImageView color = VK_NULL_HANDLE;  // as DrawInfo or MetavoxelDraw have it, drawn with a background of opacity 0
  VkImageView depth = VK_NULL_HANDLE;
  // The scene that the picture was marched to. Best not a mean of the finer one but one of its values. Optional:
  // without it, as the direct march has none, a texel of the picture is hidden where its depth lies behind targetDepth.
  VkImageView sceneDepth = VK_NULL_HANDLE;
  std::uint32_t targetWidth = 0, targetHeight = 0;  // of target and targetDepth
  ColorFormat targetFormat = ColorFormat::half;
  VkImageView target = VK_NULL_HANDLE;  // linear, premultiplied where its alpha counts; the picture is laid over it
  VkImageView targetDepth = VK_NULL_HANDLE;
};

// Used from one thread at a time, destroyed before its Renderer and when no commands that use it are pending.
class Compositor {
 public:
  // recordsInFlight: record() calls whose commands may be pending at once, at least 1.
  static Result<std::unique_ptr<Compositor>> create(Renderer& renderer, std::uint32_t recordsInFlight);
  virtual ~Compositor() = default;

  // Records one dispatch. A pair of formats that is met for the first time builds its pipeline here. barriers: all
  // images readable by the compute shader stage, target writable too; afterwards it was read and written by that stage.
  virtual Result<void> record(VkCommandBuffer commands, const CompositeDraw& draw) = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_COMPOSITE_H
