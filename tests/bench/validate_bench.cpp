// How fast a pack is validated: bytes of pack a second. The goal is over 500 MB/s on two cores.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>

#include "../sample_pack.h"
#include "billow/format/validate.h"

namespace {

using namespace billow;
using namespace billow::format;

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

// Stored bricks that compress about as well as real ones: some bytes are of few values.
std::vector<std::byte> brickBytesLike(std::uint32_t bytes, Random& random) {
  std::vector<std::byte> brick(bytes);
  for (std::size_t i = 0; i < brick.size(); ++i) {
    brick[i] = static_cast<std::byte>(random() & (i % 16 < 8 ? 0xffu : 0x3fu));
  }
  return brick;
}

void addBrick(tests::GridFrameBuilder& builder, std::array<std::uint32_t, 3> cell, Random& random) {
  Mask3 mask{};
  const std::uint32_t kept = random() % 4;
  for (std::uint32_t& word : mask.words) word = kept == 0 ? random() : ~0u;
  const std::uint32_t maskWord = kept == 0 ? 0 : kMaskAll;
  const std::uint32_t kind = random() % 20;
  const std::uint32_t encoding = kind < 6    ? kEncodingConstant
                                 : kind < 14 ? kEncodingBc7Z + kind % 3
                                 : kind < 19 ? kEncodingLocal2 + kind % 5
                                             : kEncodingUniform8;
  if (encoding == kEncodingConstant) return builder.brick(cell, encoding, {}, 1, 0, maskWord, mask);
  builder.brick(cell, encoding, brickBytesLike(*brickBytes(encoding), random), 0.1f, 0.002f, maskWord, mask);
}

std::vector<std::byte> makePack(std::uint32_t frames) {
  Random random(1);
  return tests::writePack({}, [&](PackWriter& writer) {
    PackTables tables = tests::sampleTables("bench", {"density"}, frames);
    for (std::uint32_t f = 0; f < frames; ++f) {
      tests::GridFrameBuilder builder(writer, 0);
      for (std::uint32_t i = 0; i < 40u * 40 * 40; ++i) {
        addBrick(builder, {i / 1600 + f, i / 40 % 40, i % 40 + 200}, random);
      }
      tables.gridFrames.push_back(builder.finish(tables));
    }
    return tables;
  });
}

void validatePack(benchmark::State& state) {
  const std::vector<std::byte> bytes = makePack(static_cast<std::uint32_t>(state.range(1)));
  const auto source = makeMemorySource(bytes);
  ValidateOptions options;
  options.threads = static_cast<unsigned>(state.range(0));
  for (const auto& iteration : state) {
    (void)iteration;
    validate(*source, options, [](const Issue& issue) {
      std::fprintf(stderr, "%s\n", toString(issue).c_str());
      std::exit(1);
    });
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
  state.counters["pack MB"] = static_cast<double>(bytes.size()) * 1e-6;
}

BENCHMARK(validatePack)
    ->ArgNames({"threads", "frames"})
    ->Args({1, 6})
    ->Args({2, 6})
    ->Args({2, 1})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
