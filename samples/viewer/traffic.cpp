#include "traffic.h"

#include <fmt/format.h>

#include <array>

namespace billow::viewer {
namespace {

constexpr double kSpan = 0.5;  // seconds that a rate is the mean of
constexpr std::array<const char*, runtime::kMissingCount> kWaits = {"queued",     "reading",    "decoding", "uploading",
                                                                    "GPU budget", "CPU budget", "failed"};

}  // namespace

void Traffic::add(const runtime::StreamStats& stats, double seconds) {
  now_ = stats;
  late_ += stats.framesLate;
  loaded_ += stats.framesLoaded;
  evicted_ += stats.framesEvicted;
  sums_.read += static_cast<double>(stats.bytesRead);
  sums_.decompressed += static_cast<double>(stats.bytesDecompressed);
  sums_.uploaded += static_cast<double>(stats.bytesUploaded);
  seconds_ += seconds;
  if (seconds_ < kSpan) return;
  rates_ = {sums_.read / seconds_, sums_.decompressed / seconds_, sums_.uploaded / seconds_};
  sums_ = {};
  seconds_ = 0;
}

std::string megabytes(double bytes) {
  return fmt::format("{:.1f} MiB", bytes / (1 << 20));
}

std::vector<std::string> linesOf(const Traffic& traffic) {
  const runtime::StreamStats& now = traffic.now();
  const Traffic::Rates& rates = traffic.rates();
  const double mebi = 1 << 20;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{} frames, {}", now.framesResident, megabytes(static_cast<double>(now.gpuBytes))));
  lines.push_back(fmt::format("loaded {}, evicted {}, late {}", traffic.loaded(), traffic.evicted(), traffic.late()));
  lines.push_back(fmt::format("read {:.1f}, unpacked {:.1f}, up {:.1f} MiB/s", rates.read / mebi,
                              rates.decompressed / mebi, rates.uploaded / mebi));
  lines.push_back(fmt::format("of {}: {} held, {} coarse, {} empty", now.instances, now.instancesHeld,
                              now.instancesCoarse, now.instancesEmpty));
  std::string missing;
  for (std::size_t i = 0; i < kWaits.size(); ++i) {
    if (now.missingBricks[i] == 0) continue;
    missing += fmt::format("{}{} {}", missing.empty() ? "" : ", ", now.missingBricks[i], kWaits[i]);
  }
  lines.push_back(missing.empty() ? "nothing is missing" : "missing bricks: " + missing);
  return lines;
}

}  // namespace billow::viewer
