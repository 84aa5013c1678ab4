// billow.h as a game uses it: the shared library on the tests' device, through billow.hpp.
#ifndef BILLOW_TESTS_CAPI_FIXTURE_H
#define BILLOW_TESTS_CAPI_FIXTURE_H

#include <billow/billow.hpp>
#include <chrono>
#include <thread>
#include <vector>

#include "fake_stream.h"
#include "gpu_fixture.h"

namespace billow::tests {

inline constexpr std::uint32_t kSide = 64;  // pixels of a picture

class CapiTest : public GpuTest {
 protected:
  static Device device() {
    const runtime::HostDevice& host = gpu().host();
    Device device;
    device.instance = host.instance;
    device.physicalDevice = host.physicalDevice;
    device.device = host.device;
    device.getInstanceProcAddr = host.getInstanceProcAddr;
    device.uploadQueue = host.uploadQueue;
    device.uploadFamily = host.uploadFamily;
    device.drawFamily = host.drawFamily;
    return device;
  }

  static Config config() {
    Config config;
    config.gpuBudget = 16u << 20;
    config.cpuBudget = 32u << 20;
    config.stagingBytes = 1u << 20;
    config.framesInFlight = 1;
    return config;
  }

  static Context makeContext(const Config& with = config()) {
    return valueOf(Context::create(device(), with), "context");
  }

  static SpaceInfo smallSpace() {
    SpaceInfo info;
    info.metavoxels = 8;
    info.maxMetavoxels = 512;
    info.memoryBudget = 96u << 20;
    info.maxParticles = 1024;
    info.maxListEntries = 65536;
    info.drawsInFlight = 1;
    return info;
  }

  // Until the instance shows what is wanted in full; fails the test after 20 seconds.
  static void settle(Context& context, const Instance& instance) {
    UpdateInfo info;
    for (int i = 0; i < 4000; ++i) {
      ASSERT_TRUE(context.update(info));
      const InstanceState state = valueOf(instance.state(), "state");
      if (state.drawable != 0 && state.held == 0 && state.coarse == 0) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    FAIL() << "the instance does not become drawable";
  }

  // Looks at the box from its z axis.
  static View viewOf(const VolumeInfo& volume) {
    std::array<double, 3> center{}, eye{};
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      center[i] = (volume.min[i] + volume.max[i]) / 2;
      size = std::max(size, volume.max[i] - volume.min[i]);
    }
    eye = {center[0] + 0.3 * size, center[1] + 0.2 * size, center[2] + 2.2 * size};
    return lookAt(eye, center, {0, 1, 0}, 40);
  }

  struct Picture {
    std::unique_ptr<headless::SceneImage> color = image(4), depth = image(1);
    static std::unique_ptr<headless::SceneImage> image(std::size_t channels) {
      return valueOf(gpu().sceneImage(kSide, kSide, std::vector<float>(channels * kSide * kSide, -1)), "image");
    }
    std::vector<float> rgba() const { return valueOf(gpu().read(*color), "read"); }
  };

  static DrawInfo drawInfo(const Picture& into, const View& view) {
    DrawInfo info;
    info.colorFormat = BILLOW_COLOR_RGBA32F;
    info.view = &view;
    info.width = info.height = kSide;
    info.color = into.color->view();
    info.depth = into.depth->view();
    return info;
  }

  // What draw() gives for the picture that it recorded.
  static Error draw(Context& context, const DrawInfo& info) {
    Error error;
    const auto record = [&](VkCommandBuffer commands) -> runtime::Result<void> {
      if (const auto done = context.draw(commands, info); !done) error = done.error();
      return {};
    };
    EXPECT_TRUE(gpu().run(record));
    return error;
  }
};

inline std::vector<std::byte> smokePack(std::uint32_t frames = 4) {
  return sequencePack(frames, [](std::uint32_t) { return 20u; });
}

// With a pack of smoke.
class CapiPlay : public CapiTest {
 protected:
  // Stands at its first frame.
  static Instance standing(Context& context, const Pack& pack) {
    Playback still;
    still.speed = 0;
    still.interpolation = BILLOW_INTERPOLATION_HOLD;
    InstanceInfo info;
    info.pack = pack.id();
    info.playback = &still;
    return valueOf(context.addInstance(info), "instance");
  }

  PackFile file_{smokePack()};
};

inline double sum(const std::vector<float>& values) {
  double total = 0;
  for (const float value : values) total += double{value};
  return total;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_CAPI_FIXTURE_H
