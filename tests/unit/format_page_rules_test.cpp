// The rules of the page table, of stored pages, and of the lists that name them.
#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

void expectPageIssue(int id, const std::function<void(std::vector<std::byte>&, std::vector<PageRecord>&)>& change,
                     bool opens = false) {
  PackWriter::Options options;
  options.pageBytes = 2000;
  PackImage image = PackImage::of(samplePack(options));
  std::vector<std::byte> content;
  std::vector<PageRecord> records = image.pageRecords;
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].offset = content.size();
    records[i].storedSize = records[i].rawSize = static_cast<std::uint32_t>(image.pages[i].size());
    records[i].codec = 0;
    records[i].checksum = checksum(image.pages[i]);
    records[i].rawChecksum = static_cast<std::uint32_t>(records[i].checksum);
    content.insert(content.end(), image.pages[i].begin(), image.pages[i].end());
  }
  change(content, records);
  const std::vector<std::byte> bytes = image.assemble(content, records);
  std::string all;
  for (const Issue& issue : issuesOf(bytes)) all += toString(issue) + "\n";
  EXPECT_TRUE(idsOf(bytes).contains(id)) << id << "\n" << all;
  EXPECT_EQ(loaderStop(bytes) != 0, true) << all;
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  EXPECT_EQ(pack.has_value(), opens) << all;
}

TEST(PageRules, PageTable) {
  expectPageIssue(230, [](auto&, auto& r) { r[0].codec = 3; });
  expectPageIssue(231, [](auto&, auto& r) { r[0].rawSize += 4; });
  expectPageIssue(231, [](auto&, auto& r) { r[0].codec = 1; });
  expectPageIssue(231, [](auto&, auto& r) { r[0].codec = 2; });
  expectPageIssue(232, [](auto&, auto& r) { r[1].streams[0].first += 1; });
  expectPageIssue(233, [](auto& c, auto&) { c.push_back(std::byte{0}); });
  expectPageIssue(233, [](auto&, auto& r) { r.back().offset = ~std::uint64_t{0}; });
  expectPageIssue(
      301, [](auto&, auto& r) { r[0].checksum ^= 1; }, true);
  expectPageIssue(
      302, [](auto&, auto& r) { r[0].rawChecksum ^= 1; }, true);
}

TEST(PageRules, StreamLength) {
  expectPageIssue(234, [](auto&, auto& r) {
    r[0].streams[0].count += kBrickUnitMask;
    for (std::size_t i = 1; i < r.size(); ++i) r[i].streams[0].first += kBrickUnitMask;
  });
}

std::vector<std::byte> compressedSample(Compression compression) {
  PackWriter::Options options;
  options.compression = compression;
  return samplePack(options);
}

TEST(PageRules, BrokenCompression) {
  for (const Compression compression : {Compression::small, Compression::fast}) {
    std::vector<std::byte> bytes = compressedSample(compression);
    const auto pages = getAt<SectionEntry>(bytes, sizeof(FileHeader));
    bytes[pages.offset] ^= std::byte{0xff};  // the coder's state, or the zstd frame's magic
    sealAll(bytes);
    EXPECT_EQ(idsOf(bytes), std::multiset<int>{302});
    EXPECT_EQ(loaderStop(bytes), 302);
  }
}

// RFC 8878 has frames that a decoder passes over; a page is one frame that is not.
TEST(PageRules, OneZstdFrameAPage) {
  const std::vector<std::byte> bytes = compressedSample(Compression::fast);
  PackImage image = PackImage::of(bytes);
  const Pack pack = *Pack::open(makeMemorySource(bytes));
  std::vector<PageRecord> records(pack.pages().begin(), pack.pages().end());
  ASSERT_EQ(records.size(), 1u);
  ASSERT_EQ(records[0].codec, static_cast<std::uint32_t>(Codec::zstd));
  std::vector<std::byte> content(records[0].storedSize);
  ASSERT_TRUE(pack.source().read(getAt<SectionEntry>(bytes, sizeof(FileHeader)).offset, content));
  EXPECT_EQ(idsOf(image.assemble(content, records)), std::multiset<int>{});
  for (const unsigned byte : {0x50u, 0x2au, 0x4du, 0x18u, 0u, 0u, 0u, 0u}) content.push_back(std::byte(byte));
  records[0].storedSize += 8;
  ASSERT_LT(records[0].storedSize, records[0].rawSize);
  records[0].checksum = checksum(content);
  EXPECT_EQ(idsOf(image.assemble(content, records)), std::multiset<int>{302});
  EXPECT_EQ(loaderStop(image.assemble(content, records)), 302);
}

TEST(PageRules, PageLists) {
  PackWriter::Options options;
  options.pageBytes = 600;
  PackImage missing = PackImage::of(samplePack(options));
  missing.pageLists.erase(missing.pageLists.begin());
  --missing.gridFrames[0].pageListCount;
  for (std::size_t i = 2; i < 4; ++i) --missing.gridFrames[i].pageListBegin;
  EXPECT_TRUE(idsOf(missing.assemble()).contains(304));
  EXPECT_EQ(loaderStop(missing.assemble()), 304);

  PackImage superfluous = PackImage::of(samplePack(options));
  const auto last = static_cast<std::uint32_t>(superfluous.pages.size() - 1);
  GridFrame& frame = superfluous.gridFrames[0];
  superfluous.pageLists.insert(superfluous.pageLists.begin() + frame.pageListCount, last);
  ++frame.pageListCount;
  for (std::size_t i = 2; i < 4; ++i) ++superfluous.gridFrames[i].pageListBegin;
  EXPECT_EQ(idsOf(superfluous.assemble()), std::multiset<int>{305});
  EXPECT_EQ(loaderStop(superfluous.assemble()), 0);
}

TEST(PageRules, UnusedPagesAndItems) {
  PackImage image = PackImage::of(sample());
  image.gridFrames[3] = image.gridFrames[1];
  EXPECT_EQ(idsOf(image.assemble()), (std::multiset<int>{307, 307, 307, 307}));  // a unit, a Node5, a Node4, a Node3
  image.gridFrames[0] = image.gridFrames[2] = image.gridFrames[1];
  image.pageLists.clear();
  EXPECT_EQ(idsOf(image.assemble()), std::multiset<int>{306});
}

}  // namespace
}  // namespace billow
