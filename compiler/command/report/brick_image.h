// Bricks as small pictures, one pixel a voxel.
#ifndef BILLOW_COMMAND_REPORT_BRICK_IMAGE_H
#define BILLOW_COMMAND_REPORT_BRICK_IMAGE_H

#include <string>

#include "report/report_data.h"

namespace billow::command {

struct BrickImage {
  std::string slice;        // data URI, 26x8: the z slice of the largest error of source, pack, difference
  std::string slices;       // data URI, 71x26: z = 0 to 7 from left to right; source, pack, difference from the top
  float low = 0, high = 0;  // of both, over active voxels: the ends of the one scale of source and pack
  double difference = 0;    // the ends of the difference's scale are minus and plus this
};

// x grows to the right, y upwards. Inactive voxels are a grey veil. Throws where libpng fails.
BrickImage drawBrick(const WorstBrick& brick);

// The scales as CSS gradients, from low to high.
std::string valueGradient();
std::string differenceGradient();

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_BRICK_IMAGE_H
