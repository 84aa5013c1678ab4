// Every encoding over ordinary and extreme bricks: what is promised is what the reader reconstructs, and every build
// writes the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "brick_corpus.h"
#include "brick_source.h"
#include "encode/texel_range.h"
#include "stages.h"

namespace {

using namespace billow;
using compiler::Candidate;
using tests::Brick;
using tests::kTile;
using tests::makeBrick;
using tests::sourceOf;

struct Encoder {
  std::string name;
  std::function<void(const compiler::BrickSource&, Candidate&)> encode;
};

std::vector<Encoder> allEncoders() {
  std::vector<Encoder> encoders = {{"constant", compiler::encodeConstant}, {"coarse", compiler::encodeCoarse}};
  for (const std::uint32_t bits : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 16u}) {
    encoders.push_back({"uniform " + std::to_string(bits),
                        [bits](const auto& source, Candidate& out) { compiler::encodeUniform(source, bits, out); }});
  }
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    encoders.push_back({"local " + std::to_string(bits),
                        [bits](const auto& source, Candidate& out) { compiler::encodeLocal(source, bits, out); }});
  }
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    encoders.push_back({"BC7 axis " + std::to_string(axis), [axis](const auto& source, Candidate& out) {
                          compiler::encodeBc7(source, format::kEncodingBc7Z + axis, 1, out);
                        }});
  }
  for (const int effort : {0, 3, 9}) {
    encoders.push_back({"BC7 best axis, effort " + std::to_string(effort),
                        [effort](const auto& src, Candidate& out) { compiler::encodeBc7BestAxis(src, effort, out); }});
  }
  return encoders;
}

struct NamedBrick {
  std::string name;
  Brick brick;
};

bool never(std::uint32_t) {
  return false;
}

std::vector<NamedBrick> corpus() {
  const auto random = [](std::uint32_t seed, float low, float high) {
    return [=](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return low + (high - low) * tests::randomValue(seed, format::voxelIndex(x, y, z));
    };
  };
  const auto ramp = [](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return static_cast<float>(x + 2 * y + 4 * z) / 64.0f;
  };
  const auto parity = [](std::uint32_t i) { return ((i >> 6 ^ i >> 3 ^ i) & 1u) != 0; };
  const auto sparse = [](std::uint32_t i) { return tests::hash(i, 5, 6) % 20 == 0; };
  const auto half = [](std::uint32_t i) { return tests::hash(i, 7, 8) % 2 == 0; };
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
  std::vector<NamedBrick> bricks = {
      {"zero", makeBrick([](auto...) { return 0.0f; })},
      {"constant", makeBrick([](auto...) { return 0.3f; })},
      {"constant, half active", makeBrick([](auto...) { return -5.5f; }, half)},
      {"slabs of two values", makeBrick([](std::uint32_t x, auto...) { return x < 4 ? 0.25f : 3.75f; })},
      {"checkerboard of two values",
       makeBrick([&](auto x, auto y, auto z) { return parity(format::voxelIndex(x, y, z)) ? 1.0f : 0.0f; })},
      {"checkerboard of activity", makeBrick(ramp, parity)},
      {"one active voxel", makeBrick(ramp, [](std::uint32_t i) { return i == 300; })},
      {"two active voxels", makeBrick(ramp, [](std::uint32_t i) { return i == 0 || i == 511; })},
      {"none active", makeBrick(ramp, never)},
      {"ramp", makeBrick(ramp)},
      {"ramp, sparse", makeBrick(ramp, sparse)},
      {"noise", makeBrick(random(1, 0.0f, 1.0f))},
      {"noise, half active", makeBrick(random(2, -3.0f, 9.0f), half)},
      {"noise, sparse", makeBrick(random(3, 0.0f, 100.0f), sparse)},
      {"denormal noise", makeBrick(random(4, 0.0f, 1e-40f), half)},
      {"two denormals", makeBrick([&](auto x, auto...) { return x < 3 ? 0.0f : kDenormal; }, half)},
      {"tiny noise", makeBrick(random(5, 0.0f, 1e-8f))},
      {"huge noise", makeBrick(random(6, -1e37f, 1e37f), half)},
      {"top of the range", makeBrick(random(7, 1e38f, kLargest))},
      {"bottom of the range",
       makeBrick([&](auto x, auto y, auto z) { return x < 2 ? -kLargest : random(8, -3e38f, -1e38f)(x, y, z); }, half)},
      {"a step of one unit",
       makeBrick([](auto x, auto...) { return x < 4 ? 1e6f : std::nextafter(1e6f, 2e6f); }, half)},
      {"an outlier", makeBrick([](auto x, auto y, auto z) { return x + y + z == 0 ? 1e6f : 0.001f; })},
  };
  return bricks;
}

// Decodes as a reader would, and holds the candidate to its word.
void checkPromise(const Brick& brick, const Candidate& candidate) {
  std::uint32_t mask = 0;  // an index
  if (candidate.texelMask) {
    mask = format::kMaskTexel;
  } else if (brick.activeCount == format::kBrickVoxels) {
    mask = format::kMaskAll;
  }
  const format::Node3 node{candidate.encoding << format::kEncodingShift, mask, candidate.lo, candidate.scale, 0};
  const auto bytes = format::brickBytes(candidate.encoding);
  ASSERT_TRUE(bytes.has_value());
  format::Values values;
  format::Mask3 active;
  format::decodeBrick(node, &brick.active, std::span(candidate.payload).first(*bytes), kTile, values, active);
  ASSERT_EQ(std::memcmp(&active, &brick.active, sizeof active), 0);
  double squared = 0, largest = 0;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(active, i)) {
      ASSERT_EQ(values[i], kTile) << i;
      continue;
    }
    ASSERT_TRUE(std::isfinite(values[i])) << i;
    const double error = static_cast<double>(values[i]) - static_cast<double>(brick.values[i]);
    squared += error * error;
    largest = std::max(largest, std::abs(error));
  }
  EXPECT_NEAR(candidate.squaredError, squared, 1e-12 * squared);
  const double highest = std::numeric_limits<float>::max();
  // The next float at or above it.
  EXPECT_GE(static_cast<double>(candidate.maxError), std::min(largest, highest));
  EXPECT_LE(static_cast<double>(std::nextafter(candidate.maxError, 0.0f)), std::min(largest, highest));
  EXPECT_TRUE(std::isfinite(candidate.scale));
  EXPECT_GE(candidate.scale, 0.0f);
}

TEST(Encode, whatIsPromisedIsWhatIsDecoded) {
  for (const NamedBrick& named : corpus()) {
    for (const Encoder& encoder : allEncoders()) {
      SCOPED_TRACE(named.name + " as " + encoder.name);
      Candidate candidate;
      encoder.encode(sourceOf(named.brick), candidate);
      checkPromise(named.brick, candidate);
    }
  }
}

TEST(Encode, randomMasksKeepThePromise) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const Brick brick = makeBrick(
        [=](auto x, auto y, auto z) {
          const float noise = tests::randomValue(seed, format::voxelIndex(x, y, z));
          return static_cast<float>(x * y) * 0.1f + noise * static_cast<float>(seed % 7);
        },
        [=](std::uint32_t i) { return tests::hash(i, seed, 99) % 16 <= seed % 17; });
    for (const Encoder& encoder : allEncoders()) {
      SCOPED_TRACE(std::to_string(seed) + " as " + encoder.name);
      Candidate candidate;
      encoder.encode(sourceOf(brick), candidate);
      checkPromise(brick, candidate);
    }
  }
}

// Half a step, and what single precision adds: a rounding of the product, of the sum, and of lo.
double rawBound(const Brick& brick, const Candidate& candidate) {
  float magnitude = std::abs(candidate.lo);
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (format::maskBit(brick.active, i)) magnitude = std::max(magnitude, std::abs(brick.values[i]));
  }
  const double unit = static_cast<double>(magnitude) * std::numeric_limits<float>::epsilon();
  return 0.501 * static_cast<double>(candidate.scale) + 2 * unit;
}

TEST(Encode, uniformTexelsAreWithinHalfAStep) {
  for (const NamedBrick& named : corpus()) {
    SCOPED_TRACE(named.name);
    // Below the lowest float there is no room for the step that tells inactive voxels: such a brick needs a stored
    // mask.
    const bool room = named.name != "bottom of the range";
    for (const std::uint32_t bits : {8u, 16u}) {
      Candidate candidate;
      compiler::encodeUniform(sourceOf(named.brick), bits, candidate);
      // A fit may leave the ends of the range somewhat outside of its levels, for the sake of all the others.
      const double bound = rawBound(named.brick, candidate) + (bits == 8 ? static_cast<double>(candidate.scale) : 0);
      EXPECT_LE(candidate.maxError, bound);
      EXPECT_EQ(candidate.texelMask, room && named.brick.activeCount < format::kBrickVoxels);
    }
  }
}

TEST(Encode, fitsOfUniformBricksAreThoseOfTheirEncoders) {
  for (const NamedBrick& named : corpus()) {
    std::array<compiler::Fit, 8> fits;
    compiler::fitUniforms(sourceOf(named.brick), 1, 8, fits);
    for (std::uint32_t bits = 1; bits <= 8; ++bits) {
      Candidate candidate;
      compiler::encodeUniform(sourceOf(named.brick), bits, candidate);
      const compiler::Fit& fit = fits[bits - 1];
      EXPECT_EQ(fit.encoding, candidate.encoding);
      EXPECT_EQ(fit.texelMask, candidate.texelMask);
      EXPECT_EQ(fit.lo, candidate.lo);
      EXPECT_EQ(fit.scale, candidate.scale);
      EXPECT_EQ(fit.squaredError, candidate.squaredError);
      EXPECT_EQ(fit.maxError, candidate.maxError);
    }
  }
}

// Error by bits a voxel of one kind of encoder.
template <class Encode>
void expectBitsPay(const Brick& brick, std::uint32_t from, std::uint32_t to, double factor, const Encode& encode) {
  double before = 0;
  for (std::uint32_t bits = from; bits <= to; ++bits) {
    Candidate candidate;
    encode(sourceOf(brick), bits, candidate);
    if (bits > from) {
      EXPECT_LT(candidate.squaredError, factor * before) << bits;
    }
    before = candidate.squaredError;
  }
}

TEST(Encode, aBitMoreIsAQuarterOfTheError) {
  // Evenly spread values: the limit is (2^n - 1)^2 / (2^(n + 1) - 1)^2, at best 1 / 4.
  const Brick full = makeBrick([](auto... at) { return tests::randomValue(31, format::voxelIndex(at...)); });
  expectBitsPay(full, 1, 8, 0.27, compiler::encodeUniform);
  expectBitsPay(full, 2, 6, 0.28, compiler::encodeLocal);
  const Brick half = makeBrick([](auto... at) { return tests::randomValue(32, format::voxelIndex(at...)); },
                               [](std::uint32_t i) { return tests::hash(i, 7, 8) % 2 == 0; });
  expectBitsPay(half, 3, 8, 0.27, compiler::encodeUniform);
  expectBitsPay(half, 3, 6, 0.28, compiler::encodeLocal);
}

TEST(Encode, localFollowsItsCells) {
  // Cells far apart in value, quiet within: two bits are enough, on one scale they are not.
  const Brick brick = makeBrick([](auto x, auto y, auto z) {
    return static_cast<float>(x / 4 * 4 + y / 4 * 8 + z / 2) +
           0.01f * tests::randomValue(9, format::voxelIndex(x, y, z));
  });
  Candidate local, uniform;
  compiler::encodeLocal(sourceOf(brick), 2, local);
  compiler::encodeUniform(sourceOf(brick), 3, uniform);
  EXPECT_LT(local.squaredError * 1000, uniform.squaredError);
}

TEST(Encode, coarseFollowsWhatIsLinear) {
  for (const bool masked : {false, true}) {
    const Brick brick =
        makeBrick([](auto x, auto y, auto z) { return 0.5f + 0.25f * static_cast<float>(x + 2 * y + z); },
                  [=](std::uint32_t i) { return !masked || tests::hash(i, 3, 4) % 4 != 0; });
    Candidate constant, coarse;
    compiler::encodeConstant(sourceOf(brick), constant);
    compiler::encodeCoarse(sourceOf(brick), coarse);
    // Beyond the outermost middles values stay, so a slope is not exact.
    EXPECT_LT(coarse.squaredError * 100, constant.squaredError) << masked;
  }
}

TEST(Encode, estimatesOfLocalBricksAreNearTheirErrors) {
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    double guessed = 0, found = 0;
    for (const Brick& brick : tests::cloudBricks(32)) {
      Candidate candidate;
      compiler::encodeLocal(sourceOf(brick), bits, candidate);
      guessed += compiler::estimateLocals(sourceOf(brick))[bits - 2];
      found += candidate.squaredError;
    }
    // The choice tries a local brick where half of the guess would pay.
    EXPECT_GT(found, 0.5 * guessed) << bits;
    EXPECT_LT(found, 1.5 * guessed) << bits;
  }
}

TEST(Encode, inactiveVoxelsHaveIndexZero) {
  for (const NamedBrick& named : corpus()) {
    for (const Encoder& encoder : allEncoders()) {
      Candidate candidate;
      encoder.encode(sourceOf(named.brick), candidate);
      if (format::indexBits(candidate.encoding) == 0) continue;
      for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
        if (format::maskBit(named.brick.active, i)) continue;
        ASSERT_EQ(format::decodeIndex(candidate.encoding, candidate.payload, i), 0u) << named.name << encoder.name;
      }
    }
  }
}

TEST(Encode, cellsWithoutActiveVoxelsAreZero) {
  const Brick brick =
      makeBrick([](auto x, auto...) { return 1.0f + static_cast<float>(x); }, [](std::uint32_t i) { return i >= 256; });
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    Candidate candidate;
    compiler::encodeLocal(sourceOf(brick), bits, candidate);
    for (std::size_t b = 0; b < 16; ++b) EXPECT_EQ(candidate.payload[b], std::byte{0}) << bits;
    for (std::size_t b = 16; b < 32; b += 2) EXPECT_GT(candidate.payload[b + 1], std::byte{0}) << bits;
  }
}

TEST(Encode, shortenedNumbersStayInTheirTolerance) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const double value = static_cast<double>(tests::randomValue(41, i) - 0.5f) * std::exp2(tests::hash(i, 1, 2) % 40);
    for (const double part : {0.0, 1e-6, 1e-3}) {
      const float shortened = compiler::shorten(value, part * std::abs(value));
      EXPECT_LE(std::abs(static_cast<double>(shortened) - value), part * std::abs(value));
      const std::uint32_t low = part > 0.5e-3 ? 0x7ff : 0;
      EXPECT_EQ(std::bit_cast<std::uint32_t>(shortened) & low, 0u) << value;
    }
  }
}

TEST(Encode, aRangeBeyondSinglePrecisionStaysFinite) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  const Brick brick = makeBrick([](auto x, auto...) { return x < 4 ? -kLargest : kLargest; });
  for (const Encoder& encoder : allEncoders()) {
    SCOPED_TRACE(encoder.name);
    Candidate candidate;
    encoder.encode(sourceOf(brick), candidate);
    checkPromise(brick, candidate);
  }
}

TEST(Encode, rangeCoversItsEnds) {
  const float ends[] = {0.0f, 1e-45f, 1e-41f, 3e-39f, 1e-8f, 0.1f, 1.0f, 255.0f, 1e6f, 1e37f, 3e38f};
  for (const float low : ends) {
    for (const float high : ends) {
      if (!(low < high)) continue;
      for (const std::uint32_t last : {255u, 65535u}) {
        const compiler::TexelRange range = compiler::coverRange({low, high}, 0, last);
        EXPECT_EQ(range.lo, low);
        const float top = format::reconstruct(range.lo, range.scale, last);
        EXPECT_TRUE(std::isfinite(top));
        EXPECT_NEAR(std::max(top, high), top, static_cast<double>(high) * 1.2e-7) << low << ' ' << high;
      }
    }
  }
}

TEST(Encode, oneValueIsExactInEveryEncoding) {
  for (const NamedBrick& named : corpus()) {
    if (named.name != "zero" && named.name != "constant" && named.name != "constant, half active" &&
        named.name != "one active voxel") {
      continue;
    }
    for (const Encoder& encoder : allEncoders()) {
      SCOPED_TRACE(named.name + " as " + encoder.name);
      Candidate candidate;
      encoder.encode(sourceOf(named.brick), candidate);
      EXPECT_EQ(candidate.squaredError, 0.0);
      EXPECT_EQ(candidate.maxError, 0.0f);
    }
  }
}

TEST(Encode, twoValuesInSlabsAreNearlyExact) {
  const Brick brick = makeBrick([](std::uint32_t x, auto...) { return x < 4 ? 0.0f : 255.0f; });
  for (const Encoder& encoder : allEncoders()) {
    if (encoder.name == "constant" || encoder.name == "coarse") continue;
    SCOPED_TRACE(encoder.name);
    Candidate candidate;
    encoder.encode(sourceOf(brick), candidate);
    // A local brick's range is rounded to a tenth of a step of its cells' ends.
    const bool local = format::isLocal(candidate.encoding);
    EXPECT_LE(candidate.maxError, local ? 0.1f : 255.0f * std::numeric_limits<float>::epsilon());
  }
}

TEST(Encode, constantIsTheMean) {
  const Brick brick = makeBrick([](std::uint32_t x, auto...) { return static_cast<float>(x); });
  Candidate candidate;
  compiler::encodeConstant(sourceOf(brick), candidate);
  EXPECT_EQ(candidate.lo, 3.5f);
  EXPECT_EQ(candidate.maxError, 3.5f);
  EXPECT_DOUBLE_EQ(candidate.squaredError, 512 * 5.25);  // (8 * 8 - 1) / 12 a voxel
}

TEST(Encode, bestAxisIsOneOfTheThree) {
  for (const NamedBrick& named : corpus()) {
    SCOPED_TRACE(named.name);
    Candidate best, same;
    compiler::encodeBc7BestAxis(sourceOf(named.brick), 1, best);
    compiler::encodeBc7(sourceOf(named.brick), best.encoding, 1, same);
    EXPECT_EQ(std::memcmp(best.payload.data(), same.payload.data(), 128), 0);
    EXPECT_EQ(best.squaredError, same.squaredError);
  }
}

TEST(Encode, bestAxisFollowsTheLayers) {
  // Independent noise in each layer along one axis. Packing that axis costs nothing: each channel is one layer,
  // constant.
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const Brick brick = makeBrick([=](auto... at) {
      const std::uint32_t coordinate[] = {at...};
      return tests::randomValue(axis, coordinate[axis]);
    });
    Candidate candidate;
    compiler::encodeBc7BestAxis(sourceOf(brick), 0, candidate);
    EXPECT_EQ(format::packedAxis(candidate.encoding), axis);
  }
}

// 64-bit FNV-1a over everything that reaches a pack, for a fixed set of bricks. gcc, clang, debug, release and any CPU
// must agree on it; it changes only when an encoder is changed on purpose.
TEST(Encode, everyBuildWritesTheSameBytes) {
  std::vector<Brick> bricks = tests::cloudBricks(48);
  for (const NamedBrick& named : corpus()) bricks.push_back(named.brick);
  std::uint64_t digest = 0xcbf29ce484222325u;
  const auto add = [&](const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) digest = (digest ^ bytes[i]) * 0x100000001b3u;
  };
  Candidate candidate;
  for (const Brick& brick : bricks) {
    for (const Encoder& encoder : allEncoders()) {
      encoder.encode(sourceOf(brick), candidate);
      add(&candidate.encoding, sizeof candidate.encoding);
      add(&candidate.lo, sizeof candidate.lo);
      add(&candidate.scale, sizeof candidate.scale);
      add(&candidate.squaredError, sizeof candidate.squaredError);
      add(&candidate.maxError, sizeof candidate.maxError);
      add(candidate.payload.data(), *format::brickBytes(candidate.encoding));
    }
  }
  EXPECT_EQ(digest, 8147546655655242145u);
}

}  // namespace
