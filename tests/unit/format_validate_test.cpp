// Whatever is damaged is found, by the validator always and by the loader where it reads; alike from any threads.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

TEST(Validate, AssembledSampleIsSound) {
  EXPECT_EQ(idsOf(PackImage::of(sample()).assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(sample()), 0);
}

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

TEST(Validate, SameIssuesFromAnyThreadCount) {
  PackWriter::Options options;
  options.pageBytes = 300;
  PackImage image = PackImage::of(samplePack(options));
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
