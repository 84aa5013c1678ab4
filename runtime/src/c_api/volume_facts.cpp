#include "c_api/volume_facts.h"

#include <algorithm>
#include <cmath>

#include "billow/format/affine.h"

namespace billow::c_api {
namespace {

void findVoxels(const format::Pack& pack, const format::VolumeRecord& volume, VolumeFacts& facts) {
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    for (const std::uint32_t grid : {facts.grids.extinction, facts.grids.temperature, facts.grids.flames}) {
      if (grid == format::kNone) continue;
      const format::GridFrame& g = pack.gridFrame(volume, frame, grid);
      if ((g.flags & format::kGridPresent) == 0) continue;
      const double edge = std::cbrt(std::abs(format::determinant(g.indexToWorld)));
      if (facts.voxelSize > 0 && facts.voxelSize <= edge) continue;
      facts.voxelSize = edge;
      facts.anchor = {g.indexToWorld[3], g.indexToWorld[7], g.indexToWorld[11]};
    }
  }
}

bool hasVelocity(const format::Pack& pack, const format::VolumeRecord& volume) {
  const auto grids = pack.gridsOf(volume);
  return std::any_of(grids.begin(), grids.end(), [](const format::GridRecord& grid) {
    return grid.role >= static_cast<std::uint32_t>(format::Role::velocityX) &&
           grid.role <= static_cast<std::uint32_t>(format::Role::velocityZ);
  });
}

// What the pack says about the look, beside the runtime's defaults: without reading a page.
runtime::Look plainLook(const format::VolumeRecord& volume) {
  runtime::Look look;
  runtime::applyLook(volume.look, look);
  return look;
}

}  // namespace

std::vector<VolumeFacts> volumeFacts(const format::Pack& pack) {
  std::vector<VolumeFacts> all;
  for (std::uint32_t number = 0; number < pack.volumes().size(); ++number) {
    if (pack.isLevel(number)) continue;
    const format::VolumeRecord& volume = pack.volumes()[number];
    VolumeFacts facts;
    facts.number = number;
    facts.grids = runtime::chooseGrids(pack, volume);
    facts.velocity = hasVelocity(pack, volume);
    facts.look = plainLook(volume);
    if (volume.frameCount > 0) facts.box = runtime::worldBox(pack, volume, facts.grids, 0, volume.frameCount - 1);
    findVoxels(pack, volume, facts);
    all.push_back(facts);
  }
  return all;
}

double secondsOf(const format::Pack& pack, const format::VolumeRecord& volume) {
  const auto frames = pack.framesOf(volume);
  return frames.empty() ? 0 : frames.back().time + 1 / double{volume.framesPerSecond};
}

runtime::WorldBox transformed(const runtime::WorldBox& box, const std::array<double, 12>& objectToWorld) {
  runtime::WorldBox out;
  for (int corner = 0; corner < 8 && !box.empty; ++corner) {
    runtime::WorldBox point{.empty = false};
    for (std::size_t i = 0; i < 3; ++i) {
      double at = objectToWorld[i * 4 + 3];
      for (std::size_t j = 0; j < 3; ++j) {
        at += objectToWorld[i * 4 + j] * ((corner >> j & 1) != 0 ? box.max[j] : box.min[j]);
      }
      point.min[i] = point.max[i] = at;
    }
    runtime::addBox(point, out);
  }
  return out;
}

}  // namespace billow::c_api
