#include "params.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "billow/format/affine.h"

namespace billow::runtime {
namespace {

gpu::vec4 vec4(const std::array<float, 3>& v, float w, float scale = 1) {
  return {v[0] * scale, v[1] * scale, v[2] * scale, w};
}

std::array<float, 3> normalized(const std::array<float, 3>& v) {
  const float length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

void addView(const DrawInfo& draw, gpu::MarchParams& params) {
  const View& view = draw.view;
  const float halfHeight = view.tanHalfHeight;
  const float halfWidth = halfHeight * static_cast<float>(draw.width) / static_cast<float>(draw.height);
  params.right = vec4(view.right, 2 * halfHeight / static_cast<float>(draw.height), halfWidth);
  params.up = vec4(view.up, draw.background.opacity, halfHeight);
  params.forward = vec4(view.forward, draw.quality.step);
  params.background[0] = vec4(draw.background.bottom, 0);
  params.background[1] = vec4(draw.background.top, 0);
  params.size = {draw.width, draw.height, draw.quality.shadowSteps, draw.quality.jitter ? 1u : 0u};
}

void addLook(const DrawInfo& draw, gpu::MarchParams& params) {
  const Look& look = draw.look;
  params.sun = vec4(normalized(draw.sun.direction), look.anisotropy);
  params.sunLight = vec4(draw.sun.irradiance, static_cast<float>(look.scatteringOrders));
  params.ambient = vec4(look.ambient, look.extinctionScale);
  params.albedo = vec4(look.albedo, draw.quality.shadowStep);
  params.emission = {look.emissionScale, look.temperatureScale, look.temperatureOffset, look.referenceKelvin};
  params.smoke = {1 / look.heatMax, look.smokeBegin, look.smokeFull, look.smokeInFire};
}

}  // namespace

gpu::uvec4 addresses(VkDeviceAddress a, VkDeviceAddress b) {
  const auto low = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x & 0xffffffffu); };
  const auto high = [](VkDeviceAddress x) { return static_cast<std::uint32_t>(x >> 32); };
  return {low(a), high(a), low(b), high(b)};
}

gpu::GridParams gridParams(const ResidentGrid& grid, const std::array<double, 3>& eye, Filter widest) {
  double toIndex[12];
  format::invert(grid.frame.indexToWorld, toIndex);  // rule 217: it can be turned round
  gpu::GridParams params{};
  params.tableAndRecords = addresses(grid.table, grid.records);
  params.masksAndNode4 = addresses(grid.masks, grid.node4);
  params.children = addresses(grid.children, 0);
  const auto cell = [](std::uint32_t at) { return static_cast<std::int32_t>(at); };
  const std::uint32_t* min = grid.cells.min;
  const std::uint32_t* dim = grid.cells.dim;
  params.cellMin = {cell(min[0]), cell(min[1]), cell(min[2]), static_cast<std::int32_t>(grid.index)};
  params.cellDim = {cell(dim[0]), cell(dim[1]), cell(dim[2]), cell(grid.absent5)};
  // How far an active voxel's value reaches from its centre.
  const float reach = widest == Filter::trilinear ? 1.0f : 0.5f;
  const auto low = [&](int axis) { return static_cast<float>(grid.frame.activeMin[axis]) - reach; };
  const auto high = [&](int axis) { return static_cast<float>(grid.frame.activeMax[axis]) + reach; };
  params.boxMin = {low(0), low(1), low(2), grid.frame.background};
  params.boxMax = {high(0), high(1), high(2), grid.skippable ? 1.0f : 0.0f};
  for (int row = 0; row < 3; ++row) {
    const double* r = toIndex + row * 4;
    params.toIndex[row] = {static_cast<float>(r[0]), static_cast<float>(r[1]), static_cast<float>(r[2]),
                           static_cast<float>(r[0] * eye[0] + r[1] * eye[1] + r[2] * eye[2] + r[3])};
  }
  return params;
}

// `Params` has bricks and grids.
template <class Params>
void addFrame(const ResidentFrame& frame, const std::array<double, 3>& eye, Filter widest, Params& params) {
  params.bricks = addresses(0, frame.bricks_);
  params.bricks.x = frame.shape_.xBits | frame.shape_.yBits << 8;
  for (std::size_t slot = 0; slot < std::size(params.grids); ++slot) {
    if (frame.grids_[slot].present) params.grids[slot] = gridParams(frame.grids_[slot], eye, widest);
  }
}

// One box serves both marches.
Filter widestOf(const Quality& quality) {
  const bool wide = quality.filter == Filter::trilinear || quality.shadows == Filter::trilinear;
  return wide ? Filter::trilinear : Filter::nearest;
}

gpu::MarchParams viewParams(const DrawInfo& draw) {
  gpu::MarchParams params{};
  addView(draw, params);
  addLook(draw, params);
  return params;
}

gpu::MarchParams marchParams(const ResidentFrame& frame, const DrawInfo& draw) {
  gpu::MarchParams params = viewParams(draw);
  addFrame(frame, draw.view.eye, widestOf(draw.quality), params);
  return params;
}

LayeredParams layeredParams(std::span<const Layer> layers, const DrawInfo& draw) {
  LayeredParams params{.view = viewParams(draw)};
  for (std::size_t i = 0; i < layers.size(); ++i) {
    gpu::LayerParams& layer = params.layers[i];
    addFrame(frameOf(layers[i]), draw.view.eye, widestOf(draw.quality), layer);
    layer.share = {layers[i].weight, 0, 0, 0};
  }
  return params;
}

gpu::MarchParams lookupParams(const ResidentFrame& frame, Filter filter) {
  gpu::MarchParams params{};
  addFrame(frame, {0, 0, 0}, filter, params);
  return params;
}

}  // namespace billow::runtime
