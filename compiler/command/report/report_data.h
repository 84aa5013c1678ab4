// What a report shows, gathered before any of it becomes a page.
#ifndef BILLOW_COMMAND_REPORT_DATA_H
#define BILLOW_COMMAND_REPORT_DATA_H

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "billow/format/brick.h"
#include "compare_effects.h"
#include "compare_frames.h"

namespace billow::command {

// A point in the plane of rate and distortion.
struct RatePoint {
  double bits = 0;  // of GPU memory an active voxel
  double psnr = 0;  // dB, finite
};

struct RateCurve {
  std::string name;
  std::string colour;             // a class of the page's style sheet
  std::string encodings;          // the numbers of the family's, "4 5 6"; "" for the mix
  std::vector<RatePoint> points;  // ascending
  std::optional<double> bits;     // at the pack's own error; absent: out of reach
};

struct WorstBrick {
  std::int32_t frame = 0;
  std::array<std::int32_t, 3> origin{};  // source index space
  std::uint32_t encoding = 0;
  std::uint32_t activeVoxels = 0;
  double rmse = 0;
  double relativeRmse = 0;  // to the grid's range in that frame
  double maxError = 0;
  std::uint32_t worstVoxel = 0;  // voxelIndex of the largest error
  format::Mask3 active{};
  format::Values source{}, pack{};
};

// GPU bytes of one grid in one frame.
struct KindBytes {
  std::uint64_t index = 0, headers = 0, masks = 0;
  std::vector<std::uint64_t> bricks;  // by encoding family, then of encodings without one
  std::uint64_t total() const;
};

struct ReportFrame {
  GridRow row;
  KindBytes gpu;
  double bits() const;  // of GPU memory an active voxel; 0 where none is active
};

struct ReportGrid {
  std::string volume, grid;
  std::vector<ReportFrame> frames;
  std::vector<WorstBrick> worst;  // descending
  std::size_t curveFrame = 0;     // of `frames`: the one the curves are measured on
  std::vector<RateCurve> curves;  // by encoding family, then the mix that --psnr chooses
};

// Stored bytes of the pages that a frame needs.
struct FrameDisk {
  std::string volume;
  std::int32_t frame = 0;
  std::uint64_t first = 0;  // and no earlier compared frame did
  std::uint64_t all = 0;
};

struct ReportData {
  std::string pack;
  std::vector<std::string> inputs;
  std::uint64_t fileBytes = 0, pageBytes = 0;                        // on disk
  std::vector<std::pair<std::string, std::uint64_t>> unpackedBytes;  // by kind, all pages
  std::size_t packFrames = 0;
  int effort = 0;  // of the BC7 encoder, for the curves
  std::vector<ReportGrid> grids;
  std::vector<FrameDisk> disk;
  std::vector<GridRow> problems;  // rows that are not sound()
  std::vector<EffectRow> effects;
};

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_DATA_H
