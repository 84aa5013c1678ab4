// How fast each encoding is on one core, and how well it does: a smooth cloud of 256^3 voxels, and whatever bricks are
// in the file that BILLOW_BRICKS names (records of 512 floats, then a mask of 64 bytes, in brick order).
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "stages.h"

namespace {

using namespace billow;

struct Brick {
  format::Values values;
  format::Mask3 active;
  std::uint32_t activeCount = 0;
};

struct Corpus {
  std::vector<Brick> bricks;
  double range = 0;
  std::uint64_t activeVoxels = 0;
};

std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  std::uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ z * 0xcb1ab31fu;
  h = (h ^ h >> 15) * 0x2c1b3c6du;
  h = (h ^ h >> 12) * 0x297a2d39u;
  return h ^ h >> 15;
}

// Value noise in [0, 1], smooth between lattice points.
double noise(double x, double y, double z) {
  const auto ix = static_cast<std::uint32_t>(x), iy = static_cast<std::uint32_t>(y), iz = static_cast<std::uint32_t>(z);
  const auto fade = [](double t) { return t * t * (3 - 2 * t); };
  const double fx = fade(x - ix), fy = fade(y - iy), fz = fade(z - iz);
  double total = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const double weight = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy) * (dz != 0 ? fz : 1 - fz);
    total += weight * hash(ix + dx, iy + dy, iz + dz) / 4294967295.0;
  }
  return total;
}

// A ball with an eroded border: falling off from the middle, cut by five octaves.
float cloud(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const double dx = x / 128.0 - 1, dy = y / 128.0 - 1, dz = z / 128.0 - 1;
  double fbm = 0;
  double scale = 1.0 / 64, amplitude = 0.5;
  for (int octave = 0; octave < 5; ++octave, scale *= 2, amplitude *= 0.45) {
    fbm += amplitude * noise(x * scale + 7, y * scale + 7, z * scale + 7);
  }
  const double density = fbm * 1.4 - std::sqrt(dx * dx + dy * dy + dz * dz) * 0.8;
  return density > 0 ? static_cast<float>(density) : 0.0f;
}

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
  for (std::uint32_t cell = 0; cell < 32 * 32 * 32; ++cell) {
    Brick brick{};
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      const float value =
          cloud((cell >> 10) * 8 + (i >> 6), (cell >> 5 & 31) * 8 + (i >> 3 & 7), (cell & 31) * 8 + (i & 7));
      brick.values[i] = value;
      if (value > 0) {
        brick.active.words[i >> 5] |= 1u << (i & 31);
        ++brick.activeCount;
      }
    }
    add(corpus, brick);
  }
  measureRange(corpus);
  return corpus;
}

Corpus readBricks(const char* path) {
  Corpus corpus;
  std::ifstream file(path, std::ios::binary);
  Brick brick{};
  while (file.read(reinterpret_cast<char*>(brick.values.data()), sizeof brick.values) &&
         file.read(reinterpret_cast<char*>(&brick.active), sizeof brick.active)) {
    brick.activeCount = 0;
    for (const std::uint32_t word : brick.active.words) {
      brick.activeCount += static_cast<std::uint32_t>(__builtin_popcount(word));
    }
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
