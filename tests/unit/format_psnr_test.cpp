#include "billow/format/psnr.h"

#include <gtest/gtest.h>

namespace billow {
namespace {

TEST(Psnr, IsOfTheRootMeanSquare) {
  EXPECT_DOUBLE_EQ(format::psnr(10, 4.0, 400), 40);  // an error of 0.1 in each voxel
  EXPECT_EQ(format::psnr(10, 0, 400), std::numeric_limits<double>::infinity());
  EXPECT_EQ(format::psnr(0, 1, 400), -std::numeric_limits<double>::infinity());
  format::GridFrame frame{};
  frame.sourceMin = -2, frame.sourceMax = 8, frame.squaredError = 4, frame.activeVoxels = 400;
  EXPECT_DOUBLE_EQ(format::psnr(frame), 40);
}

}  // namespace
}  // namespace billow
