// One run over all frames: imported and tried in parallel, handed over in order.
#ifndef BILLOW_COMPILER_PASSES_FRAMES_H
#define BILLOW_COMPILER_PASSES_FRAMES_H

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "choose/goal.h"
#include "choose/reuse.h"
#include "choose/trials.h"
#include "stages.h"

namespace billow::compiler {

struct Job {
  std::size_t volume = 0;
  std::size_t frame = 0;
};

struct GridWork {
  // Hash of all that the grid's tree depends on: voxels, tiles, background, no transform; of a level also what it is
  // of.
  Hash128 content{};
  bool isNew = false;  // present, and no frame or grid before has this content
  // The rest only where isNew.
  std::vector<LeafKey> keys;
  std::vector<char> unchanged;  // by leaf: the same as in the last frame in which this grid was new
  // Of the other leaves; empty where there is no leaf.
  std::optional<Goal> goal;
  std::unique_ptr<GridTrials> trials;
};

struct FrameWork {
  Job job;
  bool held = false;  // repeats the frame before; then the rest is empty
  ImportedFrame imported;
  ImportedFrame source;  // of a level: what it was made from
  std::vector<GridWork> grids;
};

struct FrameRun {
  const Plan& plan;
  const ImportOptions& import;
  int effort;
  const Warn& warn;
  std::function<Goal(const Job&, std::size_t grid, const ImportedGrid&)> goal;  // thread-safe
  std::function<void(const FrameWork&)> consume;  // one call at a time, in order: volumes, then frames
};

// Holds a few frames at a time, whatever the length. What consume sees does not depend on the number of threads.
// Throws what import, goal and consume throw.
void runFrames(const FrameRun& run);

// Names file, frame and grid in messages.
std::string whereIs(const Plan& plan, const Job& job, std::size_t grid);

std::size_t frameCount(const Plan& plan);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PASSES_FRAMES_H
