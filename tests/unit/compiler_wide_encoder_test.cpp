// The encoders' hot loops give the same bits on every machine: what AVX2 runs is held to what every machine can run.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "brick_corpus.h"
#include "encode/wide/wide_encoder.h"

namespace {

using namespace billow;
using compiler::BrickSource;
using compiler::Candidate;
using compiler::WideEncoder;
using tests::Brick;

// Everything that an encoder computes of a brick.
std::vector<std::byte> results(const WideEncoder& wide, const Brick& brick) {
  std::vector<std::byte> bytes;
  const auto add = [&](const auto& value) {
    const auto* begin = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), begin, begin + sizeof value);
  };
  const BrickSource source = {&brick.values, &brick.active, brick.activeCount, -7.0f};
  const compiler::ValueRange range = wide.activeRange(source);
  add(range.min);
  add(range.max);
  compiler::BrickTargets targets(source);
  wide.texelTargets(source, compiler::coverRange(range, 0, 255), 0, 255, targets.value);
  wide.texelWeights(source, targets.weight);
  add(targets.value);
  add(targets.weight);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    compiler::WideBrick arranged;
    wide.arrange(targets, axis, arranged);
    add(arranged.value);
    add(wide.bc4Spread(arranged));
    std::array<std::byte, 256> payload;
    wide.encodeBc4(arranged, payload.data());
    add(payload);
    compiler::WideMode6 mode6;
    add(wide.fitMode6(arranged, 3, mode6));
    add(mode6);
    Candidate candidate;
    candidate.lo = targets.range.lo;
    candidate.scale = targets.range.scale;
    format::Texels texels;
    format::decodeTexels(format::kEncodingBc4Z, payload, texels);
    wide.measure(source, texels, candidate);
    add(candidate.squaredError);
    add(candidate.maxError);
  }
  return bytes;
}

std::vector<Brick> bricks() {
  std::vector<Brick> result = tests::cloudBricks(32);
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    const auto value = [=](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      const float random = tests::randomValue(seed, format::voxelIndex(x, y, z));
      return seed % 2 == 0 ? random * 3e37f - 1e37f : static_cast<float>(x * y) + random * 1e-3f;
    };
    result.push_back(tests::makeBrick(value, [=](std::uint32_t i) { return tests::hash(i, seed, 9) % 8 >= seed; }));
  }
  result.push_back(tests::makeBrick([](auto...) { return 2.5f; }));
  result.push_back(tests::makeBrick([](auto...) { return 2.5f; }, [](std::uint32_t) { return false; }));
  return result;
}

TEST(WideEncoder, everyMachineGivesTheSameBits) {
  const auto encoders = compiler::wideEncoders();
  ASSERT_FALSE(encoders.empty());
  EXPECT_EQ(encoders.front(), &compiler::wideEncoder());
  EXPECT_EQ(encoders.back(), &compiler::baseline::kWideEncoder);
  std::uint32_t number = 0;
  for (const Brick& brick : bricks()) {
    const std::vector<std::byte> expected = results(compiler::baseline::kWideEncoder, brick);
    for (const WideEncoder* encoder : encoders) EXPECT_EQ(results(*encoder, brick), expected) << "brick " << number;
    ++number;
  }
}

// Weights that are all one must give what no weights give.
TEST(WideEncoder, weightsOfOneChangeNothing) {
  for (const Brick& brick : tests::cloudBricks(16)) {
    const BrickSource source = {&brick.values, &brick.active, brick.activeCount, 0.0f};
    if (source.activeCount != format::kBrickVoxels) continue;
    compiler::BrickTargets targets(source);
    compiler::WideBrick bare, weighted;
    compiler::wideEncoder().arrange(targets, 2, bare);
    targets.allActive = false;
    targets.weight.fill(1.0f);
    compiler::wideEncoder().arrange(targets, 2, weighted);
    std::array<std::byte, 256> a, b;
    compiler::wideEncoder().encodeBc4(bare, a.data());
    compiler::wideEncoder().encodeBc4(weighted, b.data());
    EXPECT_EQ(a, b);
  }
}

}  // namespace
