// The layers that a volume is drawn as.
#ifndef BILLOW_RUNTIME_LAYERS_H
#define BILLOW_RUNTIME_LAYERS_H

#include <span>
#include <vector>

#include "frame.h"

namespace billow::runtime {

// Names what is wrong with a volume's frame or layers, one of which it needs, or gives null.
const char* badLayers(const Frame* frame, std::span<const Layer> layers);

// Those in which something is. A frame alone is one layer.
std::vector<Layer> layersOf(const Frame* frame, std::span<const Layer> layers);

inline const ResidentFrame& frameOf(const Layer& layer) {
  return static_cast<const ResidentFrame&>(*layer.frame);
}

// Whether it is carried along a velocity.
bool carried(const Layer& layer);

// The grids that drawing the layer reads: those of velocity only where it is carried along them.
FrameIndices indicesOf(const Layer& layer);

// What a velocity moves a layer's matter by, a row each of `axes` (world to whatever is moved): rows times the
// velocity. Each row's `w` is the most that any of the frame's velocities gives, at most `farthest`. All 0 where
// nothing moves.
struct Flow {
  std::array<gpu::vec4, 3> rows{};
};
Flow flowOf(const Layer& layer, const std::array<std::array<double, 3>, 3>& axes, double velocityScale,
            double farthest);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_LAYERS_H
