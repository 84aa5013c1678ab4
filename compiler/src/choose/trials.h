// What each encoding that may pay would cost and spoil, for the bricks of one grid in one frame.
#ifndef BILLOW_COMPILER_CHOOSE_TRIALS_H
#define BILLOW_COMPILER_CHOOSE_TRIALS_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "choose/choose.h"
#include "choose/goal.h"
#include "parallel.h"

namespace billow::compiler {

class GridTrials {
 public:
  // `grid` must outlive it. Bricks with skip[i] != 0 are not tried (an empty `skip` skips none).
  GridTrials(const ImportedGrid& grid, const Goal& goal, int effort, std::span<const char> skip);

  // By leaf, each list in the order of trial.
  const std::vector<std::vector<Choice>>& choices() const { return choices_; }
  std::uint32_t activeVoxels(std::size_t brick) const { return counts_[brick]; }
  std::uint64_t activeVoxels() const;  // of all leaves, skipped ones too

  // Adds a brick that is stored already, with what it costs and spoils here; fit.encoding and so on are the brick's.
  // `stored` must outlive this.
  void offer(std::size_t brick, const ChosenBrick& stored, const Fit& fit, const Choice& choice);
  // Tries bricks that were skipped; those with again[i] == 0 are left as they are.
  void tryMore(std::span<const char> again);
  // Tries 16 bits a voxel on every brick that has choices.
  void tryWide();

  // The brick of a choice. Thread-safe; encodes it again unless it is stored already or BC7.
  ChosenBrick take(std::size_t brick, std::uint32_t choice) const;
  // Whether the choice stores a mask beside the brick.
  bool storesMask(std::size_t brick, std::uint32_t choice) const;
  // By choice; squaredError is of voxels, whatever the metric.
  std::span<const Fit> fits(std::size_t brick) const { return bricks_[brick].tried; }

 private:
  struct Brick {
    std::vector<Fit> tried;                // beside the brick's choices
    std::vector<std::uint32_t> lastIndex;  // beside them: DiskUniform::last of those made for the disk, else 0
    std::vector<std::byte> bc7;            // payloads of those that are BC7, in their order
    const ChosenBrick* stored = nullptr;   // what was offered, as choice storedAt
    std::uint32_t storedAt = format::kNone;
  };
  // Squared error that a unit of rate saves at the margin, and the largest error that counts.
  struct Margin {
    double multiplier;
    float limit;
  };

  void tryAll();
  void countVoxels();
  void tryConstants();
  void settleQuietBricks();
  void tryUniform();
  void tryForDisk(std::size_t brick, Candidate& candidate);
  std::vector<std::uint32_t> lastsWorthTrying(std::size_t brick) const;
  void tryLocal();
  void tryCoarse();
  void tryBc7();
  bool refinesBc7() const;
  void refineBc7();
  double triedBudget() const;
  std::optional<Margin> margin() const;
  std::optional<Margin> guessedMargin() const;
  std::pair<std::uint32_t, std::uint32_t> bitsWorthFitting(std::size_t brick, const std::optional<Margin>& known) const;
  double rate(std::uint32_t bytes, std::uint32_t diskBytes) const;
  bool mayPay(std::size_t brick, std::uint32_t bytes, double squaredError, const std::optional<Margin>& margin) const;
  BrickSource source(std::size_t brick) const;
  std::uint32_t maskBytes(std::size_t brick) const;
  std::vector<std::byte> payloadOf(std::size_t brick, std::uint32_t choice) const;
  double distortionOf(std::size_t brick, const Candidate& candidate) const;
  void add(std::size_t brick, const Candidate& candidate);
  void add(std::size_t brick, const Fit& fit, double distortion, std::uint32_t diskBytes);
  template <class Function>
  void forEachTried(const Function& function) {
    parallelRanges(bricks_.size(), 16, [&](std::size_t begin, std::size_t end) {
      const auto candidate = std::make_unique<Candidate>();
      for (std::size_t i = begin; i != end; ++i) {
        if (!skip_[i]) function(i, *candidate);
      }
    });
  }

  const ImportedGrid& grid_;
  const Goal goal_;
  const int effort_;
  std::vector<Brick> bricks_;
  std::vector<std::vector<Choice>> choices_;
  std::vector<std::uint32_t> counts_;
  std::vector<char> skip_, quiet_;
  std::vector<std::array<double, 8>> guesses_;  // of the squared errors of uniform bricks of 1 to 8 bits
  bool triedWide_ = false;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_TRIALS_H
