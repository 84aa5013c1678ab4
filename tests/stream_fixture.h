// Packs of several frames, sources that misbehave, and a Transport to load with.
#ifndef BILLOW_TESTS_STREAM_FIXTURE_H
#define BILLOW_TESTS_STREAM_FIXTURE_H

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "api.h"
#include "gpu_fixture.h"
#include "stream/transport.h"
#include "stream_host.h"

namespace billow::tests {

// Two grids, many frames, bricks of every class, masks; no two frames share bricks. Frame `gap` is empty.
inline std::vector<std::byte> streamPack(std::uint32_t frames, std::uint32_t bricks, std::uint32_t gap = ~0u) {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density", "flames"}, frames);
    std::uint32_t seed = 1;
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      for (std::uint32_t g = 0; g < 2; ++g) {
        if (frame == gap) {
          tables.gridFrames.push_back(absentGridFrame());
          continue;
        }
        GridFrameBuilder grid(writer, 0);
        std::mt19937 random(frame * 2 + g);
        for (std::uint32_t i = 0; i < bricks; ++i) {
          const std::uint32_t encodings[] = {format::kEncodingBc7Y, format::kEncodingBc7Z, format::kEncodingUniform8,
                                             format::uniformEncoding(3), format::kEncodingCoarse};
          const std::uint32_t encoding = encodings[random() % 5];
          const auto bytes = randomBytes(*format::brickBytes(encoding), seed++);
          grid.brick({i % 12, i / 12 % 12, i / 144 + frame % 3}, encoding, bytes, 0.1f, 0.01f, format::kMaskAll);
        }
        tables.gridFrames.push_back(grid.finish(tables));
      }
    }
    return tables;
  });
}

inline std::shared_ptr<runtime::OpenPack> openStream(std::vector<std::byte> bytes,
                                                     std::shared_ptr<runtime::AsyncSource> source = nullptr) {
  auto open = std::make_shared<runtime::OpenPack>();
  open->pack = openPack(std::move(bytes));
  open->source = std::move(source);
  open->verified = std::vector<std::atomic<std::uint32_t>>((open->pack.pages().size() + 31) / 32);
  return open;
}

// A host's files: each read is answered by `answer`, which may keep it for later.
class TestSource final : public runtime::AsyncSource {
 public:
  struct Read {
    std::uint64_t offset;
    std::span<std::byte> into;
    runtime::ReadDone done;
  };
  explicit TestSource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> into, runtime::ReadDone done) override {
    ++reads;
    if (offset > bytes_.size() || into.size() > bytes_.size() - offset) ++outside;
    answer({offset, into, done});
  }
  void succeed(const Read& read) const {
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(read.offset), read.into.size(), read.into.begin());
    read.done.call(read.done.context, true);
  }

  std::function<void(const Read&)> answer = [this](const Read& read) { succeed(read); };
  std::atomic<int> reads = 0, outside = 0;

 private:
  const std::vector<std::byte> bytes_;
};

// Answers reads on its own thread, late and in no order.
class SlowDisk {
 public:
  SlowDisk(TestSource& source, std::uint32_t seed) : source_(source), random_(seed) {
    source.answer = [this](const TestSource::Read& read) {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(read);
    };
    thread_ = std::thread([this] { work(); });
  }
  ~SlowDisk() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    thread_.join();
  }
  std::function<bool(std::uint64_t offset)> fails = [](std::uint64_t) { return false; };

 private:
  void work() {
    for (;;) {
      std::this_thread::sleep_for(std::chrono::microseconds(300));
      TestSource::Read read{};
      {
        const std::lock_guard lock(mutex_);
        if (waiting_.empty() && ended_) return;
        if (waiting_.empty()) continue;
        std::swap(waiting_[random_() % waiting_.size()], waiting_.back());
        read = waiting_.back();
        waiting_.pop_back();
      }
      if (fails(read.offset)) {
        read.done.call(read.done.context, false);
      } else {
        source_.succeed(read);
      }
    }
  }

  TestSource& source_;
  std::mutex mutex_;
  std::vector<TestSource::Read> waiting_;
  bool ended_ = false;
  std::mt19937 random_;
  std::thread thread_;
};

class StreamTest : public GpuTest {
 protected:
  using Frames = std::map<std::uint64_t, std::unique_ptr<runtime::ResidentFrame>>;

  static runtime::StreamConfig smallConfig() {
    runtime::StreamConfig config;
    config.gpuBudget = 16u << 20;
    config.cpuBudget = 24u << 20;
    config.stagingBytes = 256u << 10;
    return config;
  }

  static std::unique_ptr<runtime::Transport> makeTransport(runtime::Renderer& renderer,
                                                           const runtime::StreamConfig& config) {
    return valueOf(runtime::Transport::create(runtime::deviceOf(renderer), config, {}), "the transport");
  }

  static runtime::LoadOrder orderOf(const std::shared_ptr<runtime::OpenPack>& pack, std::uint32_t frame,
                                    std::uint64_t ticket) {
    return {.ticket = ticket,
            .pack = pack,
            .volume = 0,
            .frame = frame,
            .grids = runtime::chooseGrids(pack->pack, pack->pack.volumes()[0])};
  }

  // Calls step() until it is true, or fails after half a minute.
  template <class Step>
  static bool waitFor(const Step& step) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (!step()) {
      if (std::chrono::steady_clock::now() > end) {
        ADD_FAILURE() << "it takes too long";
        return false;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return true;
  }

  // Loads all of these frames, ticket = frame; errors fail the test.
  static Frames loadAll(runtime::Transport& transport, const std::shared_ptr<runtime::OpenPack>& pack,
                        const std::vector<std::uint32_t>& numbers) {
    Frames frames;
    std::size_t next = 0;
    std::vector<runtime::Arrival> arrivals;
    waitFor([&] {
      while (next < numbers.size() && transport.submit(orderOf(pack, numbers[next], numbers[next]))) ++next;
      transport.update();
      transport.take(arrivals);
      for (runtime::Arrival& arrival : arrivals) {
        EXPECT_TRUE(arrival.frame) << arrival.frame.error().message;
        frames[arrival.ticket] = arrival.frame ? std::move(*arrival.frame) : nullptr;
      }
      arrivals.clear();
      return frames.size() == numbers.size();
    });
    return frames;
  }

  // Loads one frame and gives how it ended.
  static runtime::Arrival loadOne(runtime::Transport& transport, const runtime::LoadOrder& order) {
    std::vector<runtime::Arrival> arrivals;
    EXPECT_TRUE(transport.submit(order));
    waitFor([&] {
      transport.update();
      transport.take(arrivals);
      return !arrivals.empty();
    });
    EXPECT_EQ(arrivals.size(), 1u);
    return arrivals.empty() ? runtime::Arrival{.ticket = 0, .frame = nullptr} : std::move(arrivals.front());
  }

  // Positions that meet every brick of a streamPack().
  static std::vector<float> somePositions() {
    std::mt19937 random(9);
    std::vector<float> positions;
    for (int i = 0; i < 3 * 4000; ++i) positions.push_back(static_cast<float>(random() % (i % 3 == 2 ? 48 : 100)));
    return positions;
  }

  // The streamed frame reads as one that Renderer::upload() made of the same.
  static void expectSame(runtime::Renderer& renderer, const runtime::OpenPack& pack, std::uint32_t number,
                         const runtime::ResidentFrame& streamed) {
    const auto uploaded = upload(renderer, pack.pack, number);
    gpu().waitIdle();  // before it is destroyed
    ASSERT_EQ(streamed.empty(), uploaded->empty()) << "frame " << number;
    EXPECT_EQ(streamed.stats().payload(), uploaded->stats().payload());
    if (streamed.empty()) return;
    const std::vector<float> positions = somePositions();
    for (std::uint32_t slot : {0u, 2u}) {
      const auto got = valueOf(gpu().lookup(renderer, streamed, slot, runtime::Filter::nearest, positions), "lookup");
      const auto wanted =
          valueOf(gpu().lookup(renderer, *uploaded, slot, runtime::Filter::nearest, positions), "lookup");
      EXPECT_EQ(got, wanted) << "frame " << number << " slot " << slot;
      EXPECT_NE(std::count_if(got.begin(), got.end(), [](float v) { return v != 0; }), 0);
    }
    gpu().waitIdle();
  }
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_STREAM_FIXTURE_H
