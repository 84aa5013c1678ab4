// The whole compile: plan -> import -> encode and choose (frames in parallel) -> share -> write (in frame order).
#ifndef BILLOW_COMPILER_COMPILE_H
#define BILLOW_COMPILER_COMPILE_H

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "billow/format/writer.h"
#include "choose/choose.h"
#include "stages.h"

namespace billow::compiler {

struct CompileOptions {
  ImportOptions import;
  Quality quality;
  unsigned threads = 0;  // 0: as many as the machine has
  format::Compression compression = format::Compression::small;
  // Called before the first frame and after each with the number done and the number in all, one call at a time.
  std::function<void(std::size_t done, std::size_t total)> progress;
};

// What one encoding holds.
struct EncodingTotal {
  std::uint64_t bricks = 0;
  double squaredError = 0;  // over their active voxels
};

struct GridReport {
  std::string volume, grid;
  std::uint32_t frames = 0;  // in which the grid is present
  std::uint64_t activeVoxels = 0;
  std::array<EncodingTotal, format::kEncodingCount> encodings{};  // as chosen, before sharing
  double worstPsnr = 0;                                           // dB, over frames; infinite where exact
  float maxError = 0;
  std::uint64_t largestFrameGpuBytes = 0;
};

struct CompileReport {
  std::vector<GridReport> grids;
  std::size_t frames = 0;
  std::uint64_t fileBytes = 0;
};

// Writes `output` whole or not at all. The bytes depend on inputs and options alone. Throws Error, std::system_error.
CompileReport compile(const std::vector<std::string>& inputs, const std::string& output, const CompileOptions& options,
                      const Warn& warn);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_COMPILE_H
