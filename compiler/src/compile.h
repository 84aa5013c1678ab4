// The whole compile: plan -> import (and coarsen) -> try encodings (frames in parallel) -> choose -> share -> write (in
// frame order).
#ifndef BILLOW_COMPILER_COMPILE_H
#define BILLOW_COMPILER_COMPILE_H

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "billow/format/writer.h"
#include "choose/choose.h"
#include "stages.h"

namespace billow::compiler {

// Sizes that the pack keeps to, with the least error that fits; quality.psnr is then not looked at, quality.maxError
// holds as well.
struct Budget {
  // Of all frames, grids, levels and effects together, what they share counted once (CompileReport::gpuBytes).
  std::optional<std::uint64_t> gpu;
  std::optional<std::uint64_t> disk;  // the file's size
  bool any() const { return gpu || disk; }
};

struct CompileOptions {
  ImportOptions import;
  Quality quality;
  Budget budget;
  unsigned threads = 0;  // 0: as many as the machine has
  format::Compression compression = format::Compression::small;
  // Called before the first frame and after each with the number done and the number in all, one call at a time. A
  // budget takes several passes over the frames, each of which begins at 0.
  std::function<void(std::size_t done, std::size_t total)> progress;
};

// Bricks of one encoding.
struct EncodingTally {
  std::uint64_t bricks = 0;  // chosen, in all frames, before sharing
  std::uint64_t reused = 0;  // of them, as the frame before held them
  std::uint64_t bytes = 0;   // of those that are not reused
  double squaredError = 0;   // over active voxels
  std::uint64_t activeVoxels = 0;
};

struct GridReport {
  std::string volume, grid;
  std::uint32_t level = 0;   // PlannedVolume::level
  std::uint32_t frames = 0;  // in which the grid is present
  std::uint64_t activeVoxels = 0;
  std::array<EncodingTally, format::kEncodingCount> encodings{};
  double worstPsnr = 0;  // dB, over frames; infinite where exact
  float maxError = 0;
  std::uint64_t largestFrameGpuBytes = 0;
  // Of a level drawn in its volume's place, against the source at full resolution (format::LevelError): the worst over
  // frames, all of the difference as if in active voxels. What stands above is against its own means.
  double levelPsnr = std::numeric_limits<double>::infinity();
  float levelMaxError = 0;
};

struct EffectReport {
  std::string name;
  std::uint32_t emitters = 0;
  std::uint64_t mostAlive = 0;  // format::mostAlive
};

struct CompileReport {
  std::vector<GridReport> grids;
  std::vector<EffectReport> effects;
  std::uint64_t effectBytes = 0;     // of all, on disk
  std::uint64_t effectGpuBytes = 0;  // format::effectGpuBytes
  std::size_t frames = 0;            // of volumes, those of their levels not counted
  std::uint64_t fileBytes = 0;
  std::uint64_t gpuBytes = 0;    // format::packGpuBytes, and those of effects
  std::set<std::string> inputs;  // files that were read, folders that were searched
};

// Writes `output` whole or not at all. The bytes depend on inputs and options alone. Throws Error, std::system_error.
CompileReport compile(const std::vector<std::string>& inputs, const std::string& output, const CompileOptions& options,
                      const Warn& warn);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_COMPILE_H
