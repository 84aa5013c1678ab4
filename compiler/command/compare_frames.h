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
  std::uint32_t level = 0;  // that was measured in the full volume's place

  // Decibels over active voxels; infinite where the reconstruction is exact.
  double psnr() const;
  // The same over line integrals; NaN of a level, where they are not taken.
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

// The pack's full volume that has a planned volume's name, or the only one of each, or that one's level. Throws
// Error(input).
const format::VolumeRecord& matchVolume(const format::Pack& pack, const compiler::Plan& plan,
                                        const compiler::PlannedVolume& volume, std::uint32_t level = 0);

// Rows in order of volume, frame, grid; one frame of the source and one grid of the pack are in memory at a time.
// `observe` sees every grid that both have. With `level` that level is measured, by compiler::measureLevel, and nothing
// observed. The error is what is wrong with the pack. Throws Error.
format::Result<std::vector<GridRow>> compareFrames(const format::Pack& pack, const compiler::Plan& plan,
                                                   const compiler::ImportOptions& options, std::uint32_t level,
                                                   const ObserveGrid& observe);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_COMPARE_FRAMES_H
