// The codec `model`: lossless for every page, safe for every input, and worth its time on what packs hold.
#include "billow/format/page_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <sstream>

#include "../../format/src/page_coder/models.h"
#include "../../format/src/page_coder/voxel_table.h"
#include "billow/format/pack.h"
#include "page_builder.h"
#include "sample_pack.h"
#include "spec_document.h"

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

TEST(PageCodecSpec, TableIsThatOfTheCode) {
  std::istringstream text(tests::readSpec("pagecodec.md"));
  std::vector<std::uint32_t> numbers;
  std::string line;
  bool inside = false;
  while (std::getline(text, line)) {
    if (line.starts_with("| edge | level |")) inside = true;
    if (line.empty()) inside = false;
    if (!inside || line.find_first_of("0123456789") == std::string::npos) continue;
    std::replace(line.begin(), line.end(), '|', ' ');
    std::istringstream row(line);
    std::uint32_t edge = 0, level = 0, size = 0;
    if (!(row >> edge >> level)) continue;
    EXPECT_EQ(edge * 13 + level, numbers.size() / kSymbols);
    while (row >> size) numbers.push_back(size);
  }
  ASSERT_EQ(numbers.size(), std::size_t{8 * 13 * 16});
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    EXPECT_EQ(numbers[i], kVoxelTable[i / 208][i / 16 % 13][i % 16]) << i;
  }
  for (std::size_t row = 0; row < numbers.size(); row += 16) {
    EXPECT_EQ(std::accumulate(numbers.begin() + static_cast<std::ptrdiff_t>(row),
                              numbers.begin() + static_cast<std::ptrdiff_t>(row + 16), 0u),
              256u);
  }
}

}  // namespace
}  // namespace billow
