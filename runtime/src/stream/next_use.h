// When each frame will be drawn next, by where the instances are and how they play.
#ifndef BILLOW_RUNTIME_STREAM_NEXT_USE_H
#define BILLOW_RUNTIME_STREAM_NEXT_USE_H

#include <vector>

#include "detail.h"

namespace billow::runtime {

// Fills PlannedClip::nextUse of the clips that instances play: seconds until each distinct frame is needed, infinity
// where none will. Costs as much as there are instances, and frames in those clips. Exact where the instances of a clip
// are equally fast; else each frame has the speed of the instance that comes to it first.
void findNextUses(const Snapshot& snapshot, std::vector<PlannedClip>& clips, std::uint64_t pass);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_NEXT_USE_H
