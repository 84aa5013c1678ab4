// What a frame costs on a real GPU: billow_march_bench PACK [--frames N] [--frame I] [--size WxH] [--device D]
// prints, for each index, filter and kind of shadow, the median time of a dispatch and the GPU bytes. It needs nothing
// but libvulkan and a driver at run time, so that it can be carried to the machine that has the GPU.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench_failure.h"
#include "billow/headless/headless.h"
#include "billow/runtime/look.h"

namespace {

using namespace billow;
using bench::fail;
using bench::valueOf;
using runtime::Filter;
using runtime::Index;

struct Options {
  std::string pack;
  std::uint32_t draws = 25;
  std::uint32_t frame = format::kNone;  // index; default: the middle one
  std::uint32_t width = 1920, height = 1080;
  headless::DeviceOptions device;
};

struct Variant {
  Index index;
  Filter filter;
  Filter shadows;
};

Options parse(int argc, char** argv) {
  Options options;
  const auto number = [&](int i) {
    if (i >= argc) fail("an option lacks its value");
    return static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10));
  };
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--frames")
      options.draws = std::max(1u, number(++i));
    else if (argument == "--frame")
      options.frame = number(++i);
    else if (argument == "--device")
      options.device.device = number(++i);
    else if (argument == "--size") {
      if (++i >= argc || std::sscanf(argv[i], "%ux%u", &options.width, &options.height) != 2) fail("--size WxH");
    } else
      options.pack = argument;
  }
  if (options.pack.empty()) fail("usage: billow_march_bench PACK [--frames N] [--frame I] [--size WxH] [--device D]");
  return options;
}

// The whole sequence in view, from the front and a little above.
runtime::View wholeView(const runtime::WorldBox& box) {
  std::array<double, 3> center, eye;
  double radius = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    center[i] = (box.min[i] + box.max[i]) / 2;
    radius = std::max(radius, (box.max[i] - box.min[i]) / 2);
  }
  const double towards[3] = {0.5, -0.8, 0.3};
  for (std::size_t i = 0; i < 3; ++i) eye[i] = center[i] + towards[i] * radius * 4.2;
  return runtime::lookAt(eye, center, {0, 0, 1}, 30);
}

const char* nameOf(Index index) {
  return index == Index::flat ? "flat" : index == Index::tree ? "tree" : index == Index::dense ? "dense" : "automatic";
}
const char* nameOf(Filter filter) {
  return filter == Filter::nearest ? "nearest" : filter == Filter::trilinear ? "trilinear" : "none";
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void measure(headless::Headless& gpu, const format::Pack& pack, const Options& options, runtime::BlockUse blocks,
             const std::vector<Variant>& variants) {
  const format::VolumeRecord& volume = pack.volumes()[0];
  const runtime::GridChoice grids = runtime::chooseGrids(pack, volume);
  const auto renderer = valueOf(runtime::Renderer::create(
      gpu.host(), {.gpuBudget = std::uint64_t{8} << 30, .recordsInFlight = 3, .blocks = blocks}));
  const std::uint32_t frameIndex = options.frame != format::kNone ? options.frame : volume.frameCount / 2;
  runtime::DrawInfo draw;
  draw.look = valueOf(runtime::suggestLook(pack, volume, grids));
  draw.look.scatteringOrders = 1;
  draw.view = wholeView(runtime::worldBox(pack, volume, grids, 0, volume.frameCount - 1));
  draw.sun.direction = {-0.6f, -0.4f, 0.7f};
  draw.width = options.width;
  draw.height = options.height;
  for (const Variant& variant : variants) {
    const auto frame = valueOf(renderer->upload(pack, 0, frameIndex, {.grids = grids, .index = variant.index}));
    draw.frame = frame.get();
    draw.quality = {.filter = variant.filter, .shadows = variant.shadows};
    // The first draws warm the clocks and build the pipeline.
    valueOf(gpu.time(*renderer, draw, 5));
    const double milliseconds = median(valueOf(gpu.time(*renderer, draw, options.draws)));
    const runtime::FrameStats& stats = frame->stats();
    fmt::print("{:<6} {:<5} {:<10} {:<10} {:>9.3f} {:>10.1f} {:>10.1f} {:>10.1f} {:>10.1f} {:>10.1f}\n",
               blocks == runtime::BlockUse::decoded ? "u8" : "blocks", nameOf(variant.index), nameOf(variant.filter),
               nameOf(variant.shadows), milliseconds, static_cast<double>(stats.indexBytes) / 1e3,
               static_cast<double>(stats.recordBytes) / 1e3, static_cast<double>(stats.maskBytes) / 1e3,
               static_cast<double>(stats.brickBytes) / 1e3, static_cast<double>(stats.allocatedBytes) / 1e3);
    std::fflush(stdout);
    gpu.waitIdle();
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const format::Pack pack = valueOf(format::Pack::openFile(options.pack));
  if (pack.volumes().empty()) fail("the pack has no volume");
  const auto gpu = valueOf(headless::Headless::create(options.device));
  fmt::print("{} on {}, {}x{}, median of {} draws\n", options.pack, gpu->deviceName(), options.width, options.height,
             options.draws);
  fmt::print("{:<6} {:<5} {:<10} {:<10} {:>9} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "bricks", "index", "filter",
             "shadows", "ms", "index kB", "nodes kB", "masks kB", "bricks kB", "Vulkan kB");
  std::vector<Variant> variants;
  for (const Index index : {Index::flat, Index::tree, Index::dense}) {
    for (const Filter filter : {Filter::nearest, Filter::trilinear}) {
      for (const Filter shadows : {Filter::none, Filter::nearest}) variants.push_back({index, filter, shadows});
    }
    variants.push_back({index, Filter::trilinear, Filter::trilinear});
  }
  measure(*gpu, pack, options, runtime::BlockUse::native, variants);
  measure(*gpu, pack, options, runtime::BlockUse::decoded,
          {{Index::flat, Filter::nearest, Filter::nearest}, {Index::flat, Filter::trilinear, Filter::nearest}});
  return 0;
}
