// What tests of a streamer over a transport without a disk and without a device have in common.
#ifndef BILLOW_TESTS_STREAM_PLAN_FIXTURE_H
#define BILLOW_TESTS_STREAM_PLAN_FIXTURE_H

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fake_stream.h"

namespace billow::tests {

using runtime::AssetId;
using runtime::Drawable;
using runtime::InstanceId;
using runtime::Interpolation;
using runtime::Loop;
using runtime::Playback;

inline constexpr double kTick = 1.0 / 60;

inline std::uint32_t evenBricks(std::uint32_t) {
  return 16;
}

class StreamPlanning : public testing::Test {
 protected:
  static AssetId open(FakeStream& stream, const PackFile& file) {
    const auto asset = stream->open({.path = file.path()});
    EXPECT_TRUE(asset) << asset.error().message;
    return asset.value_or(AssetId{});
  }

  static InstanceId add(FakeStream& stream, AssetId asset, const Playback& playback, double time = 0) {
    const auto id = stream->addInstance({.asset = asset, .time = time, .playback = playback});
    EXPECT_TRUE(id);
    return id.value_or(InstanceId{});
  }

  // Sum of weights, frames that live, and nothing that was given back.
  static void expectSound(FakeStream& stream, const Drawable& drawable) {
    float sum = 0;
    for (std::uint32_t i = 0; i < drawable.count; ++i) {
      const runtime::Layer& layer = drawable.layers[i];
      ASSERT_NE(layer.frame, nullptr);
      EXPECT_FALSE(stream.transport().isRetired(layer.frame));
      EXPECT_GE(layer.weight, 0);
      sum += layer.weight;
    }
    EXPECT_TRUE(drawable.count == 0 || std::abs(sum - 1) < 1e-5f) << sum;
  }

  static std::set<std::uint32_t> framesOf(FakeStream& stream, const Drawable& drawable) {
    std::set<std::uint32_t> frames;
    for (std::uint32_t i = 0; i < drawable.count; ++i) {
      frames.insert(stream.transport().known(drawable.layers[i].frame).frame);
    }
    return frames;
  }

  static std::uint64_t bytesOfAll(const PackFile& file) {
    const auto pack = *format::Pack::openFile(file.path());
    std::uint64_t bytes = 0;
    for (const format::GridFrame& grid : pack.gridFrames()) bytes += format::gpuBytes(grid).total() + 256;
    return bytes;
  }
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_STREAM_PLAN_FIXTURE_H
