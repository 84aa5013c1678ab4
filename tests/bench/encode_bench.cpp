// How fast each encoding is on one core, and how well it does alone: on a smooth cloud of 256^3 voxels and, where the
// environment variable BILLOW_DATA names a folder of sequences, on the middle frames of real ones.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
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

// The middle frame of a sequence, a corpus per grid that has leaves.
std::vector<std::pair<std::string, Corpus>> readSequence(const std::string& folder) {
  const compiler::ImportOptions options;
  const auto ignore = [](const std::string&) {};
  const compiler::Plan plan = compiler::planInputs({folder}, options, ignore);
  std::vector<std::pair<std::string, Corpus>> corpora;
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    const compiler::PlannedFrame& planned = volume.frames[volume.frames.size() / 2];
    const compiler::ImportedFrame frame = compiler::importFrame(volume, planned, options, ignore);
    for (std::size_t g = 0; g < frame.grids.size(); ++g) {
      Corpus corpus;
      for (const compiler::Leaf& leaf : frame.grids[g].leaves) {
        Brick brick{leaf.values, leaf.active, 0};
        brick.count();
        add(corpus, brick);
      }
      corpus.range = static_cast<double>(frame.grids[g].max) - static_cast<double>(frame.grids[g].min);
      if (!corpus.bricks.empty()) corpora.emplace_back(volume.name + "/" + volume.grids[g].name, std::move(corpus));
    }
  }
  return corpora;
}

using Encode = std::function<void(const compiler::BrickSource&, compiler::Candidate&)>;

void run(benchmark::State& state, const Corpus& corpus, const Encode& encode) {
  double squared = 0;
  compiler::Candidate candidate;
  while (state.KeepRunning()) {
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
  const auto add = [&](const std::string& what, const Encode& encode) {
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
  std::vector<std::pair<std::string, Corpus>> real;
  if (const char* data = std::getenv("BILLOW_DATA"); data != nullptr) {
    for (const char* sequence : {"ember", "smoke", "fire", "dust"}) {
      for (auto& corpus : readSequence(std::string(data) + "/" + sequence)) real.push_back(std::move(corpus));
    }
  }
  for (const auto& [name, corpus] : real) registerAll(name, corpus);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
