// How fast each encoding is on one core, and how well it does: a smooth cloud of 256^3 voxels, and whatever bricks are
// in the file that BILLOW_BRICKS names (records of 512 floats, then a mask of 64 bytes, in brick order).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "../brick_corpus.h"
#include "stages.h"

namespace {

using namespace billow;

using tests::Brick;

struct Corpus {
  std::vector<Brick> bricks;
  double range = 0;
  std::uint64_t activeVoxels = 0;
};

void add(Corpus& corpus, const Brick& brick) {
  if (brick.activeCount == 0) return;
  corpus.bricks.push_back(brick);
  corpus.activeVoxels += brick.activeCount;
}

void measureRange(Corpus& corpus) {
  float low = 0, high = 0;
  for (const Brick& brick : corpus.bricks) {
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (!format::maskBit(brick.active, i)) continue;
      low = std::min(low, brick.values[i]);
      high = std::max(high, brick.values[i]);
    }
  }
  corpus.range = static_cast<double>(high) - static_cast<double>(low);
}

Corpus makeCloud() {
  Corpus corpus;
  for (const Brick& brick : tests::cloudBricks(256)) add(corpus, brick);
  measureRange(corpus);
  return corpus;
}

Corpus readBricks(const char* path) {
  Corpus corpus;
  std::ifstream file(path, std::ios::binary);
  Brick brick{};
  while (file.read(reinterpret_cast<char*>(brick.values.data()), sizeof brick.values) &&
         file.read(reinterpret_cast<char*>(&brick.active), sizeof brick.active)) {
    brick.count();
    add(corpus, brick);
  }
  measureRange(corpus);
  return corpus;
}

using Encode = std::function<void(const compiler::BrickSource&, compiler::Candidate&)>;

void run(benchmark::State& state, const Corpus& corpus, const Encode& encode) {
  double squared = 0;
  compiler::Candidate candidate;
  for (auto _ : state) {
    squared = 0;
    for (const Brick& brick : corpus.bricks) {
      encode({&brick.values, &brick.active, brick.activeCount, 0.0f}, candidate);
      squared += candidate.squaredError;
    }
  }
  const auto voxels = static_cast<double>(corpus.bricks.size() * format::kBrickVoxels);
  state.counters["voxels/s"] = benchmark::Counter(voxels, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["dB"] = 20 * std::log10(corpus.range / std::sqrt(squared / static_cast<double>(corpus.activeVoxels)));
}

void registerAll(const std::string& name, const Corpus& corpus) {
  const auto add = [&](const std::string& what, Encode encode) {
    benchmark::RegisterBenchmark((name + "/" + what).c_str(), [&corpus, encode](benchmark::State& state) {
      run(state, corpus, encode);
    })->Unit(benchmark::kMillisecond);
  };
  add("constant", compiler::encodeConstant);
  for (int effort = 0; effort <= 5; ++effort) {
    add("bc7/effort" + std::to_string(effort), [effort](const auto& brick, compiler::Candidate& out) {
      compiler::encodeBc7(brick, format::kEncodingBc7Z, effort, out);
    });
  }
  for (int effort = 0; effort <= 5; ++effort) {
    add("bc7BestAxis/effort" + std::to_string(effort),
        [effort](const auto& brick, compiler::Candidate& out) { compiler::encodeBc7BestAxis(brick, effort, out); });
  }
  add("bc4",
      [](const auto& brick, compiler::Candidate& out) { compiler::encodeBc4(brick, format::kEncodingBc4Z, out); });
  add("bc4BestAxis", compiler::encodeBc4BestAxis);
  add("r8", compiler::encodeR8);
  add("r16", compiler::encodeR16);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const Corpus cloudCorpus = makeCloud();
  registerAll("cloud256", cloudCorpus);
  Corpus real;
  if (const char* path = std::getenv("BILLOW_BRICKS"); path != nullptr) {
    real = readBricks(path);
    registerAll("real", real);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
