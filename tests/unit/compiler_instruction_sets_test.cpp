// The encoders' hot loops give the same bits with every instruction set that this machine has, one float at a time
// included.
#define HWY_DISABLED_TARGETS HWY_SSSE3  // as the encoders are compiled
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <cstring>
#include <vector>

#include "brick_corpus.h"
#include "brick_source.h"
#include "encode/bc7_block.h"
#include "stages.h"

namespace {

using namespace billow;
using compiler::BrickSource;
using compiler::Candidate;
using tests::Brick;

std::vector<std::int64_t> instructionSets() {
  std::vector<std::int64_t> sets;
  for (std::int64_t rest = hwy::SupportedTargets() & HWY_TARGETS; rest != 0; rest &= rest - 1) {
    sets.push_back(rest & -rest);
  }
  return sets;
}

// Until it goes out of scope, the encoders use one instruction set alone.
class Only {
 public:
  explicit Only(std::int64_t set) { choose(set); }
  ~Only() { choose(0); }
  Only(const Only&) = delete;
  Only& operator=(const Only&) = delete;

 private:
  static void choose(std::int64_t set) {
    hwy::SetSupportedTargetsForTest(set);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

// Everything that an encoder computes of a brick.
std::vector<std::byte> results(const Brick& brick) {
  std::vector<std::byte> bytes;
  const auto add = [&](const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
  };
  const BrickSource source = tests::sourceOf(brick);
  const compiler::ValueRange range = compiler::activeRange(source);
  add(&range, sizeof range);
  const compiler::BrickTargets targets(source);
  add(&targets.value, sizeof targets.value);
  if (!targets.allActive) add(&targets.weight, sizeof targets.weight);
  compiler::BlockTexels texels;
  compiler::arrange(targets, 1, texels);
  add(texels.value, sizeof texels.value);
  const auto addCandidate = [&](const Candidate& candidate) {
    add(&candidate.encoding, sizeof candidate.encoding);
    add(&candidate.lo, sizeof candidate.lo);
    add(&candidate.scale, sizeof candidate.scale);
    add(&candidate.squaredError, sizeof candidate.squaredError);
    add(&candidate.maxError, sizeof candidate.maxError);
    add(candidate.payload.data(), *format::brickBytes(candidate.encoding));
  };
  Candidate candidate;
  for (std::uint32_t bits = 1; bits <= 16; bits += bits < 8 ? 1 : 8) {
    compiler::encodeUniform(source, bits, candidate);
    addCandidate(candidate);
  }
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    compiler::encodeLocal(source, bits, candidate);
    addCandidate(candidate);
  }
  compiler::encodeCoarse(source, candidate);
  addCandidate(candidate);
  for (int effort = 0; effort <= 9; effort += effort < 4 ? 1 : 5) {
    compiler::encodeBc7BestAxis(source, effort, candidate);
    addCandidate(candidate);
  }
  return bytes;
}

std::vector<Brick> bricks() {
  std::vector<Brick> result = tests::cloudBricks(16);
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    const auto value = [=](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      const float random = tests::randomValue(seed, format::voxelIndex(x, y, z));
      return seed % 2 == 0 ? random * 3e37f - 1e37f : static_cast<float>(x * y) + random * 1e-3f;
    };
    result.push_back(tests::makeBrick(value, [=](std::uint32_t i) { return tests::hash(i, seed, 9) % 8 >= seed; }));
    result.push_back(tests::makeBrick(value));
  }
  result.push_back(tests::makeBrick([](auto...) { return 2.5f; }));
  result.push_back(tests::makeBrick([](auto...) { return 2.5f; }, [](std::uint32_t) { return false; }));
  return result;
}

TEST(InstructionSets, allGiveTheSameBits) {
  const std::vector<std::int64_t> sets = instructionSets();
  // The one that every machine has comes last.
  ASSERT_FALSE(sets.empty());
  ASSERT_EQ(sets.back(), HWY_STATIC_TARGET);
  std::uint32_t number = 0;
  for (const Brick& brick : bricks()) {
    std::vector<std::byte> expected;
    {
      const Only only(sets.back());
      expected = results(brick);
    }
    for (const std::int64_t set : sets) {
      const Only only(set);
      EXPECT_EQ(results(brick), expected) << "brick " << number << " with " << hwy::TargetName(set);
    }
    ++number;
  }
}

// Weights that are all one must give what no weights give.
TEST(InstructionSets, weightsOfOneChangeNothing) {
  for (const Brick& brick : tests::cloudBricks(16)) {
    const BrickSource source = tests::sourceOf(brick);
    if (source.activeCount != format::kBrickVoxels) continue;
    compiler::BrickTargets targets(source);
    compiler::BlockTexels bare, weighted;
    compiler::arrange(targets, 2, bare);
    targets.allActive = false;
    targets.weight.fill(1.0f);
    compiler::arrange(targets, 2, weighted);
    for (int effort = 0; effort < 4; ++effort) {
      const compiler::Bc7Search search = compiler::bc7Search(effort);
      compiler::Bc7Fits a, b;
      compiler::fitMode6(bare, search, a);
      compiler::fitMode6(weighted, search, b);
      for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(a.error[i], b.error[i], 1e-3f * a.error[i]) << effort;
    }
  }
}

}  // namespace
