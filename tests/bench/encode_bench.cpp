// How fast each encoding is on one core, and how well it does alone: on a smooth cloud of 256^3 voxels and, where the
// environment variable BILLOW_DATA names a folder of sequences, on the middle frames of real ones.
#include <benchmark/benchmark.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "grid_corpus.h"

namespace {

using namespace billow;

using bench::Corpus;
using tests::Brick;

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
  state.counters["dB"] = corpus.psnr(squared);
}

void registerAll(const Corpus& corpus) {
  const auto add = [&](const std::string& what, const Encode& encode) {
    benchmark::RegisterBenchmark((corpus.name + "/" + what).c_str(), [&corpus, encode](benchmark::State& state) {
      run(state, corpus, encode);
    })->Unit(benchmark::kMillisecond);
  };
  add("constant", compiler::encodeConstant);
  for (int effort = 0; effort <= 9; ++effort) {
    add("bc7/effort" + std::to_string(effort), [effort](const auto& brick, compiler::Candidate& out) {
      compiler::encodeBc7(brick, format::kEncodingBc7Z, effort, out);
    });
  }
  for (int effort = 0; effort <= 9; ++effort) {
    add("bc7BestAxis/effort" + std::to_string(effort),
        [effort](const auto& brick, compiler::Candidate& out) { compiler::encodeBc7BestAxis(brick, effort, out); });
  }
  add("uniform1to8", [](const auto& brick, compiler::Candidate& out) {
    std::array<compiler::Fit, 8> fits;
    compiler::fitUniforms(brick, 1, 8, fits);
    out.squaredError = fits[7].squaredError;
  });
  for (const std::uint32_t bits : {2u, 4u, 8u, 16u}) {
    add("uniform" + std::to_string(bits),
        [bits](const auto& brick, compiler::Candidate& out) { compiler::encodeUniform(brick, bits, out); });
  }
  for (std::uint32_t bits = 2; bits <= 6; bits += 2) {
    add("local" + std::to_string(bits),
        [bits](const auto& brick, compiler::Candidate& out) { compiler::encodeLocal(brick, bits, out); });
  }
  add("coarse", compiler::encodeCoarse);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::vector<Corpus> corpora = {bench::cloudCorpus()};
  if (const char* data = std::getenv("BILLOW_DATA"); data != nullptr) {
    for (const char* sequence : {"ember", "smoke", "fire", "dust"}) {
      for (Corpus& corpus : bench::sequenceCorpora(std::string(data) + "/" + sequence)) {
        corpora.push_back(std::move(corpus));
      }
    }
  }
  for (const Corpus& corpus : corpora) registerAll(corpus);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
