// The rules of header, contents, sections and padding: what the validator reports, the loader stops at.
#include <gtest/gtest.h>

#include <functional>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

TEST(ContainerRules, Header) {
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
    header.headerChecksum = checksum(std::as_bytes(std::span(&header, 1)).first(56));
    putAt(b, 0, header);
  });
}

TEST(ContainerRules, Contents) {
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

TEST(ContainerRules, SectionPlaces) {
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

TEST(ContainerRules, Padding) {
  expectBytesIssue(
      117,
      [](auto& b) {
        const auto strings = getAt<SectionEntry>(b, sizeof(FileHeader) + sizeof(SectionEntry));
        b[strings.offset + strings.size] = std::byte{1};
      },
      true);
  std::vector<std::byte> bytes = smallestPack();
  auto header = getAt<FileHeader>(bytes, 0);
  const auto tables = static_cast<std::ptrdiff_t>(getAt<SectionEntry>(bytes, 96).offset);
  bytes.insert(bytes.begin() + tables, 4096, std::byte{0});
  for (std::size_t i = 1; i < header.sectionCount; ++i) {
    editEntry(bytes, i, [](SectionEntry& e) { e.offset += 4096; });
  }
  editHeader(bytes, [&](FileHeader& h) { h.fileSize = bytes.size(); });
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{118});
}

}  // namespace
}  // namespace billow
