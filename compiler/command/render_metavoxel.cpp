#include "render_metavoxel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "billow/format/affine.h"
#include "command.h"

namespace billow::command {
namespace {

constexpr std::uint32_t kEdge = 32, kInner = kEdge - 2;  // texels of a metavoxel
constexpr std::uint32_t kMostMetavoxels = 16384;         // occupied
constexpr std::uint32_t kMostEntries = 1u << 22;
constexpr std::uint32_t kMostParticles = 1u << 20;
constexpr std::uint32_t kMostAlong = 128;
constexpr double kDefaultVoxels = 256;  // along the box's longest edge

std::string effectNames(const format::Pack& pack) {
  std::string names;
  for (const format::EffectRecord& effect : pack.effects().effects) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", pack.string(effect.name));
  }
  return names.empty() ? "none" : names;
}

}  // namespace

Checked<std::vector<std::uint32_t>> findEffects(const format::Pack& pack, const RenderRequest& request) {
  const auto& effects = pack.effects().effects;
  std::vector<std::uint32_t> found;
  for (const std::string& name : request.effects) {
    const auto at = std::find_if(effects.begin(), effects.end(),
                                 [&](const format::EffectRecord& effect) { return pack.string(effect.name) == name; });
    if (at == effects.end()) {
      return tl::unexpected(
          Refusal{kCommandLine, fmt::format("{}: no effect \"{}\"; it has {}", request.pack, name, effectNames(pack))});
    }
    found.push_back(static_cast<std::uint32_t>(at - effects.begin()));
  }
  return found;
}

Effects effectsAt(const std::vector<std::uint32_t>& effects, double time) {
  Effects all;
  for (const std::uint32_t effect : effects) all.push_back({.effect = effect, .time = time});
  return all;
}

Particles particlesOf(const format::Pack& pack, const Effects& effects) {
  Particles all;
  for (const runtime::MetavoxelEffect& effect : effects) {
    const Particles alive = format::particlesAt(pack.effects(), effect.effect, effect.time);
    all.insert(all.end(), alive.begin(), alive.end());
  }
  return all;
}

std::uint64_t mostParticles(const format::Pack& pack, const Effects& effects) {
  std::uint64_t sum = 0;
  for (const runtime::MetavoxelEffect& effect : effects) {
    for (const auto& candidates : format::candidatesAt(pack.effects(), effect.effect, effect.time)) {
      sum += candidates.last - candidates.first;
    }
  }
  return sum;
}

void addParticles(const Particles& particles, runtime::WorldBox& box) {
  for (const format::Particle& particle : particles) {
    if (!(particle.radius > 0)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const double low = double{particle.center[i]} - double{particle.radius};
      const double high = double{particle.center[i]} + double{particle.radius};
      box.min[i] = box.empty ? low : std::min(box.min[i], low);
      box.max[i] = box.empty ? high : std::max(box.max[i], high);
    }
    box.empty = false;
  }
}

VoxelLattice finestVoxels(const format::Pack& pack, const format::VolumeRecord& volume,
                          const runtime::GridChoice& grids) {
  VoxelLattice finest;
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    for (const std::uint32_t grid : {grids.extinction, grids.temperature, grids.flames}) {
      if (grid == format::kNone) continue;
      const format::GridFrame& record = pack.gridFrame(volume, frame, grid);
      if ((record.flags & format::kGridPresent) == 0) continue;
      const double edge = std::cbrt(std::abs(format::determinant(record.indexToWorld)));
      if (finest.edge > 0 && finest.edge <= edge) continue;
      finest = {edge, {record.indexToWorld[3], record.indexToWorld[7], record.indexToWorld[11]}};
    }
  }
  return finest;
}

runtime::Result<MetavoxelPainter> MetavoxelPainter::make(runtime::Renderer& renderer, const format::Pack& pack,
                                                         const runtime::WorldBox& box, const VoxelLattice& lattice,
                                                         std::uint64_t particles, std::uint64_t memoryBudget) {
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
  const double voxel = std::max(lattice.edge > 0 ? lattice.edge : longest / kDefaultVoxels, finest);
  painter.voxelSize_ = static_cast<float>(voxel);
  painter.anchor_ = lattice.anchor;
  painter.mostEntries_ = kMostEntries;
  const double along = std::ceil(diagonal / voxel / kInner) + 1;
  auto made = runtime::Metavoxels::create(
      renderer, {.edge = kEdge,
                 .metavoxels = static_cast<std::uint32_t>(std::clamp(along, 1.0, double{kMostAlong})),
                 .memoryBudget = memoryBudget,
                 .maxMetavoxels = kMostMetavoxels,
                 .maxParticles = static_cast<std::uint32_t>(std::min<std::uint64_t>(particles, kMostParticles)),
                 .maxListEntries = kMostEntries,
                 .maxVolumes = 1,
                 .recordsInFlight = 1,
                 .tables = &pack.effects()});
  if (!made) return tl::unexpected(made.error());
  painter.metavoxels_ = std::move(*made);
  return painter;
}

runtime::Result<headless::Picture> MetavoxelPainter::render(headless::Headless& gpu, runtime::Renderer& renderer,
                                                            const runtime::DrawInfo& draw, const Effects& effects) {
  const runtime::MetavoxelVolume volume{.frame = draw.frame, .look = draw.look};
  runtime::MetavoxelDraw info;
  info.view = draw.view;
  info.sun = draw.sun;
  info.scattering = {draw.look.anisotropy, draw.look.ambient, draw.look.scatteringOrders};
  if (draw.quality.shadows == runtime::Filter::none) info.lightExtinction = {0, 0, 0};
  info.center = center_;
  info.anchor = anchor_;
  info.voxelSize = voxelSize_;
  if (draw.frame != nullptr) info.volumes = {&volume, 1};
  info.effects = effects;
  info.step = draw.quality.step;
  info.background = draw.background;
  info.width = draw.width;
  info.height = draw.height;
  info.colorFormat = draw.colorFormat;
  auto picture = gpu.render(renderer, *metavoxels_, info, {});
  if (!picture) return picture;
  const runtime::MetavoxelStats stats = metavoxels_->stats();
  if (stats.drawn == stats.occupied && stats.listEntries <= mostEntries_) return picture;
  return tl::unexpected(runtime::Error{
      .code = runtime::ErrorCode::budget,
      .message =
          fmt::format("the picture needs {} metavoxels and {} entries of particles in them; there is room for {} "
                      "and {}: take larger voxels (--voxel-size)",
                      stats.occupied, stats.listEntries, kMostMetavoxels, mostEntries_)});
}

}  // namespace billow::command
