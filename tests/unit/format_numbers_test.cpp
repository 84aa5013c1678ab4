// Small arithmetic that every part of billow must do alike.
#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "billow/format/bfloat16.h"
#include "billow/format/children.h"
#include "billow/format/layout.h"

namespace billow::format {
namespace {

float fromBits(std::uint32_t bits) {
  return std::bit_cast<float>(bits);
}

TEST(Bfloat16, IsTheNearestWithTiesToEven) {
  EXPECT_EQ(toBfloat16(1.0f), 0x3f80);
  EXPECT_EQ(toBfloat16(-1.0f), 0xbf80);
  EXPECT_EQ(toBfloat16(fromBits(0x3f807fff)), 0x3f80);
  EXPECT_EQ(toBfloat16(fromBits(0x3f808000)), 0x3f80);  // a tie, down to the even one
  EXPECT_EQ(toBfloat16(fromBits(0x3f808001)), 0x3f81);
  EXPECT_EQ(toBfloat16(fromBits(0x3f818000)), 0x3f82);  // a tie, up
  EXPECT_EQ(toBfloat16(fromBits(0xbf818000)), 0xbf82);
  EXPECT_EQ(fromBfloat16(toBfloat16(std::numeric_limits<float>::max())), std::numeric_limits<float>::infinity());
}

TEST(Bfloat16, KeepsWhatItHolds) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    if ((bits & 0x7f80) == 0x7f80 && (bits & 0x7f) != 0) continue;  // NaN
    ASSERT_EQ(toBfloat16(fromBfloat16(static_cast<std::uint16_t>(bits))), bits);
  }
}

TEST(Children, LieWhereTheStandardSays) {
  const std::uint32_t at[3] = {3 * 128 + 5 * 8 + 1, 31 * 128 + 15 * 8 + 7, 0};
  EXPECT_EQ(childBit(at, kNode5Log2, kNode4SpanLog2), 3u * 1024 + 31 * 32);
  EXPECT_EQ(childBit(at, kNode4Log2, kNode3SpanLog2), 5u * 256 + 15 * 16);
  for (std::uint32_t bit = 0; bit < 4096; ++bit) {
    ASSERT_EQ(childBit(childOrigin(bit, kNode4Log2, kNode3SpanLog2), kNode4Log2, kNode3SpanLog2), bit);
  }
}

}  // namespace
}  // namespace billow::format
