// Packs whose frames have velocity grids, and slabs of which the optical depth is known.
#ifndef BILLOW_TESTS_LAYERS_FIXTURE_H
#define BILLOW_TESTS_LAYERS_FIXTURE_H

#include <array>
#include <string>
#include <vector>

#include "brick_corpus.h"
#include "sample_pack.h"

namespace billow::tests {

inline constexpr std::uint32_t kCloudDim = 32;               // voxels
inline constexpr std::uint32_t kCloudCells = kCloudDim / 8;  // bricks
inline constexpr std::uint32_t kFirstCell = 10;
inline constexpr double kMiddle = (kFirstCell * 8 + (kCloudDim - 1) / 2.0) * 0.1;  // world, of GridFrameBuilder's grids

struct MovingCloud {
  bool burning = false;                    // with its core as grid "flames"
  std::array<float, 3> velocity{0, 0, 0};  // everywhere, or
  bool tight = false;                      // only where the cloud is
  bool whirl = false;                      // in its place, a radian a second around z through the cloud's middle
  std::uint32_t shift = 0;                 // voxels along x, 0 to 8
};

namespace layers {

inline float densityOf(const MovingCloud& cloud, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return x < cloud.shift || x - cloud.shift >= kCloudDim ? 0.0f : cloudDensity(kCloudDim, x - cloud.shift, y, z);
}

// `valueAt` gives a grid's value in [0, 1] by voxel of the cloud's box and, along x, one brick more.
template <class Value>
format::GridFrame cloudGrid(format::PackWriter& writer, format::PackTables& tables, const Value& valueAt) {
  GridFrameBuilder grid(writer, 0);
  for (std::uint32_t cell = 0; cell < (kCloudCells + 1) * kCloudCells * kCloudCells; ++cell) {
    const std::uint32_t at[3] = {cell / (kCloudCells * kCloudCells), cell / kCloudCells % kCloudCells,
                                 cell % kCloudCells};
    std::vector<std::byte> texels(512);
    bool any = false;
    for (std::uint32_t i = 0; i < 512; ++i) {
      const float value = valueAt(at[0] * 8 + (i >> 6), at[1] * 8 + (i >> 3 & 7), at[2] * 8 + (i & 7));
      texels[i] = static_cast<std::byte>(std::clamp(value * 255, 0.0f, 255.0f));
      any = any || texels[i] != std::byte{0};
    }
    if (!any) continue;
    grid.brick({kFirstCell + at[0], kFirstCell + at[1], kFirstCell + at[2]}, format::kEncodingUniform8, texels, 0,
               1.0f / 255, format::kMaskTexel);
  }
  return grid.finish(tables);
}

inline format::GridFrame velocityGrid(format::PackWriter& writer, format::PackTables& tables, const MovingCloud& cloud,
                                      std::uint32_t axis) {
  if (cloud.tight) {
    GridFrameBuilder grid(writer, 0);
    for (std::uint32_t cell = 0; cell < (kCloudCells + 1) * kCloudCells * kCloudCells; ++cell) {
      const std::uint32_t at[3] = {cell / (kCloudCells * kCloudCells), cell / kCloudCells % kCloudCells,
                                   cell % kCloudCells};
      format::Mask3 mask{};
      for (std::uint32_t i = 0; i < 512; ++i) {
        const float value = densityOf(cloud, at[0] * 8 + (i >> 6), at[1] * 8 + (i >> 3 & 7), at[2] * 8 + (i & 7));
        if (value * 255 >= 1) mask.words[i >> 5] |= 1u << (i & 31);
      }
      if (std::all_of(std::begin(mask.words), std::end(mask.words), [](std::uint32_t w) { return w == 0; })) continue;
      grid.brick({kFirstCell + at[0], kFirstCell + at[1], kFirstCell + at[2]}, format::kEncodingConstant, {},
                 cloud.velocity[axis], 0, 0, mask);
    }
    return grid.finish(tables);
  }
  if (!cloud.whirl) {
    GridFrameBuilder grid(writer, cloud.velocity[axis]);
    grid.brick({kFirstCell, kFirstCell, kFirstCell}, format::kEncodingConstant, {}, cloud.velocity[axis], 0,
               format::kMaskAll);
    return grid.finish(tables);
  }
  // (-y, x, 0) around the middle, of 16 bits a voxel, with a margin of a brick.
  GridFrameBuilder grid(writer, 0);
  for (std::uint32_t cell = 0; cell < 512; ++cell) {
    const std::uint32_t at[3] = {kFirstCell - 1 + cell / 64, kFirstCell - 1 + cell / 8 % 8, kFirstCell - 1 + cell % 8};
    std::vector<std::byte> texels(1024);
    for (std::uint32_t i = 0; i < 512; ++i) {
      const double x = (at[0] * 8 + (i >> 6)) * 0.1 - kMiddle, y = (at[1] * 8 + (i >> 3 & 7)) * 0.1 - kMiddle;
      const double speed = axis == 0 ? -y : axis == 1 ? x : 0;
      const auto texel = static_cast<std::uint32_t>((speed + 8) / 16 * 65535 + 0.5);
      texels[2 * i] = static_cast<std::byte>(texel & 0xff);
      texels[2 * i + 1] = static_cast<std::byte>(texel >> 8);
    }
    grid.brick({at[0], at[1], at[2]}, format::kEncodingUniform16, texels, -8, 16.0f / 65535, format::kMaskAll);
  }
  return grid.finish(tables);
}

}  // namespace layers

// A noisy cloud of kCloudDim^3 voxels of 0.1 as grid "density", and its velocity.
inline std::vector<std::byte> movingCloudPack(const MovingCloud& cloud) {
  std::vector<std::string> names{"density"};
  if (cloud.burning) names.push_back("flames");
  const std::size_t matter = names.size();
  for (const char* axis : {"velocity.x", "velocity.y", "velocity.z"}) names.emplace_back(axis);
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", names, 1);
    const auto density = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return layers::densityOf(cloud, x, y, z);
    };
    const auto core = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return std::max(density(x, y, z) - 0.5f, 0.0f);
    };
    tables.gridFrames.push_back(layers::cloudGrid(writer, tables, density));
    if (cloud.burning) tables.gridFrames.push_back(layers::cloudGrid(writer, tables, core));
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      tables.grids[matter + axis].role = static_cast<std::uint32_t>(format::Role::velocityX) + axis;
      tables.gridFrames.push_back(layers::velocityGrid(writer, tables, cloud, axis));
    }
    return tables;
  });
}

// A cube of one density where the cloud is, of voxels `coarse` times as large: 1 or 2.
inline std::vector<std::byte> slabPack(float density, std::uint32_t coarse) {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density"}, 1);
    GridFrameBuilder grid(writer, 0);
    const std::uint32_t along = kCloudCells / coarse;
    for (std::uint32_t cell = 0; cell < along * along * along; ++cell) {
      grid.brick({kFirstCell / coarse + cell / (along * along), kFirstCell / coarse + cell / along % along,
                  kFirstCell / coarse + cell % along},
                 format::kEncodingConstant, {}, density, 0, format::kMaskAll);
    }
    format::GridFrame frame = grid.finish(tables);
    // Voxels' faces stay where they are, not their centres.
    for (std::uint32_t row = 0; row < 3; ++row) {
      frame.indexToWorld[5 * row] = 0.1 * coarse;
      frame.indexToWorld[4 * row + 3] = 0.05 * (coarse - 1);
    }
    tables.gridFrames.push_back(frame);
    return tables;
  });
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_LAYERS_FIXTURE_H
