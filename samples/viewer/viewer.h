// `billow view`: a window in which packs and scenes play.
#ifndef BILLOW_VIEWER_VIEWER_H
#define BILLOW_VIEWER_VIEWER_H

#include <cstdint>
#include <optional>
#include <string>

#include "document.h"

namespace billow::viewer {

struct ViewOptions {
  std::string path;                          // a pack or a scene
  std::optional<Choice> choice;              // of a pack
  std::uint32_t width = 1280, height = 920;  // of the window
  std::string screenshots = ".";             // folder to which F12 writes
  std::uint64_t gpuBudget = std::uint64_t{1} << 30;
  std::optional<std::uint64_t> frameBudget;  // of it, for frames; default: half
  std::uint64_t cpuBudget = std::uint64_t{64} << 20;
  std::optional<std::uint32_t> device;
};

// Returns when the user closes the window. Refuses what cannot be opened at first, a machine without a display or GPU
// that fits, and a GPU that fails; what fails later is told in the window.
Checked<void> view(const ViewOptions& options);

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_VIEWER_H
