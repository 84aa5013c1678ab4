// Streaming on a device: what is drawn of a streamed moment is what is drawn of the same frames, uploaded at once.
#include <chrono>
#include <random>
#include <thread>

#include "gpu_fixture.h"
#include "fake_stream.h"

namespace billow::tests {
namespace {

using runtime::AssetId;
using runtime::Drawable;
using runtime::InstanceId;
using runtime::Interpolation;
using runtime::Loop;

constexpr double kTick = 1.0 / 60;

class StreamGpu : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    renderer_ = makeRenderer();
  }
  void TearDown() override {
    gpu().waitIdle();
    streamer_.reset();
    renderer_.reset();
    GpuTest::TearDown();
  }

  void create(const runtime::StreamConfig& config = {}) {
    streamer_ = valueOf(runtime::Streamer::create(*renderer_, config), "the streamer");
  }

  AssetId open(const PackFile& file) { return valueOf(streamer_->open({.path = file.path()}), "open"); }

  void update(double seconds = kTick) {
    streamer_->update({.seconds = seconds});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  // Updates until the moment of the instance, which stands, is there in full detail.
  bool settle(InstanceId id, int most = 3000) {
    for (int i = 0; i < most; ++i) {
      update();
      const Drawable drawable = streamer_->drawable(id);
      if (drawable.count > 0 && !drawable.held && !drawable.coarse) return true;
    }
    const auto stats = streamer_->stats();
    ADD_FAILURE() << "count " << streamer_->drawable(id).count << ", resident " << stats.framesResident << ", queued "
                  << stats.loadsQueued << ", reading " << stats.loadsReading << ", decoding " << stats.loadsDecoding
                  << ", uploading " << stats.loadsUploading;
    while (const auto error = streamer_->takeError()) ADD_FAILURE() << error->message;
    return false;
  }

  headless::Picture draw(const runtime::Frame& frame) {
    return valueOf(gpu().render(*renderer_, {.frame = &frame,
                                             .view = runtime::lookAt({6, 4, 5}, {0.8, 0.8, 0.8}, {0, 0, 1}, 30),
                                             .width = 64,
                                             .height = 64}),
                   "render");
  }

  std::unique_ptr<runtime::Renderer> renderer_;
  std::unique_ptr<runtime::Streamer> streamer_;
};

std::uint32_t someBricks(std::uint32_t frame) {
  return 8 + frame % 5;
}

TEST_F(StreamGpu, PicturesAreThoseOfUploadedFrames) {
  const PackFile file(sequencePack(8, someBricks));
  create();
  const AssetId asset = open(file);
  const auto pack = valueOf(format::Pack::openFile(file.path()), "the pack");
  const InstanceId id = valueOf(
      streamer_->addInstance({.asset = asset, .playback = {.speed = 0, .interpolation = Interpolation::hold}}), "add");
  for (std::uint32_t frame = 0; frame < 8; ++frame) {
    streamer_->seek(id, (frame + 0.5) / 24);
    ASSERT_TRUE(settle(id));
    const Drawable drawable = streamer_->drawable(id);
    ASSERT_EQ(drawable.count, 1u);
    const auto streamed = draw(*drawable.layers[0].frame);
    const auto whole = upload(*renderer_, pack, frame);
    gpu().waitIdle();
    const auto uploaded = draw(*whole);
    EXPECT_EQ(streamed.rgba, uploaded.rgba) << frame;
    EXPECT_EQ(streamed.depth, uploaded.depth) << frame;
    EXPECT_GT(*std::max_element(streamed.rgba.begin(), streamed.rgba.end()), 0.01f);
    gpu().waitIdle();
  }
  EXPECT_FALSE(streamer_->takeError());
}

}  // namespace
}  // namespace billow::tests
