#include "render_metavoxel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace billow::command {
namespace {

constexpr std::uint32_t kEdge = 32, kInner = kEdge - 2;  // texels of a metavoxel
constexpr std::uint32_t kMostMetavoxels = 16384;         // occupied
constexpr std::uint32_t kMostEntries = 1u << 22;
constexpr std::uint32_t kMostAlong = 128;
constexpr double kDefaultVoxels = 256;  // along the box's longest edge

}  // namespace

runtime::Result<MetavoxelPainter> MetavoxelPainter::make(runtime::Renderer& renderer,
                                                         const format::EffectTables& tables, const SpaceNeeds& needs,
                                                         std::uint64_t memoryBudget, Surroundings surroundings) {
  const runtime::WorldBox& box = needs.box;
  double diagonal = 0, longest = 0;
  MetavoxelPainter painter;
  for (std::size_t i = 0; i < 3; ++i) {
    const double edge = box.empty ? 1 : std::max(box.max[i] - box.min[i], 1e-6);
    diagonal += edge * edge;
    longest = std::max(longest, edge);
    painter.center_[i] = (box.min[i] + box.max[i]) / 2;
  }
  diagonal = std::sqrt(diagonal);
  // One metavoxel is kept for the half voxel by which the space may move, and for filtering at its faces.
  const double finest = diagonal / ((kMostAlong - 1) * kInner);
  const double voxel = std::max(needs.lattice.edge > 0 ? needs.lattice.edge : longest / kDefaultVoxels, finest);
  painter.voxelSize_ = static_cast<float>(voxel);
  painter.anchor_ = needs.lattice.anchor;
  painter.mostEntries_ = kMostEntries;
  painter.surroundings_ = surroundings;
  const double along = std::ceil(diagonal / voxel / kInner) + 1;
  auto made = runtime::Metavoxels::create(
      renderer, {.edge = kEdge,
                 .metavoxels = static_cast<std::uint32_t>(std::clamp(along, 1.0, double{kMostAlong})),
                 .memoryBudget = memoryBudget,
                 .maxMetavoxels = kMostMetavoxels,
                 .maxParticles = static_cast<std::uint32_t>(needs.particles),
                 .maxListEntries = kMostEntries,
                 .maxVolumes = needs.volumes,
                 .lightField = surroundings.share > 0 ? kMostAlong : 0,
                 .recordsInFlight = needs.recordsInFlight,
                 .tables = &tables});
  if (!made) return tl::unexpected(made.error());
  painter.metavoxels_ = std::move(*made);
  return painter;
}

runtime::MetavoxelDraw MetavoxelPainter::describe(const runtime::DrawInfo& draw, const Shown& shown) const {
  runtime::MetavoxelDraw info;
  info.view = draw.view;
  info.sun = draw.sun;
  info.scattering = {draw.look.anisotropy, draw.look.ambient, draw.look.scatteringOrders, surroundings_.share,
                     surroundings_.bounces};
  if (draw.quality.shadows == runtime::Filter::none) info.lightExtinction = {0, 0, 0};
  info.center = center_;
  info.anchor = anchor_;
  info.voxelSize = voxelSize_;
  info.volumes = shown.volumes;
  info.effects = shown.effects;
  info.step = draw.quality.step;
  info.background = draw.background;
  info.width = draw.width;
  info.height = draw.height;
  info.colorFormat = draw.colorFormat;
  info.color = draw.color;
  info.depth = draw.depth;
  return info;
}

runtime::Result<void> MetavoxelPainter::checkRoom() const {
  const runtime::MetavoxelStats stats = metavoxels_->stats();
  if (stats.drawn == stats.occupied && stats.listEntries <= mostEntries_) return {};
  return tl::unexpected(runtime::Error{
      .code = runtime::ErrorCode::budget,
      .message =
          fmt::format("the picture needs {} metavoxels and {} entries of particles in them; there is room for {} "
                      "and {}: take larger voxels (--voxel-size)",
                      stats.occupied, stats.listEntries, kMostMetavoxels, mostEntries_)});
}

runtime::Result<headless::Picture> MetavoxelPainter::render(headless::Headless& gpu, runtime::Renderer& renderer,
                                                            const runtime::DrawInfo& draw, const Shown& shown) {
  auto picture = gpu.render(renderer, *metavoxels_, describe(draw, shown), {});
  if (!picture) return picture;
  if (auto room = checkRoom(); !room) return tl::unexpected(room.error());
  return picture;
}

}  // namespace billow::command
