// The compiler's stages, in pipeline order, and what passes between them. This header is the architecture:
//   plan -> import (-> coarsen) -> encode -> choose -> share -> write
#ifndef BILLOW_COMPILER_STAGES_H
#define BILLOW_COMPILER_STAGES_H

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "billow/format/brick.h"
#include "billow/format/layout.h"
#include "effect/description.h"

namespace billow::compiler {

// Exit codes of the command (design: 0 done, 5 our own fault).
enum class Fault : int { commandLine = 1, file = 2, input = 3, gpu = 4, internal = 5 };

// What stops a compile: one clear line that names file, frame, grid and voxel as far as they are known, what was
// expected and what to do.
class Error : public std::runtime_error {
 public:
  Error(Fault fault, const std::string& message) : std::runtime_error(message), fault_(fault) {}
  Fault fault() const { return fault_; }

 private:
  Fault fault_;
};

// Called with one line each; may be called from any thread.
using Warn = std::function<void(const std::string&)>;

// ---- plan: which files, frames and grids there are. Reads names and metadata only.

enum class MissingFrames { error, hold, blank };
enum class NonFinite { error, zero };

struct ImportOptions {
  std::vector<std::string> grids;  // names to take; empty: all
  std::optional<std::int32_t> firstFrame, lastFrame;
  std::int32_t frameStep = 1;
  MissingFrames missing = MissingFrames::error;
  NonFinite nonFinite = NonFinite::error;
  bool sdfToFog = false;
  std::optional<double> framesPerSecond;  // default: the manifest's, else 24
  std::optional<std::uint32_t> levels;    // 0 to kMaxLevels; default: the manifest's, else kDefaultLevels
};

inline constexpr std::uint32_t kMaxLevels = 2;  // of 2 and 4 times as long voxels
inline constexpr std::uint32_t kDefaultLevels = 0;

struct PlannedGrid {
  std::string name;    // "density", or "velocity.x" for a component of a vec3 grid
  std::string source;  // the grid's name in the files; repeated ones get _1, _2, ... and nameless ones "unnamed"
  std::uint32_t component = format::kNone;
  format::Role role = format::Role::none;
  format::SourceType sourceType = format::SourceType::float32;
};

struct PlannedFrame {
  std::int32_t number = 0;
  std::vector<std::string> files;  // several: their grids are merged; a held frame's are those of the one it repeats;
                                   // none where it is blank
  std::uint32_t flags = 0;         // format::kFrameHeld, kFrameBlank
};

struct PlannedVolume {
  std::string name;
  std::vector<PlannedGrid> grids;    // the union over all frames, in order of name
  std::vector<PlannedFrame> frames;  // ascending numbers
  double framesPerSecond = 24;
  format::LookRecord look{};
  std::uint32_t levels = 0;  // coarser ones that are wanted
  std::uint32_t level = 0;   // of one of them: its voxels are 2^level times as long
  std::size_t full = 0;      // with it: the plan's volume that it is a level of
};

struct Plan {
  std::vector<PlannedVolume> volumes;
  std::vector<EffectDescription> effects;
};

// `inputs` as on the command line: files, directories, globs, name_####.vdb, name_%04d.vdb, or one *.json manifest;
// and *.effect.json beside any of them.
// Throws Error.
Plan planInputs(const std::vector<std::string>& inputs, const ImportOptions& options, const Warn& warn);

// The levels of all volumes as further volumes behind them, in the order of the pack's records; of the same files.
// Throws Error(input) where a volume has a name that a level needs.
void addLevels(Plan& plan);

// ---- import: one frame's grids as leaves and tiles, all scalar floats.

struct Leaf {
  std::array<std::int32_t, 3> origin;  // source index space, multiples of 8
  format::Mask3 active;
  format::Values values;  // inactive ones hold the background
};

struct Tile {  // an active constant region; dim 8, 128 or 4096, origin a multiple of dim
  std::array<std::int32_t, 3> origin;
  std::uint32_t dim;
  float value;
};

struct ImportedGrid {
  bool present = false;
  float background = 0;
  // world = M * (source index, 1); 3x4 row-major.
  std::array<double, 12> indexToWorld{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::vector<Leaf> leaves;        // ascending (origin x, y, z); none without an active voxel
  std::vector<Tile> tiles;         // ascending (origin x, y, z, dim)
  std::uint64_t activeVoxels = 0;  // tiles included
  float min = 0, max = 0;          // of active values and background
  std::string file;                // for messages
};

struct ImportedFrame {
  std::vector<ImportedGrid> grids;  // as PlannedVolume::grids; absent ones have present == false
};

// Reads one planned frame, of a level the full volume's. Thread-safe. Throws Error.
ImportedFrame importFrame(const PlannedVolume& volume, const PlannedFrame& frame, const ImportOptions& options,
                          const Warn& warn);

// ---- encode: one brick, one encoding.

// How an encoding serves a brick: values are lo + scale * texel; squaredError and maxError are measured against the
// source over active voxels, with the very arithmetic of format::decodeBrick.
struct Fit {
  std::uint32_t encoding = format::kEncodingConstant;
  bool texelMask = false;  // inactive voxels have index 0, active ones another (uniform, local): no mask is stored
  float lo = 0;
  float scale = 0;
  double squaredError = 0;
  float maxError = 0;
};

struct Candidate : Fit {
  std::array<std::byte, 1024> payload;  // format::brickBytes(encoding) of it are used
};

struct BrickSource {
  const format::Values* values;
  const format::Mask3* active;
  std::uint32_t activeCount;
  float tile;  // the background: what inactive voxels become
};

// Each fills `out` whole (payload only as far as it is used).
// Deterministic, thread-safe, no allocation.
void encodeConstant(const BrickSource& brick, Candidate& out);
// `effort` from 0, the fastest, to 9; bc7_block.cpp says what each tries.
void encodeBc7(const BrickSource& brick, std::uint32_t encoding, int effort, Candidate& out);
// Along the packed axis that fits best: up to effort 2 found by a cheap test, from 3 on by encoding all.
void encodeBc7BestAxis(const BrickSource& brick, int effort, Candidate& out);
// Of `bits` 1 to 8, or 16.
void encodeUniform(const BrickSource& brick, std::uint32_t bits, Candidate& out);
// What encodeUniform() will do with `first` to `last` bits of 1 to 8, all at once; fits[i] has i + 1.
void fitUniforms(const BrickSource& brick, std::uint32_t first, std::uint32_t last, std::array<Fit, 8>& fits);
// The squared errors that uniform bricks of 1 to 8 bits would have if values filled the brick's range evenly.
std::array<double, 8> estimateUniforms(const BrickSource& brick);
// Of `bits` 2 to 6.
void encodeLocal(const BrickSource& brick, std::uint32_t bits, Candidate& out);
// The squared errors that local bricks of 2 to 6 bits would have if values filled their cells' ranges evenly.
std::array<double, 5> estimateLocals(const BrickSource& brick);
void encodeCoarse(const BrickSource& brick, Candidate& out);
// The squared error that a coarse brick would leave if what bends along z were noise.
double estimateCoarse(const BrickSource& brick);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_STAGES_H
