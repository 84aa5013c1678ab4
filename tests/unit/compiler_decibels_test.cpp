// Decibels by own arithmetic, held against the math library.
#include <gtest/gtest.h>

#include <cmath>

#include "choose/decibels.h"

namespace billow::compiler {
namespace {

TEST(Decibels, AgreeWithTheMathLibrary) {
  for (double decibels = -300; decibels <= 300; decibels += 0.37) {
    const double expected = std::pow(10.0, decibels / 20);
    EXPECT_NEAR(amplitudeRatio(decibels) / expected, 1, 1e-13) << decibels;
  }
  EXPECT_EQ(amplitudeRatio(0), 1);
}

TEST(Decibels, BeyondADoublesRangeAreZeroOrInfinite) {
  EXPECT_EQ(amplitudeRatio(-1e300), 0);
  EXPECT_TRUE(std::isinf(amplitudeRatio(1e300)));
}

}  // namespace
}  // namespace billow::compiler
