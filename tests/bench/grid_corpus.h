// The bricks of real grids, for benchmarks.
#ifndef BILLOW_BENCH_GRID_CORPUS_H
#define BILLOW_BENCH_GRID_CORPUS_H

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "../brick_corpus.h"
#include "stages.h"

namespace billow::bench {

struct Corpus {
  std::string name;
  std::vector<tests::Brick> bricks;  // with an active voxel each
  double range = 0;                  // of the grid, its background included
  std::uint64_t activeVoxels = 0;

  void add(const tests::Brick& brick) {
    if (brick.activeCount == 0) return;
    bricks.push_back(brick);
    activeVoxels += brick.activeCount;
  }
  // In dB, of a sum of squared errors.
  double psnr(double squared) const {
    return 20 * std::log10(range / std::sqrt(squared / static_cast<double>(activeVoxels)));
  }
};

// A smooth cloud of 256^3 voxels.
inline Corpus cloudCorpus() {
  Corpus corpus;
  corpus.name = "cloud256";
  float high = 0;
  for (const tests::Brick& brick : tests::cloudBricks(256)) {
    corpus.add(brick);
    high = std::max(high, *std::max_element(brick.values.begin(), brick.values.end()));
  }
  corpus.range = static_cast<double>(high);
  return corpus;
}

// The middle frame of a folder's sequence, a corpus for each grid that has leaves. Throws compiler::Error.
inline std::vector<Corpus> sequenceCorpora(const std::string& folder) {
  const compiler::ImportOptions options;
  const auto ignore = [](const std::string&) {};
  const compiler::Plan plan = compiler::planInputs({folder}, options, ignore);
  std::vector<Corpus> corpora;
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    const compiler::PlannedFrame& planned = volume.frames[volume.frames.size() / 2];
    const compiler::ImportedFrame frame = compiler::importFrame(volume, planned, options, ignore);
    for (std::size_t g = 0; g < frame.grids.size(); ++g) {
      Corpus corpus;
      corpus.name = volume.name + "/" + volume.grids[g].name;
      for (const compiler::Leaf& leaf : frame.grids[g].leaves) {
        tests::Brick brick{leaf.values, leaf.active, 0};
        brick.count();
        corpus.add(brick);
      }
      corpus.range = static_cast<double>(frame.grids[g].max) - static_cast<double>(frame.grids[g].min);
      if (!corpus.bricks.empty()) corpora.push_back(std::move(corpus));
    }
  }
  return corpora;
}

}  // namespace billow::bench

#endif  // BILLOW_BENCH_GRID_CORPUS_H
