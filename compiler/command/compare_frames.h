// A pack held against its source, frame by frame: what `compare` prints and what its report draws.
#ifndef BILLOW_COMMAND_COMPARE_FRAMES_H
#define BILLOW_COMMAND_COMPARE_FRAMES_H

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "billow/format/grid_view.h"
#include "grid_error.h"
#include "metric/depth_error.h"
#include "stages.h"

namespace billow::command {

// One grid in one frame.
struct GridRow {
  std::string volume, grid;
  std::int32_t frame = 0;
  GridError error;
  double range = 0;     // max - min of the source's active values and background
  std::string problem;  // "" where the grid was compared
  compiler::DepthError depth{};

  // Decibels over active voxels; infinite where the reconstruction is exact.
  double psnr() const;
  // The same over line integrals.
  double depthPsnr() const;
  // Whether the pack holds what the source holds, whatever its error.
  bool sound() const;
};

// What was loaded to measure a row; lives only while it is being observed.
struct ComparedGrid {
  const GridRow& row;
  const compiler::ImportedGrid& source;
  const compiler::ImportedGrid& pack;  // reconstruct(view)
  const format::GridView& view;
};
using ObserveGrid = std::function<void(const ComparedGrid&)>;

// The pack's volume that has a planned volume's name, or the only one of each. Throws Error(input).
const format::VolumeRecord& matchVolume(const format::Pack& pack, const compiler::Plan& plan,
                                        const compiler::PlannedVolume& volume);

// Rows in order of volume, frame, grid; one frame of the source and one grid of the pack are in memory at a time.
// `observe` sees every grid that both have. The error is what is wrong with the pack. Throws Error.
format::Result<std::vector<GridRow>> compareFrames(const format::Pack& pack, const compiler::Plan& plan,
                                                   const compiler::ImportOptions& options, const ObserveGrid& observe);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_COMPARE_FRAMES_H
