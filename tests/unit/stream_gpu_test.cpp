// Streaming on a device: what is drawn of a streamed moment is what is drawn of the same frames, uploaded at once.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <random>
#include <thread>

#include "fake_stream.h"
#include "gpu_fixture.h"

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

// With memory for a quarter of it, through seeks, at any speed, and whatever is drawn in between.
TEST_F(StreamGpu, AQuarterOfTheMemoryPlaysAndEndsInTheRightPicture) {
  const auto bricks = [](std::uint32_t frame) { return 150 + frame % 7; };
  const PackFile file(sequencePack(32, bricks));
  const auto pack = valueOf(format::Pack::openFile(file.path()), "the pack");
  std::uint64_t bytes = 0;
  for (const format::GridFrame& grid : pack.gridFrames()) bytes += format::gpuBytes(grid).total();
  const runtime::StreamConfig config{.gpuBudget = bytes / 4, .cpuBudget = 4u << 20, .stagingBytes = 256u << 10};
  create(config);
  const AssetId asset = open(file);
  const InstanceId id = valueOf(streamer_->addInstance({.asset = asset}), "add");
  std::mt19937 random(1);
  for (int step = 0; step < 400; ++step) {
    if (step % 50 == 0) streamer_->seek(id, std::uniform_real_distribution<double>(0, 1.3)(random));
    if (step % 70 == 0) {
      streamer_->setPlayback(id, {.speed = std::uniform_real_distribution<double>(-4, 4)(random),
                                  .loop = static_cast<Loop>(random() % 3)});
    }
    update();
    const runtime::StreamStats stats = streamer_->stats();
    EXPECT_LE(stats.gpuAllocated, config.gpuBudget);
    EXPECT_LE(stats.cpuPeak, config.cpuBudget);
    if (step % 40 == 39 && streamer_->drawable(id).count > 0) draw(*streamer_->drawable(id).layers[0].frame);
  }
  for (const std::uint32_t frame : {3u, 30u, 17u}) {
    streamer_->setPlayback(id, {.speed = 0, .interpolation = Interpolation::hold});
    streamer_->seek(id, (frame + 0.5) / 24);
    ASSERT_TRUE(settle(id));
    const auto streamed = draw(*streamer_->drawable(id).layers[0].frame);
    const auto whole = upload(*renderer_, pack, frame);
    gpu().waitIdle();
    EXPECT_EQ(streamed.rgba, draw(*whole).rgba) << frame;
    gpu().waitIdle();
  }
  EXPECT_FALSE(streamer_->takeError());
}

TEST_F(StreamGpu, ACorruptPageIsToldAndTheRestPlaysOn) {
  std::vector<std::byte> bytes = sequencePack(12, [](std::uint32_t) { return 200u; });
  const auto sound = valueOf(format::Pack::open(format::makeMemorySource(bytes)), "the pack");
  const auto pages = sound.pagesOf(sound.gridFrame(sound.volumes()[0], 6, 0));
  const std::uint32_t page = pages.back();
  for (const format::SectionEntry& section : sound.sections()) {
    if (section.type == format::kSectionPages) bytes[section.offset + sound.pages()[page].offset + 9] ^= std::byte{1};
  }
  const PackFile file(bytes);
  create();
  const AssetId asset = open(file);
  const InstanceId id = valueOf(streamer_->addInstance({.asset = asset}), "add");
  std::optional<runtime::StreamError> error;
  for (int i = 0; i < 600 && !error; ++i) {
    update();
    error = streamer_->takeError();
  }
  ASSERT_TRUE(error);
  // It may come before the first frame does.
  for (int i = 0; i < 600 && streamer_->drawable(id).count == 0; ++i) update();
  EXPECT_EQ(error->page, page) << error->message;
  EXPECT_EQ(error->code, runtime::ErrorCode::pack);
  double before = streamer_->drawable(id).time;
  int moved = 0;
  for (int i = 0; i < 200; ++i) {
    update();
    moved += streamer_->drawable(id).time != before;
    before = streamer_->drawable(id).time;
    EXPECT_GT(streamer_->drawable(id).count, 0u);
  }
  EXPECT_GT(moved, 100);
  EXPECT_FALSE(streamer_->takeError()) << "the same page is told once";
}

// A host's source whose reads end at once, and a job system that begins nothing until it is told to.
TEST_F(StreamGpu, APackThatIsBeingOpenedOutlivesADevice) {
  class Memory final : public runtime::AsyncSource {
   public:
    explicit Memory(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
    std::uint64_t size() const override { return bytes_.size(); }
    void read(std::uint64_t offset, std::span<std::byte> into, runtime::ReadDone done) override {
      std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), into.size(), into.begin());
      done.call(done.context, true);
    }

   private:
    std::vector<std::byte> bytes_;
  };
  struct Stored {
    std::mutex mutex;
    std::vector<std::pair<void (*)(void*), void*>> jobs;
    static void submit(void* user, void (*job)(void*), void* context) {
      auto& self = *static_cast<Stored*>(user);
      const std::lock_guard lock(self.mutex);
      self.jobs.emplace_back(job, context);
    }
    void runAll() {
      std::unique_lock lock(mutex);
      const auto taken = std::exchange(jobs, {});
      lock.unlock();
      for (const auto& [job, context] : taken) job(context);
    }
  } stored;
  create({.threads = 0, .jobs = {.submit = &Stored::submit, .user = &stored}});
  const auto source = std::make_shared<Memory>(sequencePack(8, someBricks));
  const AssetId asset = valueOf(streamer_->openLater({.source = source}), "openLater");
  update();
  EXPECT_EQ(streamer_->state(asset), runtime::Streamer::AssetState::opening);
  streamer_->detach();
  stored.runAll();  // too late: they do nothing
  ASSERT_TRUE(streamer_->attach(*renderer_));
  update();
  EXPECT_EQ(streamer_->state(asset), runtime::Streamer::AssetState::opening);
  stored.runAll();
  update();
  EXPECT_EQ(streamer_->state(asset), runtime::Streamer::AssetState::ready);
  EXPECT_TRUE(streamer_->openLater({.source = source}));
  streamer_.reset();
  stored.runAll();
  EXPECT_EQ(source.use_count(), 1) << "nobody holds it any more";
}

TEST_F(StreamGpu, ADeviceIsLeftAndTakenUpAgain) {
  const PackFile file(sequencePack(8, someBricks));
  create();
  const AssetId asset = open(file);
  const InstanceId id = valueOf(streamer_->addInstance({.asset = asset}), "add");
  for (int i = 0; i < 30; ++i) update();
  gpu().waitIdle();
  streamer_->detach();
  EXPECT_EQ(streamer_->drawable(id).count, 0u);
  for (int i = 0; i < 7; ++i) update();
  renderer_ = makeRenderer();
  ASSERT_TRUE(streamer_->attach(*renderer_));
  EXPECT_FALSE(streamer_->attach(*renderer_)) << "there is one already";
  streamer_->setPlayback(id, {.speed = 0, .interpolation = Interpolation::hold});
  ASSERT_TRUE(settle(id));
  EXPECT_NEAR(streamer_->drawable(id).time, std::fmod(37 * kTick, 8 / 24.0), 0.02) << "time went on meanwhile";
  draw(*streamer_->drawable(id).layers[0].frame);
}

TEST_F(StreamGpu, AReloadWhilePlaying) {
  const PackFile file(sequencePack(8, someBricks));
  create();
  const AssetId asset = open(file);
  const InstanceId id = valueOf(streamer_->addInstance({.asset = asset}), "add");
  for (int i = 0; i < 60; ++i) update();
  const format::Pack* before = streamer_->pack(asset);
  // Renamed over the old one, as the compiler does: what is open stays what it was.
  const PackFile fresh(sequencePack(16, [](std::uint32_t) { return 30u; }));
  std::filesystem::rename(fresh.path(), file.path());
  ASSERT_TRUE(streamer_->reload(asset, {.path = file.path()}));
  int updates = 0;
  for (; updates < 3000 && streamer_->pack(asset) == before; ++updates) {
    update();
    EXPECT_GT(streamer_->drawable(id).count, 0u);
  }
  EXPECT_EQ(streamer_->pack(asset)->frames().size(), 16u);
  for (int i = 0; i < 60; ++i) update();
  EXPECT_FALSE(streamer_->takeError());
  streamer_->close(asset);
  for (int i = 0; i < 10; ++i) update();
  EXPECT_EQ(streamer_->stats().framesResident, 0u);
}

// A host's own files: reads that end on other threads, and packs that open while the game goes on.
class ThreadedSource final : public runtime::AsyncSource {
 public:
  explicit ThreadedSource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  ~ThreadedSource() override {
    for (std::thread& thread : threads_) thread.join();
  }
  std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> into, runtime::ReadDone done) override {
    const std::lock_guard lock(mutex_);
    threads_.emplace_back([this, offset, into, done] {
      std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), into.size(), into.begin());
      done.call(done.context, true);
    });
  }

 private:
  std::vector<std::byte> bytes_;
  std::mutex mutex_;
  std::vector<std::thread> threads_;
};

TEST_F(StreamGpu, PacksOfAHostsOwnFiles) {
  const auto source = std::make_shared<ThreadedSource>(sequencePack(8, someBricks));
  create({.readThreads = 0});
  const AssetId asset = valueOf(streamer_->openLater({.source = source}), "open");
  EXPECT_EQ(streamer_->state(asset), runtime::Streamer::AssetState::opening);
  for (int i = 0; i < 3000 && streamer_->state(asset) == runtime::Streamer::AssetState::opening; ++i) update();
  ASSERT_EQ(streamer_->state(asset), runtime::Streamer::AssetState::ready);
  const InstanceId id = valueOf(streamer_->addInstance({.asset = asset, .playback = {.speed = 0}}), "add");
  ASSERT_TRUE(settle(id));
  draw(*streamer_->drawable(id).layers[0].frame);
  const AssetId second = valueOf(streamer_->open({.source = source}), "open at once");
  EXPECT_EQ(streamer_->state(second), runtime::Streamer::AssetState::ready);
  EXPECT_FALSE(streamer_->open({.path = "/nowhere.blw"})) << "there are no threads that read files";
  gpu().waitIdle();
  streamer_.reset();
}

// Many instances at different times draw what they share from the same frames.
TEST_F(StreamGpu, ManyInstancesShareFrames) {
  const PackFile file(sequencePack(12, someBricks));
  create();
  const AssetId asset = open(file);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 200; ++i) {
    ids.push_back(valueOf(streamer_->addInstance({.asset = asset, .time = i * 0.013}), "add"));
  }
  for (int i = 0; i < 300 && streamer_->stats().framesResident < 12; ++i) update();
  for (int i = 0; i < 60; ++i) update();
  for (const InstanceId id : ids) {
    EXPECT_GT(streamer_->drawable(id).count, 0u);
    EXPECT_FALSE(streamer_->drawable(id).held);
  }
  EXPECT_LE(streamer_->stats().framesResident, 24u) << "each frame once, and its means once";
}

}  // namespace
}  // namespace billow::tests
