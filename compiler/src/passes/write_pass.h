// The pass that writes a pack.
#ifndef BILLOW_COMPILER_PASSES_WRITE_PASS_H
#define BILLOW_COMPILER_PASSES_WRITE_PASS_H

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "billow/format/writer.h"
#include "compile.h"
#include "passes/frames.h"
#include "share/share.h"

namespace billow::compiler {

class WritePass {
 public:
  using GoalFunction = std::function<Goal(const Job&, std::size_t grid, const ImportedGrid&)>;

  // `plan` and `options` must outlive it.
  WritePass(const std::string& output, const CompileOptions& options, const Plan& plan);

  // Writes the pack under a temporary name, which goes with this unless commit() is called. `goal` of each grid frame.
  void run(const GoalFunction& goal, const Warn& warn);
  const CompileReport& report() const { return report_; }
  // Gives the file its name.
  void commit() { writer_.commit(); }

 private:
  // What a grid in a frame became, for frames that hold the same again.
  struct Written {
    format::GridFrame record;
    format::LevelError levelError;  // of a level
    std::array<EncodingTally, format::kEncodingCount> encodings;
  };

  void addVolume(const PlannedVolume& volume);
  void addLevel(const PlannedVolume& volume);
  void write(const FrameWork& frame);
  format::GridFrame addGridFrame(const FrameWork& frame, std::size_t g);
  format::GridFrame addNew(const FrameWork& frame, std::size_t g);
  format::LevelError levelErrorOf(const FrameWork& frame, std::size_t g, const ChosenGrid& chosen) const;
  void addLevelError(const FrameWork& frame, std::size_t g);
  void tally(const FrameWork& frame, std::size_t g, GridReport& report) const;

  const CompileOptions& options_;
  const Plan& plan_;
  format::PackWriter writer_;
  std::optional<Sharer> sharer_;  // of the full volumes, then of one level after the other
  format::PackTables tables_;
  std::uint32_t gridFrames_ = 0;
  std::vector<FrameBefore> before_;     // by grid of the volume at hand: the last frame in which it was new
  std::map<Hash128, Written> written_;  // by content; some 1 KiB a grid and frame
  std::size_t done_ = 0;
  CompileReport report_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PASSES_WRITE_PASS_H
