// How alike the two ways to draw are: billow_agreement_bench PACK [--axis] draws three frames of the pack's first
// volume by the direct march and by metavoxels of the volume's voxel size and of half of it, and prints the difference
// in decibels: of linear radiance, against the brightest channel, and of sRGB. --axis: the sun stands on an axis of the
// world. It needs nothing but libvulkan and a driver at run time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "bench_failure.h"
#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"

namespace {

using namespace billow;
using bench::fail;
using bench::valueOf;

constexpr std::uint32_t kWidth = 640, kHeight = 360;

double srgb(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

void print(const headless::Picture& direct, const headless::Picture& metavoxel, std::int32_t frame, double scale) {
  double linear = 0, display = 0, most = 0;
  for (std::size_t i = 0; i < direct.rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    const auto a = static_cast<double>(direct.rgba[i]), b = static_cast<double>(metavoxel.rgba[i]);
    most = std::max(most, a);
    linear += (a - b) * (a - b);
    display += (srgb(a) - srgb(b)) * (srgb(a) - srgb(b));
  }
  const double count = static_cast<double>(direct.rgba.size()) * 0.75;
  fmt::print("{:>6} {:>6} {:>10.2f} {:>10.2f}\n", frame, scale, 20 * std::log10(most / std::sqrt(linear / count)),
             -10 * std::log10(display / count));
}

struct Volume {
  const format::Pack& pack;
  const format::VolumeRecord& record;
  runtime::GridChoice grids;
  runtime::WorldBox box;  // of all frames
};

void compare(headless::Headless& gpu, const Volume& volume, std::uint32_t frameIndex, bool axis) {
  const auto renderer = valueOf(runtime::Renderer::create(gpu.host(), {.gpuBudget = std::uint64_t{4} << 30}));
  const auto frame = valueOf(renderer->upload(volume.pack, 0, frameIndex, {.grids = volume.grids}));
  const std::uint32_t number =
      volume.grids.extinction != format::kNone ? volume.grids.extinction : volume.grids.temperature;
  const format::GridFrame& grid = volume.pack.gridFrame(volume.record, frameIndex, number);
  runtime::Look look = valueOf(runtime::suggestLook(volume.pack, volume.record, volume.grids));
  look.scatteringOrders = 4;
  std::array<double, 3> eye{};
  double diagonal = 0;
  runtime::MetavoxelDraw draw;
  for (std::size_t i = 0; i < 3; ++i) {
    draw.center[i] = (volume.box.min[i] + volume.box.max[i]) / 2;
    draw.anchor[i] = grid.indexToWorld[4 * i + 3];
    diagonal += (volume.box.max[i] - volume.box.min[i]) * (volume.box.max[i] - volume.box.min[i]);
  }
  diagonal = std::sqrt(diagonal);
  const double towards[3] = {0.55, -0.75, 0.35};
  for (std::size_t i = 0; i < 3; ++i) eye[i] = draw.center[i] + towards[i] * 1.7 * diagonal;
  draw.view = runtime::lookAt(eye, draw.center, {0, 0, 1}, 35);
  draw.sun.direction = axis ? std::array<float, 3>{0, 0, 1} : std::array<float, 3>{-0.6f, -0.4f, 0.7f};
  draw.sun.irradiance = {3.2f, 3.2f, 3.2f};
  draw.scattering = {.anisotropy = look.anisotropy, .ambient = look.ambient, .orders = look.scatteringOrders};
  draw.width = kWidth;
  draw.height = kHeight;
  const runtime::MetavoxelVolume placed{.frame = frame.get(), .look = look};
  draw.volumes = {&placed, 1};
  runtime::DrawInfo info;
  info.frame = frame.get();
  info.view = draw.view;
  info.sun = draw.sun;
  info.look = look;
  info.width = kWidth;
  info.height = kHeight;
  const headless::Picture direct = valueOf(gpu.render(*renderer, info));
  for (const double scale : {1.0, 0.5}) {
    draw.voxelSize = static_cast<float>(std::abs(grid.indexToWorld[0]) * scale);
    const double along = std::ceil(diagonal / static_cast<double>(draw.voxelSize) / 30) + 1;
    const runtime::MetavoxelConfig config{.metavoxels = static_cast<std::uint32_t>(along),
                                          .memoryBudget = std::uint64_t{2} << 30};
    const auto metavoxels = valueOf(runtime::Metavoxels::create(*renderer, config));
    print(direct, valueOf(gpu.render(*renderer, *metavoxels, draw, {})),
          volume.pack.framesOf(volume.record)[frameIndex].number, scale);
    gpu.waitIdle();
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool axis = argc == 3 && std::string(argv[2]) == "--axis";
  if (argc < 2 || (argc > 2 && !axis)) fail("usage: billow_agreement_bench PACK [--axis]");
  const format::Pack pack = valueOf(format::Pack::openFile(argv[1]));
  if (pack.volumes().empty()) fail("the pack has no volume");
  const format::VolumeRecord& record = pack.volumes()[0];
  const runtime::GridChoice grids = runtime::chooseGrids(pack, record);
  const Volume volume{pack, record, grids, runtime::worldBox(pack, record, grids, 0, record.frameCount - 1)};
  const auto gpu = valueOf(headless::Headless::create({}));
  fmt::print("{} on {}, metavoxels against the direct march\n{:>6} {:>6} {:>10} {:>10}\n", argv[1], gpu->deviceName(),
             "frame", "voxel", "linear dB", "sRGB dB");
  for (std::uint32_t i = 0; i < record.frameCount; i += (record.frameCount + 2) / 3) compare(*gpu, volume, i, axis);
  return 0;
}
