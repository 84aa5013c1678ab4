// Sources that fail to be read, and packs that ask for more than a reader gives.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

// Bytes, then zeros up to a size of its own; reads that touch [failFrom, failTo) fail.
class OddSource : public ByteSource {
 public:
  OddSource(std::vector<std::byte> bytes, std::uint64_t size, std::uint64_t failFrom, std::uint64_t failTo)
      : bytes_(std::move(bytes)), size_(size), failFrom_(failFrom), failTo_(failTo) {}
  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    if (offset < failTo_ && offset + into.size() > failFrom_) return false;
    for (std::size_t i = 0; i < into.size(); ++i)
      into[i] = offset + i < bytes_.size() ? bytes_[offset + i] : std::byte{0};
    return true;
  }

 private:
  std::vector<std::byte> bytes_;
  std::uint64_t size_, failFrom_, failTo_;
};

TEST(Sources, FailedReadsAreReportedAsSuch) {
  const std::uint64_t size = sample().size();
  for (std::uint64_t at = 0; at < size; at += 16) {
    const OddSource source(sample(), size, at, at + 1);
    bool reported = false;
    validate(source, {}, [&](const Issue& issue) { reported = reported || issue.kind->id == 2; });
    EXPECT_TRUE(reported) << at;
    const Result<Pack> pack = Pack::open(std::make_unique<OddSource>(sample(), size, at, at + 1));
    EXPECT_EQ(pack ? 2 : pack.error().kind->id, 2) << at;
  }
}

TEST(Limits, HugeTablesAreRefusedBeforeTheyAreRead) {
  std::vector<std::byte> bytes = PackImage::of(smallestPack()).assemble();
  constexpr std::size_t kPageTable = 7;
  const std::uint64_t size = bytes.size() + sizeof(PageRecord) * 20'000'000;
  editEntry(bytes, kPageTable, [&](SectionEntry& e) { e.size = size - e.offset; });
  editHeader(bytes, [&](FileHeader& h) { h.fileSize = size; });
  const Result<Pack> pack = Pack::open(std::make_unique<OddSource>(bytes, size, bytes.size(), size));
  ASSERT_FALSE(pack);
  EXPECT_EQ(pack.error().kind->id, 4);
}

// A page of zeros takes few bytes: many of them would fill the memory if a grid frame could have them all at once.
TEST(Limits, EndlessPagesAreRefused) {
  const std::vector<std::uint32_t> zeros(kMaxPageBytes / 4);
  const std::vector<std::byte> bytes = writePack({}, [&](PackWriter& writer) {
    PackTables tables = sampleTables("bomb", {"density"}, 1);
    const auto node5 = std::make_unique<Node5>();
    GridFrame frame = absentGridFrame();
    frame.flags = kGridPresent;
    frame.node5 = writer.append(Stream::node5, node5.get(), 1);
    writer.append(Stream::child, zeros.data(), kMaxPageBytes / 4);
    tables.pageLists = {0, 1};
    frame.pageListCount = 2;
    tables.gridFrames.push_back(frame);
    return tables;
  });
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{305});
  PackImage image = PackImage::of(bytes);
  const auto pages = getAt<SectionEntry>(bytes, sizeof(FileHeader));
  std::vector<PageRecord> records;
  std::vector<std::byte> content;
  const Pack pack = *Pack::open(makeMemorySource(bytes));
  for (std::uint32_t i = 0; i < 4100; ++i) {
    PageRecord record = pack.pages()[std::min(i, 1u)];
    const auto stored = std::span(bytes).subspan(pages.offset + record.offset, record.storedSize);
    record.offset = content.size();
    if (i > 0) record.streams[5].first = (i - 1) * (kMaxPageBytes / 4);
    content.insert(content.end(), stored.begin(), stored.end());
    records.push_back(record);
    if (i > 1) image.pageLists.push_back(i);
  }
  image.gridFrames[0].pageListCount = 4100;
  const std::vector<std::byte> bomb = image.assemble(content, records);
  EXPECT_LT(bomb.size(), 2 * kMaxPageBytes);  // for more than 4 GiB
  EXPECT_EQ(loaderStop(bomb), 5);
  EXPECT_EQ(idsOf(bomb), std::multiset<int>{5});
}

// Shared nodes make few bytes stand for many bricks: sound, but more than a view lays out.
TEST(Limits, TooManyBricksAreRefusedByTheViewAlone) {
  const std::vector<std::byte> bytes = writePack({}, [](PackWriter& writer) {
    PackTables tables = sampleTables("dense", {"density"}, 1);
    Node3 brick{};
    brick.mask = kMaskAll;
    brick.lo = brick.mean = 1;
    brick.brick = writer.append(Stream::node3, &brick, 1);
    const std::vector<std::uint32_t> children(32768, 0);
    Node4 node4{};
    node4.childBegin = writer.append(Stream::child, children.data(), 4096);
    node4.min = node4.max = node4.mean = 1;
    std::fill(std::begin(node4.mask), std::end(node4.mask), ~0u);
    writer.append(Stream::node4, &node4, 1);
    const auto node5 = std::make_unique<Node5>();
    node5->childBegin = writer.append(Stream::child, children.data(), 32768);
    node5->min = node5->max = node5->mean = 1;
    std::fill(std::begin(node5->mask), std::end(node5->mask), ~0u);
    GridFrame frame = absentGridFrame();
    frame.flags = kGridPresent;
    frame.node5 = writer.append(Stream::node5, node5.get(), 1);
    for (int axis = 0; axis < 3; ++axis) frame.activeMax[axis] = 4095;
    frame.activeVoxels = std::uint64_t{1} << 36;
    frame.node4Count = frame.node3Count = 1;
    frame.childCount = 4096 + 32768;
    frame.valueMax = 1;
    for (std::uint32_t p = 0; p <= writer.pageOf(Stream::node5, 0); ++p) tables.pageLists.push_back(p);
    frame.pageListCount = static_cast<std::uint32_t>(tables.pageLists.size());
    tables.gridFrames.push_back(frame);
    return tables;
  });
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{});
  EXPECT_EQ(loaderStop(bytes), 3);
}

}  // namespace
}  // namespace billow
