// The transport alone, over and over a pack's frames: bytes a second from the file to the device, and what update() and
// take() cost on the frame thread.
//   billow_transport_bench PACK.blw [threads] [seconds]
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "api.h"
#include "bench_failure.h"
#include "billow/headless/headless.h"
#include "stream/transport.h"

namespace {

using namespace billow;
using Clock = std::chrono::steady_clock;

double microseconds(Clock::time_point from) {
  return std::chrono::duration<double, std::micro>(Clock::now() - from).count();
}

double quantile(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// Of all threads, the driver's too.
double processSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

struct Run {
  runtime::Transport& transport;
  std::shared_ptr<runtime::OpenPack> pack;
  std::vector<double> updates, busyUpdates, takes, submits;
  std::uint64_t gpuBytes = 0, frames = 0;

  void loadFor(double seconds) {
    const std::uint32_t count = pack->pack.volumes()[0].frameCount;
    const auto grids = runtime::chooseGrids(pack->pack, pack->pack.volumes()[0]);
    std::vector<runtime::Arrival> arrivals;
    std::uint64_t ticket = 0, inFlight = 0;
    const auto begin = Clock::now();
    while (microseconds(begin) < seconds * 1e6) {
      auto at = Clock::now();
      while (inFlight < 8) {
        const auto frame = static_cast<std::uint32_t>(ticket % count);
        at = Clock::now();
        const bool taken = transport.submit(
            {.ticket = ticket, .pack = pack, .volume = 0, .frame = frame, .grids = grids, .means = false});
        submits.push_back(microseconds(at));
        if (!taken) break;
        ++ticket;
        ++inFlight;
      }
      const std::uint64_t uploaded = transport.wait().value;
      at = Clock::now();
      transport.update();
      const double took = microseconds(at);
      updates.push_back(took);
      at = Clock::now();
      transport.take(arrivals);
      takes.push_back(microseconds(at));
      if (transport.wait().value != uploaded) busyUpdates.push_back(took);
      for (runtime::Arrival& arrival : arrivals) {
        --inFlight;
        auto frame = bench::valueOf(std::move(arrival.frame));
        gpuBytes += frame->stats().payload();
        ++frames;
        transport.retire(std::move(frame));
      }
      arrivals.clear();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    while (inFlight > 0) {
      transport.update();
      transport.take(arrivals);
      inFlight -= arrivals.size();
      arrivals.clear();
    }
  }
};

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    fmt::print(stderr, "billow_transport_bench PACK.blw [threads] [seconds]\n");
    return 1;
  }
  const auto gpu = bench::valueOf(headless::Headless::create({}));
  const auto renderer = bench::valueOf(runtime::Renderer::create(gpu->host(), {}));
  auto pack = std::make_shared<runtime::OpenPack>();
  pack->pack = bench::valueOf(format::Pack::openFile(arguments[1]));
  pack->verified = std::vector<std::atomic<std::uint32_t>>((pack->pack.pages().size() + 31) / 32);
  runtime::StreamConfig config;
  config.threads = count > 2 ? static_cast<std::uint32_t>(std::atoi(arguments[2])) : 1;
  const auto transport = bench::valueOf(runtime::Transport::create(runtime::deviceOf(*renderer), config, {}));
  Run run{.transport = *transport, .pack = pack, .updates = {}, .busyUpdates = {}, .takes = {}, .submits = {}};
  const double before = processSeconds();
  const auto begin = Clock::now();
  run.loadFor(count > 3 ? std::atof(arguments[3]) : 5);
  const double seconds = microseconds(begin) / 1e6;
  const double cpu = processSeconds() - before;
  const auto stats = transport->stats();
  fmt::print(
      "{}: {} threads, {} frames in {:.2f} s: {:.1f} MB/s of GPU bytes, {:.1f} read, {:.1f} decompressed; "
      "{:.1f} MB of GPU bytes a second of a core\n",
      gpu->deviceName(), config.threads, run.frames, seconds, static_cast<double>(run.gpuBytes) / seconds / 1e6,
      static_cast<double>(stats.bytesRead) / seconds / 1e6,
      static_cast<double>(stats.bytesDecompressed) / seconds / 1e6, static_cast<double>(run.gpuBytes) / cpu / 1e6);
  fmt::print(
      "update(): median {:.1f} us, p99 {:.1f} us, with an arrival {:.1f} us; take(): {:.1f}, {:.1f}; submit(): "
      "{:.1f}, {:.1f}\n",
      quantile(run.updates, 0.5), quantile(run.updates, 0.99), quantile(run.busyUpdates, 0.5), quantile(run.takes, 0.5),
      quantile(run.takes, 0.99), quantile(run.submits, 0.5), quantile(run.submits, 0.99));
  fmt::print("GPU: {} allocated at most, {} CPU at most\n", stats.gpuPeak, stats.cpuPeak);
  gpu->waitIdle();
  return 0;
}
