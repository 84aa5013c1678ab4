// What a streamer has done since a document is shown, from what StreamStats says of each update, and how it is told.
#ifndef BILLOW_VIEWER_TRAFFIC_H
#define BILLOW_VIEWER_TRAFFIC_H

#include <cstdint>
#include <string>
#include <vector>

#include "billow/runtime/stream.h"

namespace billow::viewer {

class Traffic {
 public:
  // After each update(), with the seconds since the one before, whether they were played or not.
  void add(const runtime::StreamStats& stats, double seconds);

  const runtime::StreamStats& now() const { return now_; }
  // Frames that began when nothing of their moment could be drawn.
  std::uint64_t late() const { return late_; }
  std::uint64_t loaded() const { return loaded_; }
  std::uint64_t evicted() const { return evicted_; }

  // Bytes a second, in steps that can be read.
  struct Rates {
    double read = 0, decompressed = 0, uploaded = 0;
  };
  const Rates& rates() const { return rates_; }

 private:
  runtime::StreamStats now_;
  Rates rates_, sums_;
  double seconds_ = 0;  // that sums_ are of
  std::uint64_t late_ = 0, loaded_ = 0, evicted_ = 0;
};

std::string megabytes(double bytes);

// A line each: what is resident, what comes and goes, what is not as it should be, and what that waits for.
std::vector<std::string> linesOf(const Traffic& traffic);

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_TRAFFIC_H
