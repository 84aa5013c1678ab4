// MB/s of GPU bytes that one core loads: pages from the cache of files to what the GPU reads, by stage, and
// the same of its pages stored raw. Beside it the
// checked views of the same grids, which is where a load began before it had a way of its own.
#include <fmt/format.h>

#include <time.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory_resource>
#include <string>
#include <vector>

#include "billow/format/grid_view.h"
#include "pack_image.h"
#include "stream/load_frame.h"

namespace {

using namespace billow;

constexpr double kLeastSeconds = 0.4;  // a measurement's

struct Frame {
  runtime::LoadRequest request;
  std::vector<std::uint32_t> pages;
};

struct Totals {
  double read = 0, verify = 0, unpack = 0, build = 0, copy = 0;  // seconds
  std::uint64_t gpuBytes = 0, storedBytes = 0, frames = 0;
  double all() const { return read + verify + unpack + build + copy; }
};

// Processor time of this thread: other work on the machine does not count.
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

double secondsSince(double& then) {
  const double before = then;
  then = now();
  return then - before;
}

std::vector<Frame> framesOf(const format::Pack& pack) {
  std::vector<Frame> frames;
  for (std::uint32_t v = 0; v < pack.volumes().size(); ++v) {
    for (std::uint32_t f = 0; f < pack.volumes()[v].frameCount; ++f) {
      runtime::LoadRequest request{.pack = &pack,
                                   .volume = v,
                                   .frame = f,
                                   .grids = runtime::chooseGrids(pack, pack.volumes()[v]),
                                   .bc7 = true,
                                   .maxImageExtent3D = 2048};
      frames.push_back({request, runtime::pagesOf(request)});
    }
  }
  return frames;
}

// Loads as the streamer does, and each stage by itself: verifying and unpacking are what is left away, or repeated.
class Loads {
 public:
  void add(const Frame& frame, Totals& totals) {
    const format::Pack& pack = *frame.request.pack;
    double then = now();
    read(frame, totals);
    totals.read += secondsSince(then);
    runtime::LoadRequest request = frame.request;
    request.verify = runtime::Verify::never;
    for (const auto& page : stored_) {
      content_.resize(pack.pages()[page.number].rawSize);
      if (!unpacker_.unpack(pack, page.number, page.bytes, false, content_)) std::abort();
    }
    const double unpack = secondsSince(then);
    const auto trusting = loader_.load(request, stored_);
    if (!trusting) std::abort();
    const double unverified = secondsSince(then);
    const auto loaded = loader_.load(frame.request, stored_);
    if (!loaded) std::abort();
    const double verified = secondsSince(then);
    staging_.resize(loaded->buffer.size() + loaded->atlas.size());
    then = now();
    std::memcpy(staging_.data(), loaded->buffer.data(), loaded->buffer.size());
    if (!loaded->atlas.empty()) {
      std::memcpy(staging_.data() + loaded->buffer.size(), loaded->atlas.data(), loaded->atlas.size());
    }
    totals.copy += secondsSince(then);
    totals.unpack += unpack;
    totals.build += unverified - unpack;
    totals.verify += verified - unverified;
    totals.gpuBytes += loaded->buffer.size() + loaded->atlas.size();
    ++totals.frames;
  }

 private:
  void read(const Frame& frame, Totals& totals) {
    const format::Pack& pack = *frame.request.pack;
    std::size_t bytes = 0;
    for (const std::uint32_t page : frame.pages) bytes += pack.pages()[page].storedSize;
    room_.resize(bytes);
    totals.storedBytes += bytes;
    stored_.clear();
    std::span<std::byte> rest(room_);
    for (const std::uint32_t page : frame.pages) {
      const auto into = rest.first(pack.pages()[page].storedSize);
      rest = rest.subspan(into.size());
      if (!pack.source().read(*format::placeOfPage(pack, page).offset, into)) std::abort();
      stored_.push_back({page, into});
    }
  }

  runtime::FrameLoader loader_{std::pmr::new_delete_resource()};
  format::PageUnpacker unpacker_{std::pmr::new_delete_resource()};
  std::vector<std::byte> room_, content_, staging_;
  std::vector<runtime::StoredPage> stored_;
};

double secondsOfViews(const std::vector<Frame>& frames) {
  std::uint64_t rounds = 0;
  double then = now();
  double seconds = 0;
  for (; seconds < kLeastSeconds; ++rounds) {
    for (const Frame& frame : frames) {
      const format::Pack& pack = *frame.request.pack;
      const runtime::GridChoice& grids = frame.request.grids;
      for (const std::uint32_t number : {grids.extinction, grids.temperature, grids.flames}) {
        if (number == format::kNone) continue;
        const auto& gridFrame = pack.gridFrame(pack.volumes()[frame.request.volume], frame.request.frame, number);
        if (!format::GridView::load(pack, gridFrame)) std::abort();
      }
    }
    seconds += secondsSince(then);
  }
  return seconds / static_cast<double>(rounds);
}

void measure(const std::string& name, const format::Pack& pack) {
  const std::vector<Frame> frames = framesOf(pack);
  Loads loads;
  Totals warm, totals;
  for (const Frame& frame : frames) loads.add(frame, warm);
  while (totals.all() < kLeastSeconds) {
    for (const Frame& frame : frames) loads.add(frame, totals);
  }
  const double megabytes = static_cast<double>(totals.gpuBytes) / 1e6, count = static_cast<double>(totals.frames);
  const double views = secondsOfViews(frames) / static_cast<double>(frames.size());
  const auto micro = [&](double seconds) { return seconds / count * 1e6; };
  fmt::print("{:24} {:7.1f} {:6.2f} {:6.0f} {:6.0f} {:6.0f} {:6.0f} {:6.0f} {:7.0f} {:7.0f} {:8.0f}\n", name,
             megabytes / count * 1000, static_cast<double>(totals.storedBytes) / static_cast<double>(totals.gpuBytes),
             micro(totals.read), micro(totals.unpack), micro(totals.build), micro(totals.verify), micro(totals.copy),
             megabytes / totals.all(), megabytes / (totals.all() - totals.verify), megabytes / count / views);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print(
      "GPU kB a frame, stored bytes a GPU byte; microseconds a frame to read, unpack, build, verify, copy; MB of\n"
      "GPU bytes a second with and without verifying; the same of checked views, with it\n");
  fmt::print("{:24} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>7} {:>8}\n", "pack", "kB", "stored", "read",
             "unpack", "build", "verify", "copy", "MB/s", "never", "views");
  for (int i = 1; i < argc; ++i) {
    const auto pack = format::Pack::openFile(argv[i]);
    if (!pack) {
      fmt::print(stderr, "{}: {}\n", argv[i], toString(pack.error()));
      return 1;
    }
    const std::string path = argv[i], name = path.substr(path.find_last_of('/') + 1);
    measure(name, *pack);
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const auto bytes = std::as_bytes(std::span(text));
    const auto raw = billow::tests::PackImage::of({bytes.begin(), bytes.end()}).assemble();
    measure(name + ", raw", *format::Pack::open(format::makeMemorySource(raw)));
  }
  return argc > 1 ? 0 : 1;
}
