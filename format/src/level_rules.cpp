// The rules of detail levels: that what is drawn in place of a volume is that volume, coarser.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "rules.h"

namespace billow::format {
namespace {

// Of the sum of the magnitudes of a place's terms: how far rounding may take it.
constexpr double kRounding = 1e-9;

class LevelRules {
 public:
  LevelRules(const TableView& view, IssueSink& sink) : view_(view), sink_(sink) {}

  void check() {
    isFull_.resize(view_.volumes.size());
    isLevel_.resize(view_.volumes.size());
    for (std::size_t i = 0; i < view_.levels.size(); ++i) {
      if (!checkVolumes(i)) return;  // what follows reads by them
    }
    std::uint64_t errors = 0;
    bool sound = true;
    for (std::size_t i = 0; i < view_.levels.size() && !sink_.stopped(); ++i) {
      const LevelRecord& record = view_.levels[i];
      if (record.firstError != errors) sound = false;
      const VolumeRecord& volume = view_.volumes[record.level];
      errors += std::uint64_t{volume.frameCount} * volume.gridCount;
      if (checkContents(i)) checkPlaces(i);
    }
    if (!sound || errors != view_.levelErrors.size()) {
      sink_.report(Rule::levelErrors, view_.place(kSectionLevels, 0),
                   fmt::format("There are {} for {} grid frames.", view_.levelErrors.size(), errors));
    }
    for (std::size_t i = 0; i < view_.levelErrors.size() && !sink_.stopped(); ++i) checkError(i);
  }

 private:
  Place placeOf(std::size_t record) const { return view_.place(kSectionLevels, record * sizeof(LevelRecord)); }

  bool checkVolumes(std::size_t i) {
    const LevelRecord& record = view_.levels[i];
    const bool exist = record.volume < view_.volumes.size() && record.level < view_.volumes.size();
    const bool factor = record.log2 >= 1 && record.log2 <= kMaxLevelLog2;
    const LevelRecord* before = i > 0 ? &view_.levels[i - 1] : nullptr;
    const bool ordered = before == nullptr || before->volume < record.volume ||
                         (before->volume == record.volume && before->log2 < record.log2);
    if (exist && factor && ordered && !isFull_[record.level] && !isLevel_[record.level] && !isLevel_[record.volume] &&
        record.level != record.volume) {
      isFull_[record.volume] = true;
      isLevel_[record.level] = true;
      return true;
    }
    sink_.report(Rule::levelVolumes, placeOf(i),
                 fmt::format("Volume {} of {} as level 2^{} of volume {}.", record.level, view_.volumes.size(),
                             record.log2, record.volume));
    return false;
  }

  std::string_view textOf(StringRef ref) const { return view_.strings.substr(ref.offset, ref.size); }

  // Whether the two have the same grids in the same frames.
  bool checkContents(std::size_t i) const {
    const VolumeRecord& full = view_.volumes[view_.levels[i].volume];
    const VolumeRecord& level = view_.volumes[view_.levels[i].level];
    const auto fail = [&](const std::string& detail) {
      sink_.report(Rule::levelContents, placeOf(i), detail);
      return false;
    };
    if (full.gridCount != level.gridCount || full.frameCount != level.frameCount) {
      return fail(fmt::format("{} grids and {} frames, the full volume has {} and {}.", level.gridCount,
                              level.frameCount, full.gridCount, full.frameCount));
    }
    if (full.framesPerSecond != level.framesPerSecond || std::memcmp(&full.look, &level.look, sizeof full.look) != 0)
      return fail("Its look or frame rate is another.");
    for (std::uint32_t g = 0; g < full.gridCount; ++g) {
      const GridRecord& a = view_.grids[full.firstGrid + g];
      const GridRecord& b = view_.grids[level.firstGrid + g];
      const bool same = a.role == b.role && a.sourceType == b.sourceType && a.component == b.component;
      if (!same || textOf(a.name) != textOf(b.name)) return fail(fmt::format("Grid {} is another.", g));
    }
    for (std::uint32_t f = 0; f < full.frameCount; ++f) {
      const FrameRecord& a = view_.frames[full.firstFrame + f];
      const FrameRecord& b = view_.frames[level.firstFrame + f];
      if (a.number != b.number || a.flags != b.flags || a.time != b.time)
        return fail(fmt::format("Frame {} is another.", a.number));
    }
    const std::uint64_t gridFrames = std::uint64_t{full.gridCount} * full.frameCount;
    for (std::uint64_t j = 0; j < gridFrames; ++j) {
      const auto flags =
          view_.gridFrames[full.firstGridFrame + j].flags ^ view_.gridFrames[level.firstGridFrame + j].flags;
      if ((flags & kGridPresent) != 0) return fail(fmt::format("Grid frame {} is present in one of the two.", j));
    }
    return true;
  }

  void checkPlaces(std::size_t i) const {
    const LevelRecord& record = view_.levels[i];
    const VolumeRecord& full = view_.volumes[record.volume];
    const VolumeRecord& level = view_.volumes[record.level];
    const std::uint64_t gridFrames = std::uint64_t{full.gridCount} * full.frameCount;
    for (std::uint64_t j = 0; j < gridFrames && !sink_.stopped(); ++j) {
      const GridFrame& a = view_.gridFrames[full.firstGridFrame + j];
      const GridFrame& b = view_.gridFrames[level.firstGridFrame + j];
      if ((a.flags & kGridPresent) == 0 || liesAt(a, b, record.log2)) continue;
      sink_.report(Rule::levelPlace, view_.gridFramePlace(level.firstGridFrame + j), "It lies elsewhere.");
    }
  }

  // Level voxel c has its centre at 2^log2 c + (2^log2 - 1) / 2 of the source's indices.
  static bool liesAt(const GridFrame& full, const GridFrame& level, std::uint32_t log2) {
    const double factor = static_cast<double>(1u << log2);
    for (int row = 0; row < 3; ++row) {
      const double* a = full.indexToWorld + 4 * row;
      const double* b = level.indexToWorld + 4 * row;
      double place = a[3], magnitude = std::abs(a[3]) + std::abs(b[3]);
      for (int axis = 0; axis < 3; ++axis) {
        if (b[axis] != factor * a[axis]) return false;
        const double index = factor * level.origin[axis] + (factor - 1) / 2 - full.origin[axis];
        place += a[axis] * index;
        magnitude += std::abs(a[axis]) * (std::abs(static_cast<double>(full.origin[axis])) + std::abs(index) + factor);
      }
      if (!(std::abs(place - b[3]) <= kRounding * magnitude)) return false;
    }
    return true;
  }

  void checkError(std::size_t i) const {
    const LevelError& error = view_.levelErrors[i];
    const Place place = view_.place(kSectionLevelErrors, i * sizeof(LevelError));
    if (error.reserved != 0) sink_.report(Rule::tableReserved, place, "A reserved field of a level's error is not.");
    if (std::isfinite(error.squaredError) && error.squaredError >= 0 && std::isfinite(error.maxError) &&
        error.maxError >= 0)
      return;
    sink_.report(Rule::levelErrors, place, fmt::format("Squares {}, largest {}.", error.squaredError, error.maxError));
  }

  const TableView& view_;
  IssueSink& sink_;
  std::vector<bool> isFull_, isLevel_;  // by volume, of the records so far
};

}  // namespace

void checkLevels(const TableView& tables, IssueSink& sink) {
  LevelRules(tables, sink).check();
}

}  // namespace billow::format
