#include "layers.h"

#include <algorithm>
#include <cmath>

namespace billow::runtime {

bool carried(const Layer& layer) {
  const auto& grids = frameOf(layer).grids_;
  return layer.advect != 0 && std::any_of(grids.begin() + gpu::kVelocityXSlot, grids.end(),
                                          [](const ResidentGrid& grid) { return grid.present; });
}

const char* badLayers(const Frame* frame, std::span<const Layer> layers) {
  if ((frame == nullptr) == layers.empty()) return "frame";
  if (layers.size() > kMostLayers) return "layers: their number";
  for (const Layer& layer : layers) {
    if (layer.frame == nullptr) return "layers.frame";
    if (!(layer.weight >= 0 && layer.weight <= 1)) return "layers.weight";
    if (!std::isfinite(layer.advect)) return "layers.advect";
  }
  return nullptr;
}

std::vector<Layer> layersOf(const Frame* frame, std::span<const Layer> layers) {
  std::vector<Layer> some(layers.begin(), layers.end());
  if (frame != nullptr) some.push_back({.frame = frame});
  std::erase_if(some, [](const Layer& layer) { return layer.weight == 0 || layer.frame->empty(); });
  return some;
}

FrameIndices indicesOf(const Layer& layer) {
  const FrameIndices indices = frameOf(layer).indices();
  return carried(layer) ? indices : matterOf(indices);
}

Flow flowOf(const Layer& layer, const std::array<std::array<double, 3>, 3>& axes, double velocityScale,
            double farthest) {
  Flow flow;
  if (!carried(layer)) return flow;
  // What is larger than this is more than anything may move, and its product with a velocity is still finite.
  constexpr double kLargest = 1e18;
  const double seconds = double{layer.advect} * velocityScale;
  for (std::size_t row = 0; row < 3; ++row) {
    double way[3], most = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      way[i] = std::clamp(axes[row][i] * seconds, -kLargest, kLargest);
      const ResidentGrid& grid = frameOf(layer).grids_[gpu::kVelocityXSlot + i];
      if (!grid.present) continue;
      const double speed = std::max(std::abs(double{grid.frame.valueMin}), std::abs(double{grid.frame.valueMax}));
      most += std::abs(way[i]) * speed;
    }
    most *= 1 + 1e-6;  // for what rounding adds
    flow.rows[row] = {static_cast<float>(way[0]), static_cast<float>(way[1]), static_cast<float>(way[2]),
                      static_cast<float>(std::min(most, farthest))};
  }
  return flow;
}

}  // namespace billow::runtime
