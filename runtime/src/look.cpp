#include "billow/runtime/look.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "billow/format/affine.h"
#include "billow/format/grid_view.h"
#include "billow/format/look.h"

namespace billow::runtime {
namespace {

// Chosen by eye on smoke, dust, fire and explosions of several tools.
constexpr double kSmokeDepth = 11;        // optical depth of the whole cloud, were it a cube of its densest gas
constexpr double kDerivedSmokeDepth = 7;  // the same where smoke comes from temperature
constexpr double kFireRadiance = 5.5;     // of the whole fire, were it a cube of its brightest gas
constexpr float kHottest = 1800;          // kelvin at the largest temperature of the volume
constexpr float kColdest = 300;           // kelvin at 0

// How much gas a grid frame holds, weighted by itself, so that thin haze counts for little.
struct Amount {
  double typical = 0;  // mean value, weighted by value
  double size = 0;     // world edge of a cube of that value that holds as much
};

double voxelSize(const format::GridFrame& frame) {
  return std::cbrt(std::abs(format::determinant(frame.indexToWorld)));
}

Amount measure(const format::GridView& view) {
  double sum = 0, squares = 0;
  const auto add = [&](double value, double count) {
    if (!(value > 0)) return;
    sum += value * count;
    squares += value * value * count;
  };
  format::Values values;
  format::Mask3 active;
  for (const format::GridView::Leaf& leaf : view.leaves()) {
    format::decodeBrick(leaf.node, leaf.mask, leaf.brick, view.frame().background, values, active);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (format::maskBit(active, i)) add(values[i], 1);
    }
  }
  for (const format::GridView::Tile& tile : view.tiles()) add(tile.value, std::pow(double{1} * tile.dim, 3));
  if (sum <= 0) return {};
  return {.typical = squares / sum, .size = std::cbrt(sum * sum / squares) * voxelSize(view.frame())};
}

// The grid's frame with the most active voxels.
Result<Amount> measureFullest(const format::Pack& pack, const format::VolumeRecord& volume, std::uint32_t grid) {
  const format::GridFrame* fullest = nullptr;
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    const format::GridFrame& candidate = pack.gridFrame(volume, frame, grid);
    if ((candidate.flags & format::kGridPresent) == 0 || candidate.node5 == format::kNone) continue;
    if (fullest == nullptr || candidate.activeVoxels > fullest->activeVoxels) fullest = &candidate;
  }
  if (fullest == nullptr) return Amount{};
  const auto view = format::GridView::load(pack, *fullest);
  if (!view) {
    return tl::unexpected(Error{.code = ErrorCode::pack, .message = toString(view.error()), .issue = view.error()});
  }
  return measure(*view);
}

float largestValue(const format::Pack& pack, const format::VolumeRecord& volume, std::uint32_t grid) {
  float largest = 0;
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    const format::GridFrame& candidate = pack.gridFrame(volume, frame, grid);
    if ((candidate.flags & format::kGridPresent) != 0) largest = std::max(largest, candidate.valueMax);
  }
  return largest;
}

// `depth` spread over the gas; 1 where there is none.
float spread(double depth, const Amount& amount, double typical) {
  const double scale = depth / (typical * amount.size);
  return amount.size > 0 && std::isfinite(scale) ? static_cast<float>(scale) : 1.0f;
}

Result<void> fitHeat(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids,
                     Look& look) {
  const bool temperature = grids.temperature != format::kNone;
  const std::uint32_t heat = temperature ? grids.temperature : grids.flames;
  if (heat == format::kNone) {
    look.emissionScale = 0;
    return {};
  }
  const float hottest = largestValue(pack, volume, heat);
  look.heatMax = hottest > 0 ? hottest : 1;
  look.albedo = {0.50f, 0.47f, 0.44f};  // soot
  look.temperatureOffset = kColdest;
  look.temperatureScale = (kHottest - kColdest) / look.heatMax;
  const std::uint32_t burning = grids.flames != format::kNone ? grids.flames : grids.temperature;
  const auto fire = measureFullest(pack, volume, burning);
  if (!fire) return tl::unexpected(fire.error());
  // Emission from temperature alone is measured in shares of heatMax (medium.glsl, emissionOf).
  const double typical = grids.flames != format::kNone ? fire->typical : fire->typical / look.heatMax;
  look.emissionScale = spread(kFireRadiance, *fire, typical);
  return {};
}

Result<void> fitExtinction(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids,
                           Look& look) {
  std::uint32_t source = grids.extinction;
  if (source == format::kNone) source = grids.temperature != format::kNone ? grids.temperature : grids.flames;
  if (source == format::kNone) return {};
  const auto amount = measureFullest(pack, volume, source);
  if (!amount) return tl::unexpected(amount.error());
  const bool derived = grids.extinction == format::kNone;
  look.extinctionScale =
      derived ? spread(kDerivedSmokeDepth, *amount, 1) : spread(kSmokeDepth, *amount, amount->typical);
  return {};
}

}  // namespace

void addBox(const WorldBox& more, WorldBox& box) {
  if (more.empty) return;
  for (std::size_t i = 0; i < 3; ++i) {
    box.min[i] = box.empty ? more.min[i] : std::min(box.min[i], more.min[i]);
    box.max[i] = box.empty ? more.max[i] : std::max(box.max[i], more.max[i]);
  }
  box.empty = false;
}

void addParticles(std::span<const format::Particle> particles, WorldBox& box) {
  for (const format::Particle& particle : particles) {
    if (!(particle.radius > 0)) continue;
    WorldBox ball{.empty = false};
    for (std::size_t i = 0; i < 3; ++i) {
      ball.min[i] = double{particle.center[i]} - double{particle.radius};
      ball.max[i] = double{particle.center[i]} + double{particle.radius};
    }
    addBox(ball, box);
  }
}

WorldBox worldBox(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids,
                  std::uint32_t first, std::uint32_t last, const std::array<double, 12>& objectToWorld) {
  WorldBox box;
  for (std::uint32_t frame = first; frame <= last && frame < volume.frameCount; ++frame) {
    for (const std::uint32_t grid : {grids.extinction, grids.temperature, grids.flames}) {
      if (grid == format::kNone) continue;
      const format::GridFrame& g = pack.gridFrame(volume, frame, grid);
      if ((g.flags & format::kGridPresent) == 0 || g.activeMin[0] > g.activeMax[0]) continue;
      double indexToWorld[12];
      format::compose(objectToWorld, g.indexToWorld, indexToWorld);
      for (int corner = 0; corner < 8; ++corner) {
        double at[3];
        for (int i = 0; i < 3; ++i) at[i] = (corner >> i & 1) != 0 ? g.activeMax[i] + 0.5 : g.activeMin[i] - 0.5;
        for (std::size_t i = 0; i < 3; ++i) {
          const double* m = indexToWorld + i * 4;
          const double world = m[0] * at[0] + m[1] * at[1] + m[2] * at[2] + m[3];
          box.min[i] = box.empty ? world : std::min(box.min[i], world);
          box.max[i] = box.empty ? world : std::max(box.max[i], world);
        }
        box.empty = false;
      }
    }
  }
  return box;
}

void applyLook(const format::LookRecord& record, Look& look) {
  const auto given = [&](format::LookBit field) { return format::isSet(record, field); };
  if (given(format::kLookExtinctionScale)) look.extinctionScale = record.extinctionScale;
  if (given(format::kLookAlbedo)) std::copy(record.albedo, record.albedo + 3, look.albedo.begin());
  if (given(format::kLookAnisotropy)) look.anisotropy = record.anisotropy;
  if (given(format::kLookEmissionScale)) look.emissionScale = record.emissionScale;
  if (given(format::kLookTemperatureScale)) look.temperatureScale = record.temperatureScale;
  if (given(format::kLookTemperatureOffset)) look.temperatureOffset = record.temperatureOffset;
  if (given(format::kLookAmbient)) std::copy(record.ambient, record.ambient + 3, look.ambient.begin());
}

Result<Look> suggestLook(const format::Pack& pack, const format::VolumeRecord& volume, const GridChoice& grids) {
  Look look;
  look.scatteringOrders = 4;
  if (auto fitted = fitExtinction(pack, volume, grids, look); !fitted) return tl::unexpected(fitted.error());
  if (auto fitted = fitHeat(pack, volume, grids, look); !fitted) return tl::unexpected(fitted.error());
  applyLook(volume.look, look);
  return look;
}

}  // namespace billow::runtime
