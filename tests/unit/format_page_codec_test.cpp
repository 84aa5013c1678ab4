// The codec `model`: lossless for every page, safe for every input, and worth its time on what packs hold.
#include "billow/format/page_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>

#include "../../format/src/page_coder/token_tables.h"
#include "../../format/src/page_compressor.h"
#include "billow/format/pack.h"
#include "page_builder.h"
#include "sample_pack.h"

namespace billow {
namespace {

using namespace format;
using tests::PageBuilder;

std::vector<std::byte> roundTrip(const PageBuilder::Page& page) {
  const std::vector<std::byte> stored = encodePage(page.runs, page.bytes);
  std::vector<std::byte> back(page.bytes.size(), std::byte{0xa5});
  EXPECT_TRUE(decodePage(page.runs, stored, back));
  EXPECT_TRUE(back == page.bytes);
  return stored;
}

TEST(PageCodec, EmptyRuns) {
  EXPECT_EQ(roundTrip(PageBuilder(1).page()).size(), 8u);
}

TEST(PageCodec, EveryEncodingUnderEveryMask) {
  for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
    for (const std::uint32_t mask : {kMaskAll, kMaskTexel, 0u}) {
      PageBuilder builder(encoding * 3 + (mask & 3));
      for (int i = 0; i < 24; ++i) builder.brick(encoding, mask);
      SCOPED_TRACE(encoding);
      const PageBuilder::Page page = builder.page();
      roundTrip(page);
    }
  }
}

TEST(PageCodec, BricksThatHideNothing) {
  // Inactive voxels with an index, cells without voxels but with ends: not as the compiler writes, but allowed.
  for (std::uint32_t encoding = kEncodingUniform1; encoding < kEncodingCoarse; ++encoding) {
    PageBuilder builder(encoding);
    for (int i = 0; i < 4; ++i) builder.brick(encoding, 0, true);
    for (int i = 0; i < 4; ++i) builder.brick(encoding, 0);
    roundTrip(builder.page());
  }
}

TEST(PageCodec, NodesThatLie) {
  tests::Random random(5);
  for (int round = 0; round < 40; ++round) {
    PageBuilder builder(static_cast<std::uint32_t>(round));
    for (int i = 0; i < 12; ++i) builder.brick(random() % kEncodingCount, random() % 2 ? kMaskTexel : 0);
    PageBuilder::Page page = builder.page();
    for (int i = 0; i < 6; ++i) {  // bricks that overlap, leave the page or have no known encoding, masks elsewhere
      Node3 node = page.node3(random() % 12);
      node.brick = random();
      if (i % 2 == 0) node.brick &= ~0x07ffff00u;
      if (i % 3 == 0) node.mask = random();
      page.setNode3(random() % 12, node);
    }
    roundTrip(page);
  }
}

TEST(PageCodec, AnyBytes) {
  tests::Random random(7);
  for (int round = 0; round < 60; ++round) {
    PageBuilder::Page page;
    for (StreamRange& run : page.runs) run = {random(), random() % 12};
    page.runs[2].count %= 2;
    std::uint64_t size = 0;
    for (std::size_t i = 0; i < kStreamCount; ++i) size += page.runs[i].count * kStreamItemBytes[i];
    page.bytes = tests::randomBytes(size, static_cast<std::uint32_t>(round));
    if (round % 3 == 0) std::fill_n(page.bytes.begin(), size / 2, std::byte{static_cast<unsigned char>(round)});
    roundTrip(page);
  }
}

TEST(PageCodec, LargestPage) {
  PageBuilder::Page page;
  page.runs[0] = {0, kMaxPageBytes / kBrickUnitBytes};
  page.bytes = tests::randomBytes(kMaxPageBytes, 3);
  const std::vector<std::byte> stored = roundTrip(page);
  EXPECT_LT(stored.size(), page.bytes.size() * 33 / 32);
}

TEST(PageCodec, SizesMustAgree) {
  PageBuilder builder(2);
  builder.brick(kEncodingUniform8, kMaskAll);
  PageBuilder::Page page = builder.page();
  const std::vector<std::byte> stored = encodePage(page.runs, page.bytes);
  page.bytes.pop_back();
  EXPECT_THROW(encodePage(page.runs, page.bytes), std::invalid_argument);
  EXPECT_FALSE(decodePage(page.runs, stored, page.bytes));
}

PageBuilder::Page mixedPage(std::uint32_t seed) {
  PageBuilder builder(seed);
  tests::Random random(seed);
  for (int i = 0; i < 60; ++i) builder.brick(random() % kEncodingCount, random() % 3 == 0 ? kMaskAll : kMaskTexel);
  builder.upperNodes();
  return builder.page();
}

TEST(PageCodec, TruncatedAndLengthened) {
  const PageBuilder::Page page = mixedPage(11);
  std::vector<std::byte> stored = encodePage(page.runs, page.bytes);
  std::vector<std::byte> back(page.bytes.size());
  for (std::size_t size = 0; size < stored.size(); size += 1 + size / 16) {
    EXPECT_FALSE(decodePage(page.runs, std::span(stored).first(size), back)) << size;
  }
  EXPECT_FALSE(decodePage(page.runs, std::span(stored).first(stored.size() - 1), back));
  for (int i = 0; i < 3; ++i) {
    stored.push_back(std::byte{0});
    EXPECT_FALSE(decodePage(page.runs, stored, back)) << i;
  }
}

TEST(PageCodec, AlteredBytesGiveAnotherPage) {
  const PageBuilder::Page page = mixedPage(12);
  const std::vector<std::byte> stored = encodePage(page.runs, page.bytes);
  tests::Random random(1);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::byte> altered = stored;
    altered[random() % altered.size()] ^= static_cast<std::byte>(1u << random() % 8);
    std::vector<std::byte> back(page.bytes.size());
    decodePage(page.runs, altered, back);  // may say yes: a bit without a model changes nothing else
    EXPECT_FALSE(back == page.bytes);
  }
}

TEST(PageCodec, SmoothBricksShrink) {
  // A third of their bits is noise, so zstd finds little.
  for (const std::uint32_t encoding : {uniformEncoding(4), uniformEncoding(6), uniformEncoding(8)}) {
    PageBuilder builder(encoding);
    for (int i = 0; i < 200; ++i) builder.brick(encoding, i % 2 ? kMaskTexel : kMaskAll);
    const PageBuilder::Page page = builder.page();
    EXPECT_LT(static_cast<double>(roundTrip(page).size()), 0.62 * static_cast<double>(page.bytes.size())) << encoding;
  }
}

TEST(PageCodec, WriterTakesTheSmallerAndTheBytesDependOnNothingElse) {
  PackWriter::Options options;
  options.pageBytes = 3000;
  const std::vector<std::byte> small = tests::samplePack(options);
  options.threads = 3;
  EXPECT_EQ(tests::samplePack(options), small);
  options.compression = Compression::fast;
  const std::vector<std::byte> fast = tests::samplePack(options);
  EXPECT_LT(small.size(), fast.size());
  const Pack a = *Pack::open(makeMemorySource(small));
  const Pack b = *Pack::open(makeMemorySource(fast));
  ASSERT_EQ(a.pages().size(), b.pages().size());
  bool modelled = false;
  for (std::uint32_t i = 0; i < a.pages().size(); ++i) {
    EXPECT_LE(a.pages()[i].storedSize, b.pages()[i].storedSize);
    EXPECT_NE(b.pages()[i].codec, static_cast<std::uint32_t>(Codec::model));
    modelled |= a.pages()[i].codec == static_cast<std::uint32_t>(Codec::model);
    EXPECT_EQ(a.readPage(i)->raw, b.readPage(i)->raw);
  }
  EXPECT_TRUE(modelled);
}

TEST(PageCodec, RepeatedContentGoesToZstdHoweverWellTheModelDoes) {
  PageBuilder builder(9);
  for (int i = 0; i < 100; ++i) builder.brick(kEncodingUniform16, kMaskAll);
  PageBuilder::Page page = builder.page();
  constexpr std::ptrdiff_t kPeriod = 9 * 1024;
  for (auto at = page.bytes.begin(); at + 2 * kPeriod <= page.bytes.begin() + 100 * 1024; at += kPeriod)
    std::copy_n(at, kPeriod, at + kPeriod);
  for (std::size_t high = 1; high < 100 * 1024; high += 2) page.bytes[high] = std::byte{7};
  const std::size_t modelled = roundTrip(page).size();
  ASSERT_LT(modelled, page.bytes.size() * 5 / 8);
  PageCompressor compressor(Compression::small, 1);
  compressor.submit(page.bytes, page.runs);
  const CompressedPage stored = compressor.take();
  EXPECT_EQ(stored.codec, Codec::zstd);
  EXPECT_LT(stored.stored.size(), modelled);
}

// ---- The models by themselves

using namespace format::page_coder;

// As spec/pagecodec.md says it, a number at a time.
void adaptPlainly(std::array<int, kSymbols>& below, std::uint32_t symbol, std::uint32_t seen) {
  const int rate = 4 + (seen >= 8) + (seen >= 32) + (seen >= 128);
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    const int target = static_cast<int>(i <= symbol ? i : 32768 - 16 + i);
    below[i] += static_cast<int>(std::floor(static_cast<double>(target - below[i]) / (1 << rate)));
  }
}

TEST(PageCodecModels, SymbolsAdaptAsTheStandardSays) {
  tests::Random random(3);
  for (int run = 0; run < 20; ++run) {
    SymbolModel model = evenModel();
    std::array<int, kSymbols> plain;
    for (std::uint32_t i = 0; i < kSymbols; ++i) plain[i] = static_cast<int>(2048 * i);
    for (std::uint32_t seen = 0; seen < 4000; ++seen) {
      const std::uint32_t symbol = run % 4 == 0 ? static_cast<std::uint32_t>(run % 16) : random() % (1 + random() % 16);
      adaptPlainly(plain, symbol, seen);
      adapt(model, symbol);
      for (std::uint32_t i = 0; i < kSymbols; ++i) ASSERT_EQ(model.below[i], plain[i]);
      const std::uint32_t number = random() % kScale;
      const auto after = std::upper_bound(plain.begin(), plain.end(), static_cast<int>(number));
      ASSERT_EQ(find(model, number), static_cast<std::uint32_t>(after - plain.begin() - 1));
      for (std::uint32_t i = 0; i < kSymbols; ++i) ASSERT_GE(sizeOf(model, i), 1u);
    }
  }
}

TEST(PageCodecModels, BitsStayPossible) {
  for (const bool bit : {false, true}) {
    BitModel model = bitModel(kScale / 2);
    for (int i = 0; i < 1000; ++i) adapt(model, bit);
    EXPECT_GE(model.one, 32);
    EXPECT_LE(model.one, kScale - 32);
  }
}

// start[t] of spec/pagecodec.md, "Tables", for classes that give every token its own part of 1024.
TEST(PageCodecModels, TablesComeBackAndCoverAllNumbers) {
  tests::Random random(9);
  const auto counts = std::make_unique<TokenCounts>();
  for (std::uint32_t context = 0; context < kTokenContexts; ++context) {
    const std::uint32_t tokens = random() % (kTokens + 1);
    for (std::uint32_t i = 0; i < tokens; ++i) (*counts)[context * kTokens + i] = random() % (1u << random() % 20);
  }
  const auto written = std::make_unique<TokenTables>();
  const auto read = std::make_unique<TokenTables>();
  Encoder encoder;
  written->code(encoder, *counts);
  const std::vector<std::byte> stored = encoder.finish();
  const PaddedBytes padded(stored);
  Decoder decoder(padded);
  read->code(decoder, {});
  EXPECT_TRUE(decoder.sound());
  for (std::uint32_t context = 0; context < kTokenContexts; ++context) {
    std::uint32_t next = 0;
    for (std::uint32_t kind = context * kTokens; kind < (context + 1) * kTokens; ++kind) {
      const auto [start, size] = read->intervals()[kind];
      EXPECT_EQ(start, written->intervals()[kind].start);
      ASSERT_EQ(start, next);
      next = start + size;
      if ((*counts)[kind] > 0) {
        EXPECT_GE(size, 32);
      }
      for (std::uint32_t number = start; number < next; number += TokenTables::kSlotSize) {
        const std::uint32_t slot = number / TokenTables::kSlotSize;
        ASSERT_EQ(read->slots()[context * TokenTables::kSlots + slot], kind % kTokens);
      }
    }
    EXPECT_EQ(next, kScale);
  }
}

TEST(PageCodecModels, BitsWithoutAModelComeFromTheEnd) {
  Encoder encoder;
  encoder.bits(3, 5);
  encoder.bits(32, 0x80000001u);
  encoder.bits(1, 1);
  const std::vector<std::byte> stored = encoder.finish();
  ASSERT_EQ(stored.size(), std::size_t{8 + 5});
  EXPECT_EQ(stored.back(), std::byte{0xb0});  // 101 1 0000 ...
  EXPECT_EQ(stored[8], std::byte{0x30});      // ... 0011 and four that are left
  const PaddedBytes padded(stored);
  Decoder decoder(padded);
  EXPECT_EQ(decoder.bits(3, 0), 5u);
  EXPECT_FALSE(decoder.sound());
  EXPECT_EQ(decoder.bits(32, 0), 0x80000001u);
  EXPECT_EQ(decoder.bits(1, 0), 1u);
  EXPECT_TRUE(decoder.sound());
}

}  // namespace
}  // namespace billow
