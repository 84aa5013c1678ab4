// Streaming without a disk or a device: packs of many frames, and a transport whose loads take as many updates as a
// test says.
#ifndef BILLOW_TESTS_FAKE_STREAM_H
#define BILLOW_TESTS_FAKE_STREAM_H

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sample_pack.h"
#include "stream/streamer.h"

namespace billow::tests {

// One volume a name, each with `frames` frames of one grid, whose frame i has bricks(i) distinct bricks.
inline std::vector<std::byte> sequencePack(std::uint32_t frames,
                                           const std::function<std::uint32_t(std::uint32_t)>& bricks,
                                           float framesPerSecond = 24) {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density"}, frames);
    tables.volumes[0].framesPerSecond = framesPerSecond;
    for (std::uint32_t i = 0; i < frames; ++i) {
      tables.frames[i].time = i / static_cast<double>(framesPerSecond);
      GridFrameBuilder builder(writer, 0);
      for (std::uint32_t b = 0; b < bricks(i); ++b) {
        builder.brick({b % 16, b / 16 % 16, b / 256}, format::uniformEncoding(8), randomBytes(512, i * 4096 + b), 0.01f,
                      0.1f, format::kMaskAll);
      }
      tables.gridFrames.push_back(builder.finish(tables));
    }
    return tables;
  });
}

// A file that goes when it does.
class PackFile {
 public:
  explicit PackFile(const std::vector<std::byte>& bytes) {
    std::string folder = (std::filesystem::temp_directory_path() / "billow_stream_XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) return;
    folder_ = folder;
    write(bytes);
  }
  PackFile(const PackFile&) = delete;
  PackFile& operator=(const PackFile&) = delete;
  ~PackFile() { std::filesystem::remove_all(folder_); }

  void write(const std::vector<std::byte>& bytes) const {
    std::ofstream file(path(), std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  std::string path() const { return folder_ + "/pack.blw"; }

 private:
  std::string folder_;
};

// What a frame of the fake transport is.
struct FakeFrame {
  const runtime::OpenPack* pack = nullptr;
  std::uint32_t volume = 0, frame = 0;
  bool means = false;
  runtime::GridChoice grids = {};
};

// Loads take `latency` updates, `parallel` of them at a time. Counts as the real one does, and fails the test where the
// plan makes it break its budget. All on one thread.
class FakeTransport final : public runtime::Transport {
 public:
  std::uint32_t latency = 1;
  bool meansAreQuick = false;  // they take one
  std::uint32_t parallel = 4;
  // What is to become of a load, asked when it would arrive: an error, or nothing.
  std::function<std::optional<runtime::Error>(const runtime::LoadOrder&)> fault;
  std::vector<std::pair<std::uint32_t, bool>> log;  // frames and whether of means, in the order of submission
  std::uint32_t cancelled = 0;
  std::uint64_t mostPlanned = 0;

  FakeTransport(const runtime::StreamConfig& config, const runtime::Wake& wake)
      : config_(config), wake_(wake), budget_(config.gpuBudget) {}
  ~FakeTransport() override { EXPECT_EQ(alive_, retired_.size()) << "frames outlive the transport"; }

  Cost cost(const runtime::LoadOrder& order) const override {
    const auto& pack = order.pack->pack;
    const format::GridFrame& grid = pack.gridFrame(pack.volumes()[order.volume], order.frame, 0);
    const std::uint64_t bytes = format::gpuBytes(grid).total();
    return {.gpu = order.means ? bytes / 64 + 256 : bytes + 256, .cpu = 1 << 16};
  }

  bool submit(const runtime::LoadOrder& order) override {
    EXPECT_FALSE(loads_.contains(order.ticket));
    log.emplace_back(order.frame, order.means);
    loads_[order.ticket] = {order, cost(order).gpu, 0};
    return true;
  }
  void cancel(std::uint64_t ticket) override {
    ++cancelled;
    loads_.erase(ticket);
  }
  std::optional<runtime::LoadStage> stage(std::uint64_t ticket) const override {
    const auto found = loads_.find(ticket);
    if (found == loads_.end()) return std::nullopt;
    return found->second.done >= latencyOf(found->second) ? runtime::LoadStage::waitingForMemory
                                                          : runtime::LoadStage::reading;
  }
  void take(std::vector<runtime::Arrival>& arrivals) override {
    for (auto& arrival : arrivals_) arrivals.push_back(std::move(arrival));
    arrivals_.clear();
  }
  std::uint64_t wantedGpuBytes() const override { return wanted_; }
  bool mustLeave(const runtime::ResidentFrame&) const override { return false; }
  bool admit(const runtime::ResidentFrame&) override { return true; }
  void stop() override {}

  void update() override {
    ++updates_;
    while (!retired_.empty() && retired_.front().first + config_.framesInFlight <= updates_) {
      used_ -= retired_.front().second->stats().allocatedBytes;
      known_.erase(retired_.front().second.get());
      retired_.pop_front();
    }
    wanted_ = 0;
    std::uint32_t working = 0;
    for (auto at = loads_.begin(); at != loads_.end();) {
      Load& load = at->second;
      if (working++ >= parallel && load.done < latencyOf(load)) break;
      if (++load.done < latencyOf(load) || !arrive(load)) {
        ++at;
        continue;
      }
      at = loads_.erase(at);
    }
    if (!arrivals_.empty()) wake_.call(wake_.user);
  }

  void retire(std::unique_ptr<runtime::ResidentFrame>&& frame) override {
    ASSERT_NE(frame, nullptr);
    retired_.emplace_back(updates_, std::move(frame));
  }
  runtime::UploadWait wait() const override { return {}; }
  void setBudget(std::uint64_t gpuBytes, std::uint64_t) override { budget_ = gpuBytes; }
  bool reserveCpu(std::uint64_t bytes) override {
    reserved_ += bytes;
    return reserved_ <= config_.cpuBudget;
  }
  void releaseCpu(std::uint64_t bytes) override { reserved_ -= bytes; }
  runtime::TransportStats stats() const override { return {.gpuAllocated = used_, .gpuUsed = used_}; }
  void run(void (*job)(void*), void* context) override { job(context); }
  void read(void (*job)(void*), void* context) override { job(context); }

  const FakeFrame& known(const runtime::Frame* frame) const { return known_.at(frame); }
  bool isRetired(const runtime::Frame* frame) const {
    return std::any_of(retired_.begin(), retired_.end(), [&](const auto& old) { return old.second.get() == frame; });
  }
  std::uint64_t used() const { return used_; }
  std::uint64_t reserved() const { return reserved_; }
  std::size_t inFlight() const { return loads_.size(); }

 private:
  struct Load {
    runtime::LoadOrder order;
    std::uint64_t bytes = 0;
    std::uint32_t done = 0;
  };

  class Counted final : public runtime::FrameMemory {
   public:
    explicit Counted(std::size_t& count) : count_(count) { ++count_; }
    ~Counted() override { --count_; }

   private:
    std::size_t& count_;
  };

  std::uint32_t latencyOf(const Load& load) const { return meansAreQuick && load.order.means ? 1 : latency; }

  bool arrive(const Load& load) {
    if (fault) {
      if (auto error = fault(load.order)) {
        arrivals_.push_back({load.order.ticket, tl::unexpected(std::move(*error)), std::nullopt});
        return true;
      }
    }
    if (used_ + load.bytes > budget_) {
      wanted_ += load.bytes;
      return false;
    }
    auto frame = std::make_unique<runtime::ResidentFrame>();
    frame->stats_.allocatedBytes = load.bytes;
    used_ += load.bytes;
    frame->memory_ = std::make_unique<Counted>(alive_);
    known_[frame.get()] = {load.order.pack.get(), load.order.volume, load.order.frame, load.order.means,
                           load.order.grids};
    arrivals_.push_back({load.order.ticket, std::move(frame), std::nullopt});
    return true;
  }

  runtime::StreamConfig config_;
  runtime::Wake wake_;
  std::uint64_t budget_;
  std::uint64_t used_ = 0, reserved_ = 0, wanted_ = 0;
  std::uint64_t updates_ = 0;
  std::size_t alive_ = 0;
  std::map<std::uint64_t, Load> loads_;
  std::vector<runtime::Arrival> arrivals_;
  std::deque<std::pair<std::uint64_t, std::unique_ptr<runtime::ResidentFrame>>> retired_;
  std::map<const runtime::Frame*, FakeFrame> known_;
};

// A streamer upon it, whose planning happens inside of update().
class FakeStream {
 public:
  explicit FakeStream(const runtime::StreamConfig& config = {}) : config_(config) {
    auto made = runtime::makeStreamer(
        config, nullptr,
        [this](runtime::Device*, const runtime::StreamConfig& wanted,
               const runtime::Wake& wake) -> runtime::Result<std::unique_ptr<runtime::Transport>> {
          auto fake = std::make_unique<FakeTransport>(wanted, wake);
          transport_ = fake.get();
          return fake;
        },
        runtime::PlanOn::request);
    EXPECT_TRUE(made) << made.error().message;
    streamer_ = std::move(*made);
  }

  runtime::Streamer& operator*() { return *streamer_; }
  runtime::Streamer* operator->() { return streamer_.get(); }
  FakeTransport& transport() { return *transport_; }

  void update(double seconds = 1.0 / 60) { streamer_->update({.seconds = seconds}); }
  void update(std::uint32_t times, double seconds) {
    for (std::uint32_t i = 0; i < times; ++i) update(seconds);
  }

 private:
  runtime::StreamConfig config_;
  FakeTransport* transport_ = nullptr;
  std::unique_ptr<runtime::Streamer> streamer_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_FAKE_STREAM_H
