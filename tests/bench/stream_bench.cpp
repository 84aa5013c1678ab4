// How well packs stream: billow_stream_bench PACK [--long PACK] [--also PACK]... [--seconds N] [--only abcdef]
// [--device D] [--no-draw] plays PACK at 60 updates a second within budgets of memory and prints, beside what was
// wanted: (a) frames that were late or coarser, by speed and direction and after seeks; (b) MB/s of a core, of PACK and
// each
// --also; (c) the time of update() by instances; (d) from open to the first frame, of the --long pack; (e) what
// simulated disks do to it; (f) many instances and assets under one budget. It needs nothing but libvulkan and a driver
// at run time.
#include <fmt/format.h>
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "../simulated_disk.h"
#include "stream_stage.h"

namespace {

using namespace billow;
using namespace billow::bench;
using runtime::InstanceInfo;
using runtime::Playback;
using runtime::StreamConfig;
using runtime::Streamer;

struct Options {
  std::string pack, longPack;
  std::vector<std::string> also;
  double seconds = 10;
  std::string only = "abcdef";
  bool draws = true;
  headless::DeviceOptions device;
  bool wants(char section) const { return only.find(section) != std::string::npos; }
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--no-draw") {
      options.draws = false;
    } else if (argument.starts_with("--")) {
      if (++i >= argc) fail("an option lacks its value");
      if (argument == "--long")
        options.longPack = argv[i];
      else if (argument == "--also")
        options.also.emplace_back(argv[i]);
      else if (argument == "--seconds")
        options.seconds = std::max(0.1, std::strtod(argv[i], nullptr));
      else if (argument == "--only")
        options.only = argv[i];
      else if (argument == "--device")
        options.device.device = static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10));
      else
        fail(fmt::format("what is {}?", argument));
    } else {
      options.pack = argument;
    }
  }
  if (options.pack.empty()) fail("which pack?");
  return options;
}

std::unique_ptr<Streamer> makeStreamer(Stage& stage, StreamConfig config) {
  config.framesInFlight = kFramesInFlight;
  return valueOf(Streamer::create(stage.renderer(), config));
}

// Errors are no part of what is measured here.
void noErrors(Streamer& streamer) {
  if (const auto error = streamer.takeError()) fail(error->message);
}

void titles() {
  fmt::print("  {:<26} {:>7} {:>6} {:>6} | {:>6} {:>6} {:>7} {:>7} {:>7} | {:>6} | {:>6} {:>6} | {:>5} {:>4}\n", "",
             "moments", "late%", "coar.%", "p50 fr", "p99 fr", "p50 ms", "p99 ms", "max ms", "full99", "p50 us",
             "p99 us", "skip", "fail");
}

// Waits are those of a new moment until it is drawn: frames are update()s, 0 the same one; full99 the 99 % of those
// until it is drawn in full detail.
void row(const std::string& name, const Judged& judged, double mostFrames = -1) {
  const double p99 = percentile(judged.waitFrames, 0.99);
  const bool fails = mostFrames >= 0 && (p99 >= mostFrames || (mostFrames <= 1 && judged.late != 0));
  fmt::print(
      "  {:<26} {:>7} {:>6.2f} {:>6.2f} | {:>6.1f} {:>6.1f} {:>7.2f} {:>7.2f} {:>7.2f} | {:>6.1f} | {:>6.1f} {:>6.1f} "
      "| "
      "{:>5} {:>4}\n",
      name, judged.moments, judged.share(judged.late), judged.share(judged.coarse), percentile(judged.waitFrames, 0.5),
      p99, percentile(judged.waitMs, 0.5), percentile(judged.waitMs, 0.99), percentile(judged.waitMs, 1),
      percentile(judged.fullFrames, 0.99), percentile(judged.updateUs, 0.5), percentile(judged.updateUs, 0.99),
      judged.skipped,
      mostFrames < 0 ? ""
      : fails        ? "FAIL"
                     : "ok");
  std::fflush(stdout);
}

struct Mode {
  const char* name;
  double speed;
  runtime::Loop loop = runtime::Loop::loop;
  bool seeks = false;
  double mostFrames = 1;  // what p99 of the waits must stay below
};
constexpr Mode kModes[] = {{"+1x", 1},
                           {"-1x", -1},
                           {"+4x", 4},
                           {"-4x", -4},
                           {"ping-pong", 1, runtime::Loop::pingPong},
                           {"ping-pong 4x", 4, runtime::Loop::pingPong},
                           {"a seek each half second", 1, runtime::Loop::loop, true, 2}};

// Waits after seeks alone, with each seek where the instance stands still: what playing adds is in the other rows.
Judged playSeeks(Player& player, const Scene& scene, double seconds) {
  std::mt19937 random(3);
  return player.play(seconds, true, [&](std::uint64_t update) {
    if (update % 30 == 0) player.seek(0, scene.seconds * static_cast<double>(random() % 4096) / 4096);
  });
}

void playModes(Stage& stage, const Options& options, const Scene& scene, std::uint64_t budget) {
  for (const Mode& mode : kModes) {
    const auto streamer = makeStreamer(stage, {.gpuBudget = budget});
    const auto asset = valueOf(streamer->open({.path = options.pack}));
    const Playback playback{.speed = mode.seeks ? 0 : mode.speed, .loop = mode.loop};
    Player player(stage, *streamer, scene);
    player.add(valueOf(streamer->addInstance({.asset = asset, .playback = playback})), 0, playback);
    player.settle(5);
    row(mode.name, mode.seeks ? playSeeks(player, scene, options.seconds) : player.play(options.seconds),
        mode.mostFrames);
    noErrors(*streamer);
    stage.gpu().waitIdle();
  }
}

void sectionPlay(Stage& stage, const Options& options, const Scene& scene) {
  for (const double share : {0.25, 0.5, 1.0}) {
    const auto budget = static_cast<std::uint64_t>(share * static_cast<double>(scene.gpuBytes));
    fmt::print(
        "(a) one instance, {:.0f} s each, budget {:.2f} of the frames' {:.2f} MB; wanted of 0.25: late 0, p99 "
        "below 1 frame, after seeks 2\n",
        options.seconds, share, static_cast<double>(scene.gpuBytes) * 1e-6);
    titles();
    playModes(stage, options, scene, budget);
  }
}

double processSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// An instance that stands on each frame, so that all of them are wanted at once.
void measureLoads(Stage& stage, const std::string& path) {
  const Scene scene = sceneOf(stage.gpu(), stage.renderer(), path);
  double wall = 0, cpu = 0, bytes = 0, read = 0;
  std::uint32_t rounds = 0;
  while (wall < 1.5 && rounds < 200) {
    const auto streamer = makeStreamer(stage, {.gpuBudget = scene.gpuBytes * 2 + (32u << 20), .threads = 1});
    const auto asset = valueOf(streamer->open({.path = path}));
    Player player(stage, *streamer, scene);
    const Playback still{.speed = 0, .interpolation = runtime::Interpolation::hold};
    for (std::uint32_t i = 0; i < scene.frames; ++i) {
      const double time = i / scene.framesPerSecond + 1e-6;
      player.add(valueOf(streamer->addInstance({.asset = asset, .time = time, .playback = still})), time, still);
    }
    const Clock::time_point begin = Clock::now();
    const double before = processSeconds();
    // What is there may still be on its way from a coarser level: that is not asked.
    const bool came = player.until(
        30,
        [&] {
          const runtime::StreamStats stats = streamer->stats();
          const auto missing =
              std::accumulate(stats.missingBricks.begin(), stats.missingBricks.end(), std::uint64_t{0});
          return stats.updates > 3 && missing == 0 && stats.instancesHeld + stats.instancesEmpty == 0 &&
                 stats.loadsQueued + stats.loadsReading + stats.loadsDecoding + stats.loadsUploading == 0;
        },
        1000);
    if (!came) fail(path + ": not every frame came within 30 s");
    wall += millisecondsSince(begin) * 1e-3;
    cpu += processSeconds() - before;
    bytes += static_cast<double>(streamer->stats().gpuBytes);
    read += static_cast<double>(format::Pack::openFile(path)->fileSize());
    ++rounds;
    noErrors(*streamer);
    stage.gpu().waitIdle();
  }
  fmt::print("  {:<34} {:>6} {:>8.1f} {:>10.0f} {:>10.0f} {:>10.0f} {:>5}\n", path.substr(path.rfind('/') + 1),
             scene.frames, bytes / rounds * 1e-6, bytes / wall * 1e-6, bytes / cpu * 1e-6, read / wall * 1e-6,
             bytes / cpu >= 1e9 ? "ok" : "FAIL");
  std::fflush(stdout);
}

void sectionLoads(Stage& stage, const Options& options) {
  fmt::print(
      "(b) every frame of a pack, one thread that decompresses; wanted: 1000 MB of GPU bytes a second of a "
      "core\n  {:<34} {:>6} {:>8} {:>10} {:>10} {:>10}\n",
      "", "frames", "GPU MB", "MB/s", "MB/CPU s", "disk MB/s");
  measureLoads(stage, options.pack);
  for (const std::string& path : options.also) measureLoads(stage, path);
}

// `count` instances, each somewhere else in the volume, of the assets by turns.
void addMany(Player& player, Streamer& streamer, std::span<const runtime::AssetId> assets, const Scene& scene,
             std::uint32_t count) {
  std::mt19937 random(11);
  for (std::uint32_t i = 0; i < count; ++i) {
    InstanceInfo info{.asset = assets[i % assets.size()]};
    info.time = scene.seconds * static_cast<double>(random() % 4096) / 4096;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double share = static_cast<double>(random() % 4096) / 2048 - 1;
      info.objectToWorld[axis * 4 + 3] = share * scene.reach * 4;
    }
    player.add(valueOf(streamer.addInstance(info)), info.time, info.playback);
  }
}

void sectionUpdate(Stage& stage, const Options& options, const Scene& scene) {
  fmt::print("(c) update() on the frame thread; wanted: under 50 us at 1000 instances\n");
  titles();
  for (const std::uint32_t count : {1u, 10u, 100u, 1000u}) {
    const auto streamer = makeStreamer(stage, {.gpuBudget = scene.gpuBytes * 2 + (32u << 20)});
    const runtime::AssetId assets[] = {valueOf(streamer->open({.path = options.pack}))};
    Player player(stage, *streamer, scene);
    addMany(player, *streamer, assets, scene, count);
    player.settle(5);
    row(fmt::format("{} instances", count), player.play(std::min(5.0, options.seconds)));
    noErrors(*streamer);
    stage.gpu().waitIdle();
  }
}

struct FirstFrame {
  double opened, any, full;  // milliseconds
};

// As a game does that cannot wait for its next frame: update() every 0.2 ms.
FirstFrame firstFrame(Stage& stage, const Scene& scene, const std::string& path) {
  const auto streamer = makeStreamer(stage, {.gpuBudget = scene.mostBytes * 8 + (8u << 20)});
  const Clock::time_point begin = Clock::now();
  const auto asset = valueOf(streamer->open({.path = path}));
  FirstFrame first{.opened = millisecondsSince(begin), .any = -1, .full = -1};
  const auto id = valueOf(streamer->addInstance({.asset = asset, .time = scene.seconds / 2, .playback = {.speed = 0}}));
  for (Clock::time_point last = begin; millisecondsSince(begin) < 10000;) {
    const double passed = millisecondsSince(last) * 1e-3;
    last = Clock::now();
    streamer->update({.seconds = passed, .view = stage.view(scene)});
    const runtime::Drawable drawable = streamer->drawable(id);
    if (drawable.count != 0 && first.any < 0) first.any = millisecondsSince(begin);
    if (Player::full(drawable)) {
      first.full = millisecondsSince(begin);
      break;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  noErrors(*streamer);
  stage.gpu().waitIdle();
  return first;
}

void sectionOpen(Stage& stage, const Options& options) {
  const std::string& path = options.longPack.empty() ? options.pack : options.longPack;
  const Scene scene = sceneOf(stage.gpu(), stage.renderer(), path);
  std::vector<double> opened, any, full;
  for (int i = 0; i < 20; ++i) {
    const FirstFrame first = firstFrame(stage, scene, path);
    opened.push_back(first.opened);
    any.push_back(first.any);
    full.push_back(first.full);
  }
  fmt::print("(d) from open() of {}, {} frames, 20 times; wanted: a frame within 30 ms\n  {:<26} {:>9} {:>9}\n", path,
             scene.frames, "milliseconds", "median", "longest");
  const auto line = [](const char* name, const std::vector<double>& values, const char* verdict) {
    fmt::print("  {:<26} {:>9.2f} {:>9.2f} {:>4}\n", name, percentile(values, 0.5), percentile(values, 1), verdict);
  };
  line("open() returns", opened, "");
  line("first drawable", any, percentile(any, 1) < 30 ? "ok" : "FAIL");
  line("in full detail", full, "");
}

void sectionDisks(Stage& stage, const Options& options, const Scene& scene) {
  fmt::print("(e) simulated disks, +1x in a loop, {:.0f} s each\n", options.seconds);
  titles();
  for (const tests::DiskModel& model : {tests::kNvme, tests::kSataSsd, tests::kHardDisk, tests::kNetwork}) {
    for (const double share : {1.0, 0.5, 0.25}) {
      tests::SimulatedDisk disk(model);
      const auto streamer =
          makeStreamer(stage, {.gpuBudget = static_cast<std::uint64_t>(share * static_cast<double>(scene.gpuBytes))});
      const auto asset = valueOf(streamer->open({.source = disk.file(options.pack)}));
      Player player(stage, *streamer, scene);
      player.add(valueOf(streamer->addInstance({.asset = asset})), 0, {});
      player.settle(5);
      row(fmt::format("{}, budget {:.2f}", model.name, share), player.play(options.seconds));
      noErrors(*streamer);
      stage.gpu().waitIdle();
    }
  }
}

void sectionMany(Stage& stage, const Options& options, const Scene& scene) {
  fmt::print("(f) many under one budget, playing\n");
  titles();
  for (const std::size_t assetCount : {std::size_t{1}, std::size_t{20}}) {
    for (const double share : {1.0, 0.5, 0.25}) {
      const double all = static_cast<double>(scene.gpuBytes) * static_cast<double>(assetCount);
      const auto streamer = makeStreamer(stage, {.gpuBudget = static_cast<std::uint64_t>(share * all)});
      std::vector<runtime::AssetId> assets;
      for (std::size_t i = 0; i < assetCount; ++i) {
        assets.push_back(valueOf(streamer->open({.path = options.pack})));
      }
      Player player(stage, *streamer, scene);
      addMany(player, *streamer, assets, scene, assetCount == 1 ? 1000 : 100);
      player.settle(5);
      row(fmt::format("{} of {}, budget {:.2f}", player.size(), assetCount, share),
          player.play(std::min(5.0, options.seconds)));
      noErrors(*streamer);
      stage.gpu().waitIdle();
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  Stage stage(options.device, options.draws);
  const Scene scene = sceneOf(stage.gpu(), stage.renderer(), options.pack);
  fmt::print("{} on {}: {} frames at {} a second, {:.2f} MB on the device, {:.2f} the largest\n", options.pack,
             stage.gpu().deviceName(), scene.frames, scene.framesPerSecond, static_cast<double>(scene.gpuBytes) * 1e-6,
             static_cast<double>(scene.mostBytes) * 1e-6);
  if (options.wants('a')) sectionPlay(stage, options, scene);
  if (options.wants('b')) sectionLoads(stage, options);
  if (options.wants('c')) sectionUpdate(stage, options, scene);
  if (options.wants('d')) sectionOpen(stage, options);
  if (options.wants('e')) sectionDisks(stage, options, scene);
  if (options.wants('f')) sectionMany(stage, options, scene);
  if (stage.loop() != nullptr) {
    fmt::print("{} draws; {} were submitted before their uploads were complete\n", stage.loop()->drawn(),
               stage.loop()->waited());
  }
  return 0;
}
