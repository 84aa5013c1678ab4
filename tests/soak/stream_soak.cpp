// Plays with the streamer at random for as long as it is told: billow_stream_soak [--operations N] [--seed S]
// [--seconds T] [--validation] [--trace]. Updates, seeks, playback, instances and assets that come and go, budgets, hot
// reloads by good, corrupt and truncated packs, faults of disk, memory and device, detach and attach; after each step
// what stream.h promises is checked, and now and then a picture against that of a freshly opened pack. Silent but for a
// summary, and 0, when all held; else it says what did not, and the seed.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "soak.h"

namespace {

using billow::tests::Soak;
using billow::tests::SoakOptions;

[[noreturn]] void usage(std::string_view what) {
  fmt::print(stderr, "billow_stream_soak: {}\n", what);
  std::exit(1);
}

SoakOptions parse(int argc, char** argv) {
  SoakOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--validation") {
      options.validation = true;
      continue;
    }
    if (argument == "--trace") {
      options.trace = true;
      continue;
    }
    if (++i >= argc) usage("an option lacks its value");
    if (argument == "--operations")
      options.operations = std::strtoull(argv[i], nullptr, 10);
    else if (argument == "--seed")
      options.seed = static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10));
    else if (argument == "--seconds")
      options.seconds = std::strtod(argv[i], nullptr);
    else
      usage(fmt::format("what is {}?", argument));
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  const SoakOptions options = parse(argc, argv);
  Soak soak(options);
  const auto begin = std::chrono::steady_clock::now();
  soak.run();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  fmt::print("{}\n{:.1f} s\n", soak.summary(), seconds);
  return 0;
}
