// The bricks that differ most from their source.
#ifndef BILLOW_COMMAND_REPORT_WORST_BRICKS_H
#define BILLOW_COMMAND_REPORT_WORST_BRICKS_H

#include <vector>

#include "report/report_data.h"

namespace billow::command {

inline constexpr std::size_t kWorstBricks = 6;

// Merges one grid in one frame into `worst`: at most kWorstBricks, descending by RMSE over the brick's active voxels
// relative to the grid's range in that frame. One place in index space appears once, in its worst frame, for a still or
// held sequence would fill the list with one brick. Bricks without error are not taken; of equals the first stays.
void keepWorstBricks(const ComparedGrid& compared, std::vector<WorstBrick>& worst);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_WORST_BRICKS_H
