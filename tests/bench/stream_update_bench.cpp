// What Streamer::update() costs on the frame thread: billow_stream_update_bench [UPDATES] prints a table of its median
// and slowest times at 1 to 1000 instances of 1 and of 20 assets, everything resident, planning on its own thread.
// Needs no device: loads are done at once.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bench_failure.h"
#include "sample_pack.h"
#include "stream/streamer.h"

namespace {

using namespace billow;
using bench::valueOf;

// Frames that are there as soon as they are ordered.
class InstantTransport final : public runtime::Transport {
 public:
  InstantTransport(const runtime::StreamConfig& config, const runtime::Wake& wake) : config_(config), wake_(wake) {}

  Cost cost(const runtime::LoadOrder&) const override { return {.gpu = 1000, .cpu = 1000}; }
  bool submit(const runtime::LoadOrder& order) override {
    auto frame = std::make_unique<runtime::ResidentFrame>();
    frame->stats_.allocatedBytes = 1000;
    arrivals_.push_back({order.ticket, std::move(frame), std::nullopt});
    return true;
  }
  void cancel(std::uint64_t) override {}
  std::optional<runtime::LoadStage> stage(std::uint64_t) const override { return std::nullopt; }
  void take(std::vector<runtime::Arrival>& arrivals) override {
    for (auto& arrival : arrivals_) arrivals.push_back(std::move(arrival));
    arrivals_.clear();
  }
  std::uint64_t wantedGpuBytes() const override { return 0; }
  bool mustLeave(const runtime::ResidentFrame&) const override { return false; }
  bool admit(const runtime::ResidentFrame&) override { return true; }
  void stop() override {}
  void update() override {
    ++updates_;
    while (!retired_.empty() && retired_.front().first + config_.framesInFlight <= updates_) retired_.pop_front();
  }
  void retire(std::unique_ptr<runtime::ResidentFrame>&& frame) override {
    retired_.emplace_back(updates_, std::move(frame));
  }
  runtime::UploadWait wait() const override { return {}; }
  void setBudget(std::uint64_t, std::uint64_t) override {}
  bool reserveCpu(std::uint64_t) override { return true; }
  void releaseCpu(std::uint64_t) override {}
  runtime::TransportStats stats() const override { return {}; }
  void run(void (*job)(void*), void* context) override { job(context); }
  void read(void (*job)(void*), void* context) override { job(context); }

 private:
  runtime::StreamConfig config_;
  runtime::Wake wake_;
  std::uint64_t updates_ = 0;
  std::vector<runtime::Arrival> arrivals_;  // of the planner
  std::deque<std::pair<std::uint64_t, std::unique_ptr<runtime::ResidentFrame>>> retired_;
};

std::vector<std::byte> packOf(std::uint32_t frames) {
  return tests::writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = tests::sampleTables("v", {"density"}, frames);
    for (std::uint32_t i = 0; i < frames; ++i) {
      tests::GridFrameBuilder builder(writer, 0);
      builder.brick({1, 1, 1}, format::kEncodingConstant, {}, 1 + static_cast<float>(i), 0, format::kMaskAll);
      tables.gridFrames.push_back(builder.finish(tables));
    }
    return tables;
  });
}

double millionths(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

// As in a game: the thread is busy with other things, which have the caches, and planning has long ended when the next
// update() comes.
void restOfTheFrame() {
  static std::vector<std::uint64_t> others(1u << 20);  // 8 MiB
  const auto begin = std::chrono::steady_clock::now();
  while (millionths(std::chrono::steady_clock::now() - begin) < 2000) {
    for (std::uint64_t& other : others) other = other * 3 + 1;
  }
}

void measure(const std::string& pack, std::uint32_t assets, std::uint32_t instances, std::uint32_t updates) {
  auto streamer = valueOf(
      runtime::makeStreamer({.gpuBudget = std::uint64_t{1} << 30}, nullptr,
                            [](runtime::Device*, const runtime::StreamConfig& config,
                               const runtime::Wake& wake) -> runtime::Result<std::unique_ptr<runtime::Transport>> {
                              return std::make_unique<InstantTransport>(config, wake);
                            }));
  std::vector<runtime::AssetId> ids;
  for (std::uint32_t i = 0; i < assets; ++i) ids.push_back(valueOf(streamer->open({.path = pack})));
  for (std::uint32_t i = 0; i < instances; ++i) {
    const runtime::InstanceInfo info{.asset = ids[i % assets],
                                     .time = i * 0.37,
                                     .playback = {.speed = i % 5 == 0 ? -1.0 : 1.0,
                                                  .loop = i % 3 == 0 ? runtime::Loop::pingPong : runtime::Loop::loop}};
    valueOf(streamer->addInstance(info));
  }
  const runtime::UpdateInfo step{
      .seconds = 1.0 / 60, .view = runtime::lookAt({0, -30, 10}, {0, 0, 0}, {0, 0, 1}, 60), .pixelsHigh = 1080};
  std::vector<double> times;
  for (std::uint32_t i = 0; i < updates + 100; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    streamer->update(step);
    if (i >= 100) times.push_back(millionths(std::chrono::steady_clock::now() - begin));
    restOfTheFrame();
  }
  std::sort(times.begin(), times.end());
  const runtime::StreamStats stats = streamer->stats();
  fmt::print("{:>10} {:>7} {:>10.1f} {:>10.1f} {:>10.1f} {:>9}\n", instances, assets, times[times.size() / 2],
             times[times.size() * 99 / 100], times.back(), stats.instancesHeld + stats.instancesEmpty);
}

}  // namespace

int main(int count, char** arguments) {
  const std::uint32_t updates = count > 1 ? static_cast<std::uint32_t>(std::atoi(arguments[1])) : 1000;
  std::string folder = (std::filesystem::temp_directory_path() / "billow_update_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr || updates == 0) return 1;
  const std::string path = folder + "/pack.blw";
  {
    const auto bytes = packOf(100);
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  fmt::print("update(), microseconds\n{:>10} {:>7} {:>10} {:>10} {:>10} {:>9}\n", "instances", "assets", "median",
             "99 %", "slowest", "not drawn");
  for (const std::uint32_t assets : {1u, 20u}) {
    for (const std::uint32_t instances : {1u, 10u, 100u, 1000u}) measure(path, assets, instances, updates);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
