// Draws a document: its frames, by metavoxels or directly, into a canvas or a picture file.
#ifndef BILLOW_VIEWER_PAINTER_H
#define BILLOW_VIEWER_PAINTER_H

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "billow/headless/headless.h"
#include "canvas.h"
#include "document.h"
#include "player.h"
#include "screen.h"

namespace billow::viewer {

// Milliseconds on the GPU: binning, filling, light, march, further rounds (of metavoxels), and of the whole picture.
struct PassTimes {
  std::array<double, runtime::kMetavoxelTimestamps - 1> passes{};
  double total = 0;
};

class Painter {
 public:
  // Throws GpuFailure.
  Painter(headless::Headless& gpu, std::uint64_t gpuBudget, const StreamBudgets& budgets);
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;
  ~Painter();

  // What is drawn from now on; it must outlive its being so. What cannot be made leaves its part of the picture out.
  // Waits for the device.
  Checked<void> show(const Document& document);
  // As show(), where the size of voxels or the light among them has changed; frames stay.
  Checked<void> remakeSpace(const Document& document);

  // Goes on to where the document's time line is. Once a picture, before paint(), `seconds` after the one before.
  void update(double seconds, const Seen& seen);
  // Who has the frames; null where there is none to be had.
  Player* player() { return player_.get(); }
  const Player* player() const { return player_.get(); }

  // Records the picture of the moment of update(). `slot` as Screen has it, whose commands before have been executed.
  Checked<void> paint(VkCommandBuffer commands, const Canvas& canvas, runtime::DrawInfo draw, std::uint32_t slot);
  SemaphoreWait wait() const;
  // Reads the times of what was painted with this slot before, where it was.
  void readTimes(std::uint32_t slot);
  const std::optional<PassTimes>& times() const { return times_; }
  // What the last picture had no room for; "" where it had.
  std::string lacking() const;
  float voxelSize() const { return metavoxels_ ? metavoxels_->voxelSize() : 0; }
  std::uint64_t bytesInUse() const { return renderer_->bytesInUse(); }
  std::uint64_t budget() const { return gpuBudget_; }

  // The picture of the moment of update() in memory. Waits for the device.
  Checked<headless::Picture> picture(runtime::DrawInfo draw);

 private:
  // What there is to draw now. Of the direct method's draw frame and look are filled in.
  command::Shown shownIn(runtime::DrawInfo& draw) const;
  bool direct(const command::Shown& shown) const;
  runtime::Result<void> record(VkCommandBuffer commands, runtime::DrawInfo& draw, std::uint32_t slot);
  VkDevice device() const { return gpu_.host().device; }

  headless::Headless& gpu_;
  std::uint64_t gpuBudget_;
  StreamBudgets budgets_;
  std::unique_ptr<runtime::Renderer> renderer_;
  const Document* document_ = nullptr;
  std::optional<command::MetavoxelPainter> metavoxels_;
  std::unique_ptr<Player> player_;
  QueryPool queries_;
  std::array<bool, kFramesInFlight> timed_{};   // whether the slot's queries were written
  std::array<bool, kFramesInFlight> passes_{};  // and those of metavoxels among them
  std::optional<PassTimes> times_;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_PAINTER_H
