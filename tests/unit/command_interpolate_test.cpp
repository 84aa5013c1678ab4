// A real simulation of which every second frame is left out, and drawn again from its neighbours.
#include <gtest/gtest.h>

#include <iostream>

#include "billow/runtime/look.h"
#include "metavoxel_fixture.h"
#include "run_command.h"

namespace billow::tests {
namespace {

using runtime::Layer;

// World units a second of the sequence's velocity 1: that with which frames are carried nearest to their neighbours.
constexpr float kVelocityScale = 0.04f;

std::string dataFolder() {
  const char* data = std::getenv("BILLOW_DATA");
  const std::filesystem::path folder = data == nullptr ? "" : std::filesystem::path(data) / "smoke_vel";
  return std::filesystem::is_directory(folder) ? folder.string() : "";
}

// Decibels between optical depths, the peak being the first's largest, where either is above 0.
double depthDecibels(const std::vector<float>& a, const std::vector<float>& b) {
  double squares = 0, peak = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == 0 && b[i] == 0) continue;
    ++count;
    squares += (double{a[i]} - double{b[i]}) * (double{a[i]} - double{b[i]});
    peak = std::max(peak, double{a[i]});
  }
  return 10 * std::log10(peak * peak * static_cast<double>(count) / squares);
}

class Interpolate : public MetavoxelTest {
 protected:
  struct Drawn {
    headless::Picture picture;
    std::vector<float> depths;  // of the space's columns
  };

  Drawn drawLayers(runtime::Metavoxels& metavoxels, const format::Pack& pack, const runtime::GridChoice& grids,
                   const std::vector<Layer>& layers) {
    const runtime::WorldBox box = runtime::worldBox(pack, pack.volumes()[0], grids, 0, 3);
    MetavoxelDraw draw;
    for (std::size_t i = 0; i < 3; ++i) draw.center[i] = (box.min[i] + box.max[i]) / 2;
    draw.view =
        runtime::lookAt({draw.center[0] + 2, draw.center[1] - 6, draw.center[2] + 1}, draw.center, {0, 0, 1}, 30);
    draw.sun.direction = {-0.3f, -0.5f, 0.8f};
    draw.voxelSize = 1.0f / 30;
    draw.width = draw.height = 128;
    draw.colorFormat = runtime::ColorFormat::single;
    draw.cull = false;
    const runtime::MetavoxelVolume volume{
        .layers = layers,
        .velocityScale = kVelocityScale,
        .look = valueOf(runtime::suggestLook(pack, pack.volumes()[0], grids), "look")};
    draw.volumes = {&volume, 1};
    Drawn drawn{.picture = render(metavoxels, draw), .depths = {}};
    drawn.depths = valueOf(gpu().readShadow(*renderer_, metavoxels), "shadow");
    return drawn;
  }
};

TEST_F(Interpolate, AdvectedIsNearerThanBlendedThanHeld) {
  if (dataFolder().empty()) {
    std::cout << "skipped: BILLOW_DATA has no smoke_vel folder\n";
    return;
  }
  const TempFolder folder;
  const std::string path = folder / "smoke.blw";
  const CommandResult compiled = shell("$BILLOW compile '" + dataFolder() + "' -o '" + path + "'");
  ASSERT_EQ(compiled.code, 0) << compiled.err;
  const format::Pack pack = valueOf(format::Pack::openFile(path), "pack");
  const format::VolumeRecord& volume = pack.volumes()[0];
  const runtime::GridChoice grids = runtime::withVelocity(pack, volume, runtime::chooseGrids(pack, volume));
  ASSERT_NE(grids.velocityZ, format::kNone);
  std::vector<std::unique_ptr<runtime::Frame>> frames;
  for (std::uint32_t i = 0; i < 4; ++i) frames.push_back(upload(*renderer_, pack, i, {.grids = grids}));
  MetavoxelConfig config = smallConfig();
  config.edge = 32;
  config.metavoxels = 6;
  config.maxMetavoxels = 216;
  const auto metavoxels = make(config);
  for (std::size_t k = 1; k < 3; ++k) {
    const runtime::Frame *before = frames[k - 1].get(), *after = frames[k + 1].get();
    const float time = 1 / volume.framesPerSecond;
    const Drawn truth = drawLayers(*metavoxels, pack, grids, {{frames[k].get()}});
    const Drawn held = drawLayers(*metavoxels, pack, grids, {{before}});
    const Drawn blended = drawLayers(*metavoxels, pack, grids, {{before, 0.5f}, {after, 0.5f}});
    const Drawn advected = drawLayers(*metavoxels, pack, grids, {{before, 0.5f, time}, {after, 0.5f, -time}});
    const auto picture = [&](const Drawn& drawn) { return pictureDecibels(truth.picture, drawn.picture); };
    const auto depth = [&](const Drawn& drawn) { return depthDecibels(truth.depths, drawn.depths); };
    std::cout << "frame " << k + 1 << ", dB of pictures and of depths: hold " << picture(held) << ' ' << depth(held)
              << ", blend " << picture(blended) << ' ' << depth(blended) << ", advect " << picture(advected) << ' '
              << depth(advected) << '\n';
    EXPECT_GT(picture(blended), picture(held) + 1);
    EXPECT_GT(picture(advected), picture(blended) + 1);
    EXPECT_GT(depth(blended), depth(held) + 1);
    EXPECT_GT(depth(advected), depth(blended) + 1);
  }
  gpu().waitIdle();
}

}  // namespace
}  // namespace billow::tests
