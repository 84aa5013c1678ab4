#include "space.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "billow/format/affine.h"
#include "params.h"

namespace billow::runtime {
namespace {

static_assert(sizeof(format::Particle) == gpu::kParticleWords * 4);

double dot(const Vec3d& a, const Vec3d& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vec3d scaled(const Vec3d& v, double factor) {
  return {v[0] * factor, v[1] * factor, v[2] * factor};
}

Vec3d unit(const Vec3d& v) {
  return scaled(v, 1 / std::sqrt(dot(v, v)));
}

Vec3d minus(const Vec3d& a, const Vec3d& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Vec3d toDouble(const std::array<float, 3>& v) {
  return {double{v[0]}, double{v[1]}, double{v[2]}};
}

gpu::vec4 vec4(const Vec3d& v, double w) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), static_cast<float>(w)};
}

std::uint32_t log2Of(std::uint32_t power) {
  return static_cast<std::uint32_t>(std::countr_zero(power));
}

// The axis of the world that is most nearly perpendicular to z, made so.
Vec3d perpendicular(const Vec3d& z) {
  std::size_t least = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(z[i]) < std::abs(z[least])) least = i;
  }
  Vec3d x{0, 0, 0};
  x[least] = 1;
  return unit(minus(x, scaled(z, dot(x, z))));
}

// Widens [low, high] (voxels of the space) by what a grid's active voxels reach.
void addReach(const Space& space, const format::GridFrame& frame, Vec3d& low, Vec3d& high) {
  for (int corner = 0; corner < 8; ++corner) {
    double at[3];
    for (int i = 0; i < 3; ++i) at[i] = (corner >> i & 1) != 0 ? frame.activeMax[i] + 1.0 : frame.activeMin[i] - 1.0;
    Vec3d world{};
    for (std::size_t row = 0; row < 3; ++row) {
      const double* m = frame.indexToWorld + row * 4;
      world[row] = m[0] * at[0] + m[1] * at[1] + m[2] * at[2] + m[3];
    }
    const Vec3d from = minus(world, space.center);
    for (std::size_t i = 0; i < 3; ++i) {
      const double voxel = dot(space.axes[i], from) / space.voxel + space.half;
      low[i] = std::min(low[i], voxel);
      high[i] = std::max(high[i], voxel);
    }
  }
}

std::optional<CellRange> cellsOf(const Space& space, const Vec3d& low, const Vec3d& high) {
  CellRange range{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double last = space.axis - 1.0;
    // A cell reads half a voxel beyond its edge, and rounding may move that.
    const double first = std::floor((low[i] - 1) / space.inner), end = std::floor((high[i] + 1) / space.inner);
    if (!(first <= last) || !(end >= 0)) return std::nullopt;
    range.first[i] = static_cast<std::uint32_t>(std::max(first, 0.0));
    range.count[i] = static_cast<std::uint32_t>(std::min(end, last)) - range.first[i] + 1;
  }
  return range;
}

// From ways in the volume's own world to voxels of the space.
std::array<Vec3d, 3> ownToSpace(const Space& space, const MetavoxelVolume& volume) {
  std::array<Vec3d, 3> rows;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d column{volume.objectToWorld[i], volume.objectToWorld[4 + i], volume.objectToWorld[8 + i]};
      rows[row][i] = dot(space.axes[row], column) / space.voxel;
    }
  }
  return rows;
}

DrawInfo drawInfoOf(const MetavoxelDraw& draw, Look look) {
  look.anisotropy = draw.scattering.anisotropy;
  look.ambient = draw.scattering.ambient;
  look.scatteringOrders = draw.scattering.orders;
  DrawInfo info;
  info.view = draw.view;
  info.sun = draw.sun;
  info.look = look;
  info.quality.step = draw.step;
  info.quality.jitter = draw.jitter;
  info.background = draw.background;
  info.width = draw.width;
  info.height = draw.height;
  return info;
}

// The scene's shadow map in voxels of the space. False where it is not one of this light's.
bool addShadowMap(const Space& space, const SceneShadow& shadow, gpu::MetavoxelParams& params) {
  constexpr double kSlack = 1e-4;  // hosts compute matrices in floats
  Vec3d along[3];                  // what a voxel's step along each axis adds to a row
  double at[3];                    // the rows at the space's corner
  for (std::size_t row = 0; row < 3; ++row) {
    const double* m = shadow.worldToMap.data() + row * 4;
    const Vec3d way{m[0], m[1], m[2]};
    at[row] = dot(way, space.center) + m[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      along[row][axis] = dot(way, space.axes[axis]) * space.voxel;
      at[row] -= along[row][axis] * space.half;
    }
    const double length = std::sqrt(dot(along[row], along[row]));
    const double light = std::abs(along[row][2]);
    if (!std::isfinite(length) || !std::isfinite(at[row]) || !(length > 0)) return false;
    if (row < 2 ? light > kSlack * length : light < kSlack * length) return false;
  }
  const auto number = [](double value) { return static_cast<float>(value); };
  const double texels = std::max(std::hypot(along[0][0], along[1][0]), std::hypot(along[0][1], along[1][1]));
  const double toZ = 1 / along[2][2];
  params.mapStep = {number(along[0][0]), number(along[1][0]), number(along[0][1]), number(along[1][1])};
  params.mapAt = {number(at[0]), number(at[1]), shadow.empty, number(std::clamp(std::ceil(texels), 2.0, 4.0))};
  params.mapZ = {number(toZ), number(-along[2][0] * toZ), number(-along[2][1] * toZ), number(-at[2] * toZ)};
  return true;
}

void addPlanes(const Space& space, const MetavoxelDraw& draw, const MetavoxelSizes& sizes,
               gpu::MetavoxelParams& params) {
  const Vec3d forward = toDouble(draw.view.forward), right = toDouble(draw.view.right), up = toDouble(draw.view.up);
  const double tanHeight = double{draw.view.tanHalfHeight};
  const double tanWidth = tanHeight * draw.width / draw.height;
  const Vec3d none{0, 0, 0};
  const Vec3d wide = scaled(forward, tanWidth), high = scaled(forward, tanHeight);
  const Vec3d inward[gpu::kPlanes] = {forward, minus(wide, minus(none, right)), minus(wide, right),
                                      minus(high, minus(none, up)), minus(high, up)};
  const Vec3d eye = minus(draw.view.eye, space.center);
  for (std::size_t i = 0; i < gpu::kPlanes; ++i) {
    Vec3d plane{};
    double offset = -dot(inward[i], eye);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      plane[axis] = dot(inward[i], space.axes[axis]) * space.voxel;
      offset -= plane[axis] * space.half;
    }
    // With a light field what is not seen lights what is.
    if (fieldDrawn(draw, sizes)) offset += kUnseenLight * std::sqrt(dot(plane, plane));
    params.planes[i] = vec4(plane, offset);
  }
}

void addField(const MetavoxelDraw& draw, const MetavoxelSizes& sizes, gpu::MetavoxelParams& params) {
  const FieldSizes& field = sizes.field;
  params.field = {field.edge, field.perCell, field.levels, 0};
  params.fieldScale = {static_cast<float>(sizes.inner) / static_cast<float>(std::max(field.perCell, 1u)),
                       draw.scattering.surroundings, 0, 0};
  for (std::size_t i = 0; i < gpu::kFieldLevels; ++i) {
    const auto at = [&](std::size_t part) { return static_cast<std::int32_t>(field.level[i][part]); };
    params.levels[i] = {at(0), at(1), at(2), at(3)};
  }
}

}  // namespace

bool fieldDrawn(const MetavoxelDraw& draw, const MetavoxelSizes& sizes) {
  return sizes.field.edge != 0 && draw.scattering.surroundings > 0;
}

Space spaceOf(const MetavoxelDraw& draw, const MetavoxelSizes& sizes) {
  Space space{};
  const Vec3d z = unit(scaled(toDouble(draw.sun.direction), -1));
  const Vec3d x = perpendicular(z);
  space.axes = {x, cross(z, x), z};
  space.voxel = double{draw.voxelSize};
  space.axis = sizes.axis;
  space.inner = sizes.inner;
  space.half = 0.5 * sizes.axis * sizes.inner;
  for (const Vec3d& axis : space.axes) {
    // Voxel k has its centre at middle - half + k + 1/2.
    const double shift = space.half - 0.5;
    const double anchor = dot(axis, draw.anchor);
    const double middle = std::round((dot(axis, draw.center) - anchor) / space.voxel - shift) + shift;
    for (std::size_t i = 0; i < 3; ++i) space.center[i] += axis[i] * (anchor + middle * space.voxel);
  }
  return space;
}

std::optional<PlacedLayer> placeLayer(const Space& space, const MetavoxelDraw& draw, const MetavoxelVolume& volume,
                                      const Layer& layer) {
  const ResidentFrame& frame = frameOf(layer);
  Look look = volume.look;
  look.extinctionScale *= layer.weight;
  look.emissionScale *= layer.weight;
  PlacedLayer placed{.params = viewParams(drawInfoOf(draw, look)), .cells = std::nullopt};
  placed.params.bricks = addresses(0, frame.bricks_);
  placed.params.bricks.x = frame.shape_.xBits | frame.shape_.yBits << 8;
  const Flow flow = flowOf(layer, ownToSpace(space, volume), double{volume.velocityScale}, double{kFarthestCarried});
  std::copy(flow.rows.begin(), flow.rows.end(), placed.params.flow);
  constexpr double kFar = 1e300;
  Vec3d low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  const FrameIndices read = indicesOf(layer);
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (!read[slot]) continue;
    ResidentGrid grid = frame.grids_[slot];
    format::compose(volume.objectToWorld, frame.grids_[slot].frame.indexToWorld, grid.frame.indexToWorld);
    if (!format::invertible(grid.frame.indexToWorld)) return std::nullopt;
    placed.params.grids[slot] = gridParams(grid, space.center, Filter::trilinear);
    if (slot < gpu::kMatterSlots) addReach(space, grid.frame, low, high);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] -= double{flow.rows[i].w};
    high[i] += double{flow.rows[i].w};
  }
  placed.cells = cellsOf(space, low, high);
  return placed;
}

gpu::MarchParams viewOf(const MetavoxelDraw& draw) {
  return viewParams(drawInfoOf(draw, {}));
}

std::optional<gpu::MetavoxelParams> paramsOf(const Space& space, const MetavoxelDraw& draw,
                                             const MetavoxelConfig& config, const MetavoxelSizes& sizes,
                                             std::uint32_t number) {
  gpu::MetavoxelParams params{};
  const bool shadowed = draw.sceneShadow.view != VK_NULL_HANDLE;
  if (shadowed && !addShadowMap(space, draw.sceneShadow, params)) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) {
    params.toVoxel[i] = vec4(scaled(space.axes[i], 1 / space.voxel), space.half);
    params.toWorld[i] = vec4(scaled(space.axes[i], space.voxel), space.half);
  }
  params.eye = vec4(minus(draw.view.eye, space.center), space.voxel);
  addPlanes(space, draw, sizes, params);
  params.tint = vec4(toDouble(draw.lightExtinction), 1.0 / sizes.cubeLayers);
  params.texel = vec4(
      {1.0 / (sizes.slotsX * sizes.edge), 1.0 / (sizes.slotsY * sizes.edge), 1.0 / (sizes.slotsZ * sizes.edge)}, 0);
  const std::uint32_t flags =
      (draw.cull ? gpu::kFlagCull : 0) | (draw.attenuation == Attenuation::reciprocal ? gpu::kFlagReciprocal : 0) |
      (draw.sceneDepth != VK_NULL_HANDLE ? gpu::kFlagSceneDepth : 0) | (config.keepFilled ? gpu::kFlagKeep : 0) |
      (draw.refill == Refill::changed ? gpu::kFlagChanged : 0) | (draw.refill == Refill::never ? gpu::kFlagNever : 0) |
      (fieldDrawn(draw, sizes) ? gpu::kFlagField : 0);
  params.space = {sizes.axis, sizes.edge, sizes.inner, flags};
  params.pool = {log2Of(sizes.slotsX), log2Of(sizes.slotsY), sizes.slots(), sizes.most};
  params.limits = {static_cast<std::uint32_t>(draw.particles.size()), config.maxListEntries,
                   static_cast<std::uint32_t>(draw.volumes.size()), sizes.rounds};
  params.matter.w = draw.blend == Blend::weighted ? 1 : 0;
  params.picture = {(draw.width + 7) / 8, (draw.height + 7) / 8, number, sizes.cellBits()};
  addField(draw, sizes, params);
  return params;
}

}  // namespace billow::runtime
