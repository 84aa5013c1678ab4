// spec/bc7.md against the code: its tables and example blocks are generated from the decoder that reads packs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "billow/format/bc7_tables.h"
#include "billow/format/brick.h"
#include "spec_document.h"

namespace billow {
namespace {

using namespace format;
using tests::expectDocumentPart;

constexpr char kDocument[] = "bc7.md";
constexpr std::uint32_t kReservedMode = 8;

std::string modesText() {
  std::string text =
      "| mode | subsets | partition | rotation | selection | colour | alpha | P-bits | index | second index |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n";
  for (std::uint32_t m = 0; m < 8; ++m) {
    const Bc7Mode& mode = kBc7Modes[m];
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", m, mode.subsets, mode.partitionBits,
                        mode.rotationBits, mode.selectorBits, mode.colorBits, mode.alphaBits,
                        mode.endpointPBits != 0 ? "an end" : (mode.subsetPBits != 0 ? "a subset" : "none"),
                        mode.indexBits, mode.indexBits2);
  }
  return text;
}

std::string weightsText() {
  std::string text = "| index bits | weight of index 0, 1, 2, … |\n|---|---|\n";
  for (std::uint32_t bits = 2; bits <= 4; ++bits) {
    text += fmt::format("| {} |", bits);
    for (std::uint32_t i = 0; i < 1u << bits; ++i) text += fmt::format(" {}", bc7Weights(bits)[i]);
    text += " |\n";
  }
  return text;
}

std::string partitions2Text() {
  std::string text = "```\n";
  for (std::uint32_t p = 0; p < 64; ++p) {
    if (p % 8 == 0) text += fmt::format("{:2}:", p);
    text += fmt::format(" {:04x}/{:x}{}", kBc7Partitions2[p], bc7Anchor(kBc7Anchors2, p), p % 8 == 7 ? "\n" : "");
  }
  return text + "```\n";
}

std::string partitions3Text() {
  std::string text = "```\n";
  for (std::uint32_t p = 0; p < 64; ++p) {
    if (p % 4 == 0) text += fmt::format("{:2}:", p);
    text += fmt::format(" {:08x}/{:x}{:x}{}", kBc7Partitions3[p], bc7Anchor(kBc7Anchors3Second, p),
                        bc7Anchor(kBc7Anchors3Third, p), p % 4 == 3 ? "\n" : "");
  }
  return text + "```\n";
}

using Block = std::array<std::byte, 16>;

// A block of the mode, its other bits from a sequence of SplitMix64.
Block exampleBlock(std::uint32_t mode, std::uint64_t seed) {
  Block block{};
  for (std::size_t i = 0; i < block.size(); ++i) {
    seed += 0x9e3779b97f4a7c15u;
    std::uint64_t z = seed;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    block[i] = static_cast<std::byte>((z ^ z >> 31) & 0xff);
  }
  const std::uint32_t kept = mode == kReservedMode ? 0 : 0xffu << (mode + 1) & 0xffu;
  const std::uint32_t unary = 1u << mode & 0xffu;
  block[0] = static_cast<std::byte>((std::to_integer<std::uint32_t>(block[0]) & kept) | unary);
  return block;
}

// The fields before the ends, in words.
std::string leadingFields(const Block& block, std::uint32_t number) {
  if (number == kReservedMode) return "";
  const Bc7Mode& mode = kBc7Modes[number];
  std::uint32_t bits = std::to_integer<std::uint32_t>(block[0]) | std::to_integer<std::uint32_t>(block[1]) << 8;
  bits >>= number + 1;
  std::string text;
  const auto field = [&](std::string_view name, std::uint32_t count) {
    if (count == 0) return;
    text += fmt::format(", {} {}", name, bits & ((1u << count) - 1));
    bits >>= count;
  };
  field("partition", mode.partitionBits);
  field("rotation", mode.rotationBits);
  field("selection", mode.selectorBits);
  return text;
}

std::string exampleText(std::uint32_t mode, std::uint64_t seed) {
  const Block block = exampleBlock(mode, seed);
  std::string text = mode == kReservedMode ? "reserved" : fmt::format("mode {}", mode);
  text += leadingFields(block, mode) + "\n";
  for (const std::byte byte : block) text += fmt::format("{:02x}", std::to_integer<unsigned>(byte));
  std::uint8_t rgba[16][4];
  decodeBc7Block(block.data(), rgba);
  for (std::uint32_t i = 0; i < 16; ++i) {
    text += i % 4 == 0 ? "\n   " : "";
    text += fmt::format(" {:02x}{:02x}{:02x}{:02x}", rgba[i][0], rgba[i][1], rgba[i][2], rgba[i][3]);
  }
  return text + "\n";
}

std::string examplesText() {
  // Several of the modes whose fields change most of the decoding.
  static constexpr std::array<std::array<std::uint32_t, 2>, 13> kExamples = {
      {{0, 13}, {1, 1}, {2, 1}, {3, 1}, {4, 2}, {4, 5}, {4, 6}, {4, 9}, {5, 2}, {5, 3}, {6, 1}, {7, 1}, {8, 1}}};
  std::string text = "```\n";
  for (const auto& [mode, seed] : kExamples) text += exampleText(mode, std::uint64_t{mode} << 8 | seed);
  return text + "```\n";
}

TEST(Bc7Spec, TablesAreThoseOfTheCode) {
  expectDocumentPart(kDocument, "modes", modesText());
  expectDocumentPart(kDocument, "weights", weightsText());
  expectDocumentPart(kDocument, "two subsets", partitions2Text());
  expectDocumentPart(kDocument, "three subsets", partitions3Text());
}

TEST(Bc7Spec, ExamplesAreWhatTheDecoderGives) {
  expectDocumentPart(kDocument, "examples", examplesText());
}

// The document says that every mode fills the block.
TEST(Bc7Spec, FieldsOfEveryModeAddUpTo128Bits) {
  for (std::uint32_t m = 0; m < 8; ++m) {
    const Bc7Mode& mode = kBc7Modes[m];
    const std::uint32_t ends = 2u * mode.subsets;
    std::uint32_t bits = m + 1 + mode.partitionBits + mode.rotationBits + mode.selectorBits;
    bits += ends * (3u * mode.colorBits + mode.alphaBits);
    bits += mode.endpointPBits * ends + mode.subsetPBits * mode.subsets;
    bits += 16u * mode.indexBits - mode.subsets;
    if (mode.indexBits2 != 0) bits += 16u * mode.indexBits2 - mode.subsets;
    EXPECT_EQ(bits, 128u) << "mode " << m;
  }
}

// The document says that texel 0 is in subset 0, and that an anchor is a texel of its subset.
TEST(Bc7Spec, AnchorsLieInTheirSubsets) {
  for (std::uint32_t p = 0; p < 64; ++p) {
    const auto subset3 = [&](std::uint32_t texel) { return kBc7Partitions3[p] >> (2 * texel) & 3u; };
    EXPECT_EQ(kBc7Partitions2[p] & 1u, 0u) << p;
    EXPECT_EQ(kBc7Partitions2[p] >> bc7Anchor(kBc7Anchors2, p) & 1u, 1u) << p;
    EXPECT_EQ(subset3(0), 0u) << p;
    EXPECT_EQ(subset3(bc7Anchor(kBc7Anchors3Second, p)), 1u) << p;
    EXPECT_EQ(subset3(bc7Anchor(kBc7Anchors3Third, p)), 2u) << p;
  }
}

}  // namespace
}  // namespace billow
