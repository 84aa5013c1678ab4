#include "sizes.h"

#include <algorithm>

namespace billow::runtime {
namespace {

constexpr std::uint64_t kAlign = 256;

template <class Rows>
std::uint64_t bytesOf(const Rows& rows) {
  return rows.size() * sizeof(rows[0]);
}

std::uint64_t pointsOf(const format::EffectTables& tables) {
  std::uint64_t points = 0;
  for (const auto& frame : tables.trackPoints) points += frame.size();
  return points;
}

// Slots as an image's box: rows of eight, layers of eight rows, or fewer, powers of two. Never more than asked for.
void shapeSlots(std::uint64_t slots, std::uint32_t maxImageExtent3D, MetavoxelSizes& sizes) {
  const std::uint64_t along = std::max<std::uint64_t>(maxImageExtent3D / sizes.edge, 1);
  const auto part = [&](std::uint64_t wanted, std::uint64_t most) {
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(wanted, 1, std::min(most, along)));
  };
  sizes.slotsX = std::bit_floor(part(slots, 8));
  sizes.slotsY = std::bit_floor(part(slots / sizes.slotsX, 8));
  sizes.slotsZ = part(slots / (std::uint64_t{sizes.slotsX} * sizes.slotsY), along);
}

// Level 0 lies at the image's first corner; the others side by side behind it.
FieldSizes fieldOf(const MetavoxelConfig& config, const MetavoxelSizes& sizes) {
  FieldSizes field{};
  if (config.lightField == 0) return field;
  const std::uint32_t wanted = (sizes.inner + gpu::kFieldVoxel - 1) / gpu::kFieldVoxel;
  field.perCell = std::min(wanted, config.lightField / sizes.axis);
  field.edge = field.perCell * sizes.axis;
  std::uint32_t edge = field.edge, x = 0;
  // The last one is of 2^3 or fewer; gathering reads the second at least.
  for (std::uint32_t i = 0; i < gpu::kFieldLevels; ++i, edge = (edge + 1) / 2) {
    if (i > 1 && field.level[i - 1][3] <= 2) break;
    field.level[i] = {x + 1, 1, i == 0 ? 1 : field.edge + 3, edge};
    field.image[0] = std::max(field.image[0], x + edge + 2);
    if (i > 0) x += edge + 2;
    field.levels = i + 1;
  }
  field.image[1] = field.edge + 2;
  field.image[2] = field.level[1][2] + field.level[1][3] + 1;
  return field;
}

MetavoxelRegions regionsOf(const MetavoxelConfig& config, const MetavoxelSizes& sizes) {
  std::uint64_t end = 0;
  const auto region = [&](std::uint64_t bytes) {
    const std::uint64_t at = end;
    end += (std::max<std::uint64_t>(bytes, 1) + kAlign - 1) / kAlign * kAlign;
    return at;
  };
  const format::EffectTables none;
  const format::EffectTables& tables = config.tables != nullptr ? *config.tables : none;
  const std::uint64_t most = sizes.most;
  MetavoxelRegions regions{};
  regions.counters = region(sizeof(gpu::MetavoxelCounters));
  regions.rounds = region(sizes.rounds * sizeof(gpu::MetavoxelRound));
  regions.words = region(sizes.cells() * 4);
  regions.positions = region(sizes.cells() * 4);
  regions.found = region(most * 4);
  regions.cellAt = region(most * 4);
  regions.lists = region(most * 8);
  regions.cursors = region(most * 4);
  const std::uint64_t kept = config.keepFilled ? 1 : 0;
  regions.kept = region(kept * sizes.cells() * 4);
  regions.slots = region(kept * most * sizeof(gpu::MetavoxelSlot));
  regions.spare = region(kept * most * 4);
  regions.fills = region(kept * most * 4);
  regions.entries = region(std::uint64_t{config.maxListEntries} * 4);
  regions.particles = region(std::uint64_t{config.maxParticles} * sizeof(format::Particle));
  // None of a draw's jobs is empty.
  regions.jobs = region(tables.effects.empty() ? 0 : std::uint64_t{config.maxParticles} * sizeof(gpu::SpawnJob));
  regions.materials = region(bytesOf(tables.materials));
  regions.curves = region(bytesOf(tables.curves));
  regions.ramps = region(bytesOf(tables.ramps));
  regions.emitters = region(bytesOf(tables.emitters));
  regions.points = region(pointsOf(tables) * sizeof(format::TrackPoint));
  regions.radii = region(format::haveRadii(tables.tracks) ? pointsOf(tables) * sizeof(float) : 0);
  regions.given = region(bytesOf(tables.given));
  regions.surfaces = region(bytesOf(tables.surfacePoints));
  regions.columns = region(most * sizes.inner * sizes.inner * 4);
  const std::uint64_t fieldVoxels = std::uint64_t{sizes.field.perCell} * sizes.field.perCell * sizes.field.perCell;
  regions.fieldMatter = region(most * fieldVoxels * 16);
  regions.blocks = region(sizes.blocks() * 4);
  regions.volumeWork = region(sizes.blocks() * 8);
  regions.fillWork = region(sizes.blocks() * 16);
  const std::uint64_t texels = std::uint64_t{sizes.slots()} * sizes.edge * sizes.edge * sizes.edge;
  regions.emission = region(texels * 4);
  regions.albedo = region(kept * texels * 4);
  regions.bytes = end;
  return regions;
}

}  // namespace

const char* badConfig(const MetavoxelConfig& config) {
  if (config.edge < 4 || config.edge > 64) return "edge";
  if (config.metavoxels < 1 || config.metavoxels > 128) return "metavoxels";
  if (config.metavoxels * (config.edge - 2) > 4096) return "metavoxels * (edge - 2)";
  if (config.maxMetavoxels < 1 || config.maxMetavoxels > 65535) return "maxMetavoxels";
  if (config.lightField != 0 && (config.lightField < config.metavoxels || config.lightField > kMostFieldVoxels)) {
    return "lightField";
  }
  if (config.maxParticles > 1048576) return "maxParticles";
  if (config.maxVolumes > gpu::kMaxVolumes) return "maxVolumes";
  return config.recordsInFlight == 0 ? "recordsInFlight" : nullptr;
}

MetavoxelSizes metavoxelSizes(const MetavoxelConfig& config, std::uint64_t slots, std::uint32_t maxImageExtent3D) {
  MetavoxelSizes sizes{};
  sizes.edge = config.edge;
  sizes.inner = config.edge - 2;
  sizes.axis = config.metavoxels;
  sizes.most = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(config.maxMetavoxels, std::uint64_t{sizes.axis} * sizes.axis * sizes.axis));
  shapeSlots(slots, maxImageExtent3D, sizes);
  // The cells before the eye and those after it each begin a round of their own.
  sizes.rounds = sizes.slots() >= sizes.most ? 1 : (sizes.most + sizes.slots() - 1) / sizes.slots() + 1;
  const std::size_t maps = config.tables != nullptr ? config.tables->maps.size() : 0;
  sizes.cubeLayers = std::max(static_cast<std::uint32_t>(maps) * gpu::kCubeLayers, 1u);
  sizes.field = fieldOf(config, sizes);
  sizes.regions = regionsOf(config, sizes);
  return sizes;
}

}  // namespace billow::runtime
