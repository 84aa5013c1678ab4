// Every rule has a pack that breaks it and no other: what the validator reports, the loader stops at.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <set>

#include "billow/format/grid_view.h"
#include "billow/format/validate.h"
#include "pack_image.h"
#include "sample_pack.h"

namespace billow {
namespace {

using namespace format;
using tests::getAt;
using tests::PackImage;
using tests::putAt;

std::vector<Issue> issuesOf(std::vector<std::byte> bytes, unsigned threads = 1) {
  std::vector<Issue> issues;
  ValidateOptions options;
  options.threads = threads;
  validate(*makeMemorySource(std::move(bytes)), options, [&](const Issue& issue) { issues.push_back(issue); });
  return issues;
}

std::multiset<int> idsOf(const std::vector<std::byte>& bytes) {
  std::multiset<int> ids;
  for (const Issue& issue : issuesOf(bytes)) ids.insert(issue.kind->id);
  return ids;
}

bool hasError(const std::vector<std::byte>& bytes) {
  const std::vector<Issue> issues = issuesOf(bytes);
  return std::any_of(issues.begin(), issues.end(),
                     [](const Issue& issue) { return issue.kind->severity == Severity::error; });
}

const std::vector<std::byte>& sample() {
  static const std::vector<std::byte> bytes = tests::samplePack();
  return bytes;
}

// What opening the pack and loading all of it stops at; 0 when it doesn't.
int loaderStop(const std::vector<std::byte>& bytes) {
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  if (!pack) return pack.error().kind->id;
  for (const GridFrame& frame : pack->gridFrames()) {
    const Result<GridView> view = GridView::load(*pack, frame);
    if (!view) return view.error().kind->id;
  }
  return 0;
}

// The one issue that the change brings, found by validator and loader alike.
void expectIssue(int id, const std::function<void(PackImage&)>& change) {
  PackImage image = PackImage::of(sample());
  change(image);
  const std::vector<std::byte> bytes = image.assemble();
  std::string all;
  for (const Issue& issue : issuesOf(bytes)) all += toString(issue) + "\n";
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{id}) << all;
  const auto catalogue = issueCatalogue();
  const auto kind = std::find_if(catalogue.begin(), catalogue.end(), [&](const IssueKind& k) { return k.id == id; });
  ASSERT_NE(kind, catalogue.end());
  EXPECT_EQ(loaderStop(bytes), kind->severity == Severity::error ? id : 0) << all;
}

// The same for changes of the finished bytes.
void expectBytesIssue(int id, const std::function<void(std::vector<std::byte>&)>& change, bool opens = false) {
  std::vector<std::byte> bytes = sample();
  change(bytes);
  std::string all;
  for (const Issue& issue : issuesOf(bytes)) all += toString(issue) + "\n";
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{id}) << all;
  EXPECT_EQ(loaderStop(bytes), opens ? 0 : id) << all;
}

void editHeader(std::vector<std::byte>& bytes, const std::function<void(FileHeader&)>& edit) {
  auto header = getAt<FileHeader>(bytes, 0);
  edit(header);
  putAt(bytes, 0, header);
  tests::sealHeader(bytes);
}

void editEntry(std::vector<std::byte>& bytes, std::size_t entry, const std::function<void(SectionEntry&)>& edit) {
  const std::size_t at = sizeof(FileHeader) + entry * sizeof(SectionEntry);
  auto section = getAt<SectionEntry>(bytes, at);
  edit(section);
  putAt(bytes, at, section);
  tests::sealHeader(bytes);
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(Validate, AssembledSampleIsSound) {
  EXPECT_EQ(idsOf(PackImage::of(sample()).assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(sample()), 0);
}

// ---- Damage

TEST(Damage, EveryChangedByteIsFound) {
  std::vector<std::byte> bytes = sample();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::byte before = bytes[i];
    for (const int flip : {0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80, 0xff}) {
      bytes[i] = before ^ static_cast<std::byte>(flip);
      EXPECT_TRUE(hasError(bytes)) << "byte " << i << " xor " << flip;
      loaderStop(bytes);  // may or may not notice: padding is the validator's; it must not crash
    }
    bytes[i] = before;
  }
}

TEST(Damage, EveryTruncationIsFound) {
  for (std::size_t length = 0; length < sample().size(); ++length) {
    std::vector<std::byte> bytes(sample().begin(), sample().begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_TRUE(hasError(bytes)) << length;
    EXPECT_NE(loaderStop(bytes), 0) << length;
  }
}

TEST(Damage, AppendedBytesAreFound) {
  for (const std::size_t extra : {1u, 2u, 63u, 64u, 1000u}) {
    std::vector<std::byte> bytes = sample();
    bytes.resize(bytes.size() + extra);
    EXPECT_TRUE(hasError(bytes)) << extra;
    EXPECT_NE(loaderStop(bytes), 0) << extra;
  }
}

// ---- Header and contents

TEST(Rules, Header) {
  expectBytesIssue(101, [](auto& b) { b.resize(63); });
  expectBytesIssue(102, [](auto& b) { b[0] = std::byte{'x'}; });
  expectBytesIssue(103, [](auto& b) { b[60] ^= std::byte{1}; });
  expectBytesIssue(104, [](auto& b) { editHeader(b, [](FileHeader& h) { h.versionMajor = 2; }); });
  expectBytesIssue(
      105, [](auto& b) { editHeader(b, [](FileHeader& h) { h.versionMinor = 1; }); }, true);
  expectBytesIssue(106, [](auto& b) { editHeader(b, [](FileHeader& h) { ++h.fileSize; }); });
  expectBytesIssue(107, [](auto& b) { editHeader(b, [](FileHeader& h) { h.reserved[1] = 1; }); });
  expectBytesIssue(108, [](auto& b) { editHeader(b, [](FileHeader& h) { h.contentsOffset = 128; }); });
  expectBytesIssue(108, [](auto& b) { editHeader(b, [](FileHeader& h) { h.sectionCount = 65; }); });
  expectBytesIssue(109, [](auto& b) {
    auto header = getAt<FileHeader>(b, 0);
    header.contentsChecksum ^= 1;
    header.headerChecksum = tests::checksum(std::as_bytes(std::span(&header, 1)).first(56));
    putAt(b, 0, header);
  });
}

TEST(Rules, Contents) {
  constexpr std::size_t kInfo = 8, kStrings = 1;
  expectBytesIssue(110, [](auto& b) { editEntry(b, kStrings, [](SectionEntry& e) { e.flags = 0; }); });
  expectBytesIssue(110, [](auto& b) { editEntry(b, kInfo, [](SectionEntry& e) { e.flags = 2; }); });
  expectBytesIssue(116, [](auto& b) {
    editEntry(b, kInfo, [](SectionEntry& e) { e.type = fourcc('N', 'E', 'W', '!'), e.flags = kSectionRequired; });
  });
  expectBytesIssue(120, [](auto& b) { editEntry(b, kStrings, [](SectionEntry& e) { e.checksum ^= 1; }); });
  expectBytesIssue(
      120, [](auto& b) { editEntry(b, 0, [](SectionEntry& e) { e.checksum ^= 1; }); }, true);
  // An unknown optional section is passed over, but its bytes are still checked.
  std::vector<std::byte> optional = sample();
  editEntry(optional, kInfo, [](SectionEntry& e) { e.type = fourcc('N', 'E', 'W', '!'); });
  EXPECT_EQ(idsOf(optional), std::multiset<int>{});
  EXPECT_EQ(loaderStop(optional), 0);
  editEntry(optional, kInfo, [](SectionEntry& e) { e.checksum ^= 1; });
  EXPECT_EQ(idsOf(optional), std::multiset<int>{120});
}

TEST(Rules, SectionPlaces) {
  const auto found = [](std::size_t entry, const std::function<void(SectionEntry&)>& edit, int id) {
    std::vector<std::byte> bytes = sample();
    editEntry(bytes, entry, edit);
    EXPECT_EQ(idsOf(bytes).count(id), 1u) << id;
    EXPECT_NE(loaderStop(bytes), 0) << id;
  };
  found(
      8, [](SectionEntry& e) { e.offset += 4; }, 111);
  found(
      2, [](SectionEntry& e) { e.offset -= 64; }, 112);
  found(
      8, [](SectionEntry& e) { e.size += 1; }, 113);
  found(
      8, [](SectionEntry& e) { e.offset = ~std::uint64_t{63}; }, 113);
  found(
      8, [](SectionEntry& e) { e.type = kSectionStrings, e.flags = 1; }, 114);
  found(
      1, [](SectionEntry& e) { e.type = fourcc('N', 'E', 'W', '!'), e.flags = 0; }, 115);
  found(
      8, [](SectionEntry& e) { e.size -= 1; }, 119);
  found(
      4, [](SectionEntry& e) { e.size -= 1; }, 201);
}

TEST(Rules, Padding) {
  expectBytesIssue(
      117,
      [](auto& b) {
        const auto strings = getAt<SectionEntry>(b, sizeof(FileHeader) + sizeof(SectionEntry));
        b[strings.offset + strings.size] = std::byte{1};
      },
      true);
  std::vector<std::byte> bytes = tests::smallestPack();
  auto header = getAt<FileHeader>(bytes, 0);
  const auto tables = static_cast<std::ptrdiff_t>(getAt<SectionEntry>(bytes, 96).offset);
  bytes.insert(bytes.begin() + tables, 4096, std::byte{0});
  for (std::size_t i = 1; i < header.sectionCount; ++i) {
    editEntry(bytes, i, [](SectionEntry& e) { e.offset += 4096; });
  }
  editHeader(bytes, [&](FileHeader& h) { h.fileSize = bytes.size(); });
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{118});
}

// ---- Tables

TEST(Rules, Names) {
  expectIssue(202, [](PackImage& i) { i.strings += '\xff'; });
  expectIssue(202, [](PackImage& i) { i.strings += "\xed\xa0\x80"; });
  expectIssue(203, [](PackImage& i) { i.volumes[0].name.size = 1000; });
  expectIssue(203, [](PackImage& i) { i.grids[0].name.offset = 0xffffffffu; });
  expectIssue(203, [](PackImage& i) { i.strings += "\xc3\xa4", i.volumes[0].name = {StringRef{18, 1}}; });
  expectIssue(204, [](PackImage& i) { i.volumes[0].name.size = 0; });
  expectIssue(204, [](PackImage& i) { i.strings[0] = '\n'; });
  expectIssue(205, [](PackImage& i) { i.grids[1].name = i.grids[0].name; });
}

// Opening reads no provenance; asking for it checks it.
TEST(Rules, Info) {
  PackImage image = PackImage::of(sample());
  image.info.assign(1, '\xff');
  const std::vector<std::byte> bytes = image.assemble();
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{227});
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  ASSERT_TRUE(pack);
  ASSERT_FALSE(pack->infoJson());
  EXPECT_EQ(pack->infoJson().error().kind->id, 227);
}

TEST(Rules, Volumes) {
  expectIssue(206, [](PackImage& i) { i.volumes[0].gridCount = 1; });
  expectIssue(206, [](PackImage& i) { i.volumes[0].firstFrame = 1; });
  expectIssue(206, [](PackImage& i) { i.volumes[0].frameCount = 0xffffffffu; });
  expectIssue(207, [](PackImage& i) { i.volumes[0].framesPerSecond = 0; });
  expectIssue(207, [](PackImage& i) { i.volumes[0].framesPerSecond = kNan; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.set |= 0x80; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.anisotropy = 1; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.ambient[2] = 1; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.extinctionScale = kInf; });
  expectIssue(215, [](PackImage& i) { i.volumes[0].look.reserved[3] = 1; });
}

// What the standard allows at the edges of its ranges.
TEST(Rules, EdgesOfWhatIsAllowed) {
  PackImage image = PackImage::of(sample());
  image.volumes[0].look.extinctionScale = std::numeric_limits<float>::max();
  image.volumes[0].look.ambient[0] = -0.0f;  // not set: 0 by number
  for (GridFrame& frame : image.gridFrames) {
    if (frame.background == 0) frame.background = -0.0f;  // and tiles are +0
  }
  EXPECT_EQ(idsOf(image.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(image.assemble()), 0);
}

// No volumes at all, a volume without frames, and one without grids.
TEST(Rules, NothingInIt) {
  const PackImage nothing;
  EXPECT_EQ(idsOf(nothing.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(nothing.assemble()), 0);
  PackImage noFrames = PackImage::of(tests::smallestPack());
  noFrames.volumes[0].frameCount = 0;
  noFrames.frames.clear();
  noFrames.gridFrames.clear();
  EXPECT_EQ(idsOf(noFrames.assemble()), std::multiset<int>{});
  PackImage noGrids = PackImage::of(tests::smallestPack());
  noGrids.volumes[0].gridCount = 0;
  noGrids.grids.clear();
  noGrids.gridFrames.clear();
  EXPECT_EQ(idsOf(noGrids.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(noGrids.assemble()), 0);
}

TEST(Rules, GridsAndFrames) {
  expectIssue(209, [](PackImage& i) { i.grids[0].volume = 1; });
  expectIssue(210, [](PackImage& i) { i.grids[0].role = kRoleCount; });
  expectIssue(211, [](PackImage& i) { i.grids[0].sourceType = kSourceTypeCount; });
  expectIssue(211, [](PackImage& i) { i.grids[0].component = 0; });
  expectIssue(211, [](PackImage& i) { i.grids[0].sourceType = 7; });
  expectIssue(215, [](PackImage& i) { i.grids[0].reserved[1] = 1; });
  expectIssue(212, [](PackImage& i) { i.frames[1].number = 7; });
  expectIssue(213, [](PackImage& i) { i.frames[1].time = -1; });
  expectIssue(213, [](PackImage& i) { i.frames[1].time = std::numeric_limits<double>::infinity(); });
  expectIssue(214, [](PackImage& i) { i.frames[0].flags = kFrameHeld; });
  expectIssue(214, [](PackImage& i) { i.frames[1].flags = 4; });
  expectIssue(226, [](PackImage& i) { i.gridFrames[0].flags = 0; });
}

TEST(Rules, GridFrames) {
  expectIssue(215, [](PackImage& i) { i.gridFrames[0].reserved = 1; });
  expectIssue(215, [](PackImage& i) { i.gridFrames[0].reserved2 = 1; });
  expectIssue(216, [](PackImage& i) { i.gridFrames[0].flags |= 2; });
  expectIssue(217, [](PackImage& i) { i.gridFrames[0].indexToWorld[5] = 0; });
  expectIssue(217, [](PackImage& i) { i.gridFrames[0].indexToWorld[3] = std::numeric_limits<double>::quiet_NaN(); });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].maxError = -1; });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].squaredError = std::numeric_limits<double>::infinity(); });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].sourceMin = kNan; });
  expectIssue(218, [](PackImage& i) { i.gridFrames[1].valueMin = 1; });
  expectIssue(219, [](PackImage& i) { i.gridFrames[0].activeMax[1] = 4096; });
  expectIssue(219, [](PackImage& i) {
    i.gridFrames[1].activeMax[1] = 4, i.gridFrames[1].activeMax[0] = 0, i.gridFrames[1].activeMax[2] = 0;
  });
  expectIssue(217, [](PackImage& i) {  // a determinant of 8e-324, whose reciprocal no binary64 holds
    for (const int axis : {0, 5, 10}) i.gridFrames[0].indexToWorld[axis] = 2e-108;
  });
  expectIssue(220, [](PackImage& i) { i.gridFrames[0].origin[2] = -4; });
  expectIssue(220,
              [](PackImage& i) { i.gridFrames[0].origin[1] = 0x7ffffff8 - (i.gridFrames[0].activeMax[1] & ~7) + 8; });
  expectIssue(221, [](PackImage& i) { i.gridFrames[1].maskCount = 1; });
  expectIssue(222, [](PackImage& i) { i.gridFrames[3].pageListCount = 0xffffffffu; });
  expectIssue(223, [](PackImage& i) {
    i.pageLists.insert(i.pageLists.begin() + 1, 0), ++i.gridFrames[0].pageListCount, ++i.gridFrames[2].pageListBegin,
        ++i.gridFrames[3].pageListBegin;
  });
  expectIssue(224, [](PackImage& i) { i.pageLists[2] = 1; });
  expectIssue(225, [](PackImage& i) { i.gridFrames[0].node5 = 3; });
}

// ---- Page table and pages

void expectPageIssue(int id, const std::function<void(std::vector<std::byte>&, std::vector<PageRecord>&)>& change,
                     bool opens = false) {
  PackWriter::Options options;
  options.pageBytes = 2000;
  PackImage image = PackImage::of(tests::samplePack(options));
  std::vector<std::byte> content;
  std::vector<PageRecord> records = image.pageRecords;
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].offset = content.size();
    records[i].storedSize = records[i].rawSize = static_cast<std::uint32_t>(image.pages[i].size());
    records[i].codec = 0;
    records[i].checksum = tests::checksum(image.pages[i]);
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

TEST(Rules, PageTable) {
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

TEST(Rules, StreamLength) {
  expectPageIssue(234, [](auto&, auto& r) {
    r[0].streams[0].count += kBrickUnitMask;
    for (std::size_t i = 1; i < r.size(); ++i) r[i].streams[0].first += kBrickUnitMask;
  });
}

std::vector<std::byte> compressedSample(Compression compression) {
  PackWriter::Options options;
  options.compression = compression;
  return tests::samplePack(options);
}

TEST(Rules, BrokenCompression) {
  for (const Compression compression : {Compression::small, Compression::fast}) {
    std::vector<std::byte> bytes = compressedSample(compression);
    const auto pages = getAt<SectionEntry>(bytes, sizeof(FileHeader));
    bytes[pages.offset] ^= std::byte{0xff};  // the coder's state, or the zstd frame's magic
    tests::sealAll(bytes);
    EXPECT_EQ(idsOf(bytes), std::multiset<int>{302});
    EXPECT_EQ(loaderStop(bytes), 302);
  }
}

// RFC 8878 has frames that a decoder passes over; a page is one frame that is not.
TEST(Rules, OneZstdFrameAPage) {
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
  records[0].checksum = tests::checksum(content);
  EXPECT_EQ(idsOf(image.assemble(content, records)), std::multiset<int>{302});
  EXPECT_EQ(loaderStop(image.assemble(content, records)), 302);
}

TEST(Rules, PageLists) {
  PackWriter::Options options;
  options.pageBytes = 600;
  PackImage missing = PackImage::of(tests::samplePack(options));
  missing.pageLists.erase(missing.pageLists.begin());
  --missing.gridFrames[0].pageListCount;
  for (std::size_t i = 2; i < 4; ++i) --missing.gridFrames[i].pageListBegin;
  EXPECT_TRUE(idsOf(missing.assemble()).contains(304));
  EXPECT_EQ(loaderStop(missing.assemble()), 304);

  PackImage superfluous = PackImage::of(tests::samplePack(options));
  const auto last = static_cast<std::uint32_t>(superfluous.pages.size() - 1);
  GridFrame& frame = superfluous.gridFrames[0];
  superfluous.pageLists.insert(superfluous.pageLists.begin() + frame.pageListCount, last);
  ++frame.pageListCount;
  for (std::size_t i = 2; i < 4; ++i) ++superfluous.gridFrames[i].pageListBegin;
  EXPECT_EQ(idsOf(superfluous.assemble()), std::multiset<int>{305});
  EXPECT_EQ(loaderStop(superfluous.assemble()), 0);
}

TEST(Rules, UnusedPagesAndItems) {
  PackImage image = PackImage::of(sample());
  image.gridFrames[3] = image.gridFrames[1];
  EXPECT_EQ(idsOf(image.assemble()), (std::multiset<int>{307, 307, 307, 307}));  // a unit, a Node5, a Node4, a Node3
  image.gridFrames[0] = image.gridFrames[2] = image.gridFrames[1];
  image.pageLists.clear();
  EXPECT_EQ(idsOf(image.assemble()), std::multiset<int>{306});
}

// ---- Nodes and bricks

Node5& root(PackImage& image) {
  return *image.item<Node5>(Stream::node5, image.gridFrames[0].node5);
}
// The Node4s of the sample's first grid frame: 0 is the tile, 1 and 2 have bricks.
Node4& node4(PackImage& image, std::uint32_t index) {
  return *image.item<Node4>(Stream::node4, index);
}
// Its Node3s: 0 BC7, 1 coarse, 2 uniform 3, 3 uniform 16, 4 constant, 5 local 4, 6 uniform 8.
Node3& node3(PackImage& image, std::uint32_t index) {
  return *image.item<Node3>(Stream::node3, index);
}

TEST(Rules, Nodes) {
  expectIssue(401, [](PackImage& i) { root(i).childBegin = 1000; });
  expectIssue(401, [](PackImage& i) { node4(i, 1).childBegin = 0xffffffffu; });
  expectIssue(402, [](PackImage& i) { root(i).flags |= 2; });
  expectIssue(404, [](PackImage& i) { node4(i, 1).mean = 1e9f; });
  expectIssue(404, [](PackImage& i) { root(i).tile = 1e9f; });
  expectIssue(405, [](PackImage& i) { *i.item<std::uint32_t>(Stream::child, node4(i, 1).childBegin) = 1000; });
  expectIssue(406, [](PackImage& i) { node4(i, 2).max = node4(i, 2).mean; });
  expectIssue(407, [](PackImage& i) { node4(i, 1).flags = kNodeTileActive; });
  expectIssue(408, [](PackImage& i) { node4(i, 1).tile = -0.5f; });
  PackImage nan = PackImage::of(sample());
  node4(nan, 1).max = kNan;
  EXPECT_EQ(idsOf(nan.assemble()), (std::multiset<int>{403, 404}));
  EXPECT_EQ(loaderStop(nan.assemble()), 403);
}

TEST(Rules, Bricks) {
  expectIssue(501, [](PackImage& i) { node3(i, 0).brick = kEncodingCount << kEncodingShift; });
  expectIssue(502, [](PackImage& i) { node3(i, 0).brick |= 0x07fffff0u; });
  expectIssue(502, [](PackImage& i) { node3(i, 4).brick = 1; });
  expectIssue(503, [](PackImage& i) { node3(i, 0).mask = 77; });
  expectIssue(503, [](PackImage& i) { node3(i, 1).mask = kMaskTexel; });
  expectIssue(504, [](PackImage& i) { node3(i, 0).lo = kNan; });
  expectIssue(504, [](PackImage& i) { node3(i, 3).scale = 3e34f; });
  expectIssue(505, [](PackImage& i) { node3(i, 4).scale = 1; });
  expectIssue(506, [](PackImage& i) { node3(i, 2).mean = -0.5f; });
  expectIssue(506, [](PackImage& i) { node3(i, 0).mean = 1; });
  expectIssue(503, [](PackImage& i) { node3(i, 4).mask = kMaskTexel; });
  expectIssue(507, [](PackImage& i) { node3(i, 2).brick += 1; });
  expectIssue(507, [](PackImage& i) {
    node3(i, 5).brick = node3(i, 0).brick + ((localEncoding(4) - kEncodingBc7Y) << kEncodingShift);
  });
  expectIssue(507, [](PackImage& i) { node3(i, 6).brick = kEncodingUniform8 << kEncodingShift | unitOf(node3(i, 3)); });
}

TEST(Rules, Constants) {
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].node4Count; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].node3Count; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].maskCount; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].childCount; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].tileCount; });
  for (std::uint32_t c = 0; c < kBrickClassCount; ++c) {
    expectIssue(601, [&](PackImage& i) { ++i.gridFrames[0].brickCount[c]; });
    expectIssue(601, [&](PackImage& i) { ++i.gridFrames[0].brickUnits[c]; });
  }
  expectIssue(602, [](PackImage& i) { ++i.gridFrames[0].activeVoxels; });
  expectIssue(603, [](PackImage& i) { ++i.gridFrames[0].activeMin[0]; });
  expectIssue(603, [](PackImage& i) { --i.gridFrames[0].activeMax[2]; });
  expectIssue(604, [](PackImage& i) { --i.gridFrames[0].activeMin[0]; });
  expectIssue(605, [](PackImage& i) { i.gridFrames[0].valueMax = 1; });
}

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
  std::vector<std::byte> bytes = PackImage::of(tests::smallestPack()).assemble();
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
  const std::vector<std::byte> bytes = tests::writePack({}, [&](PackWriter& writer) {
    PackTables tables = tests::sampleTables("bomb", {"density"}, 1);
    const auto node5 = std::make_unique<Node5>();
    GridFrame frame = tests::absentGridFrame();
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
  EXPECT_LT(bomb.size(), kMaxPageBytes);
  EXPECT_EQ(loaderStop(bomb), 5);
  EXPECT_EQ(idsOf(bomb), std::multiset<int>{5});
}

// Shared nodes make few bytes stand for many bricks: sound, but more than a view lays out.
TEST(Limits, TooManyBricksAreRefusedByTheViewAlone) {
  const std::vector<std::byte> bytes = tests::writePack({}, [](PackWriter& writer) {
    PackTables tables = tests::sampleTables("dense", {"density"}, 1);
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
    GridFrame frame = tests::absentGridFrame();
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

TEST(Validate, SameIssuesFromAnyThreadCount) {
  PackWriter::Options options;
  options.pageBytes = 300;
  PackImage image = PackImage::of(tests::samplePack(options));
  for (std::size_t p = 0; p < image.pages.size(); ++p) image.pages[p][image.pages[p].size() / 2] ^= std::byte{0x55};
  for (GridFrame& frame : image.gridFrames) frame.maxError = -1;
  const std::vector<std::byte> bytes = image.assemble();
  std::vector<std::string> expected;
  for (const Issue& issue : issuesOf(bytes, 1)) expected.push_back(toString(issue));
  EXPECT_GT(expected.size(), 4u);
  for (const unsigned threads : {2u, 3u, 8u}) {
    std::vector<std::string> lines;
    for (const Issue& issue : issuesOf(bytes, threads)) lines.push_back(toString(issue));
    EXPECT_EQ(lines, expected) << threads;
  }
}

TEST(Validate, StopsAtTheLimit) {
  PackImage image = PackImage::of(sample());
  for (GridFrame& frame : image.gridFrames) frame.reserved = 1;
  ValidateOptions options;
  options.maxIssues = 3;
  int count = 0;
  validate(*makeMemorySource(image.assemble()), options, [&](const Issue&) { ++count; });
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace billow
