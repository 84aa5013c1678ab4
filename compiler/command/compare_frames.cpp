#include "compare_frames.h"

#include <fmt/format.h>

#include <limits>

#include "billow/format/psnr.h"
#include "import_options.h"
#include "level/level_error.h"
#include "pack_lookup.h"
#include "reconstruct.h"

namespace billow::command {
namespace {

class Comparison {
 public:
  Comparison(const format::Pack& pack, const compiler::ImportOptions& options, std::uint32_t level,
             const ObserveGrid& observe)
      : pack_(pack), options_(options), level_(level), observe_(observe) {}

  // Nullopt, or what is wrong with the pack.
  std::optional<format::Issue> compareVolume(const compiler::PlannedVolume& planned,
                                             const format::VolumeRecord& volume) {
    for (const compiler::PlannedFrame& frame : planned.frames) {
      const std::ptrdiff_t index = findFrame(pack_, volume, frame.number);
      if (index < 0) {
        rows_.push_back({planned.name, "", frame.number, {}, 0, "the pack has no such frame", {}, level_});
        continue;
      }
      const compiler::ImportedFrame source = compiler::importFrame(planned, frame, options_, printWarning);
      for (std::size_t g = 0; g < planned.grids.size(); ++g) {
        GridRow row{planned.name, planned.grids[g].name, frame.number, {}, 0, "", {}, level_};
        auto issue = compareGrid(source.grids[g], volume, static_cast<std::uint32_t>(index), row);
        if (issue) return issue;
        if (source.grids[g].present || !row.problem.empty()) rows_.push_back(row);
      }
    }
    return std::nullopt;
  }

  std::vector<GridRow> takeRows() { return std::move(rows_); }

 private:
  std::optional<format::Issue> compareGrid(const compiler::ImportedGrid& source, const format::VolumeRecord& volume,
                                           std::uint32_t frame, GridRow& row) {
    const std::ptrdiff_t grid = findGrid(pack_, volume, row.grid);
    if (grid < 0) {
      row.problem = "the pack has no such grid";
      return std::nullopt;
    }
    const format::GridFrame& gridFrame = pack_.gridFrame(volume, frame, static_cast<std::uint32_t>(grid));
    const bool present = (gridFrame.flags & format::kGridPresent) != 0;
    if (present != source.present) row.problem = present ? "only the pack has it here" : "only the source has it here";
    if (!present || !source.present) return std::nullopt;
    const auto view = format::GridView::load(pack_, gridFrame);
    if (!view) return view.error();
    const compiler::ImportedGrid pack = reconstruct(*view);
    if (level_ == 0) {
      row.error = measureError(source, pack);
      row.depth = compiler::measureDepth(source, pack);
    } else {
      const compiler::LevelDifference difference = compiler::measureLevel(source, pack, level_);
      row.error = {source.activeVoxels, difference.missed, difference.squaredError, difference.maxError};
    }
    row.range = static_cast<double>(source.max) - static_cast<double>(source.min);
    if (source.background != gridFrame.background) {
      row.problem = fmt::format("background {} in the pack, {} in the source", gridFrame.background, source.background);
    }
    if (level_ == 0) observe_({row, source, pack, *view});
    return std::nullopt;
  }

  const format::Pack& pack_;
  const compiler::ImportOptions& options_;
  const std::uint32_t level_;
  const ObserveGrid& observe_;
  std::vector<GridRow> rows_;
};

}  // namespace

double GridRow::psnr() const {
  return format::psnr(range, error.squaredError, error.sourceVoxels);
}

double GridRow::depthPsnr() const {
  if (level != 0) return std::numeric_limits<double>::quiet_NaN();
  // What differs then is how sums of tiles and of their voxels round.
  if (sound() && error.squaredError == 0) return std::numeric_limits<double>::infinity();
  return depth.psnr();
}

bool GridRow::sound() const {
  return problem.empty() && error.mismatchedVoxels == 0;
}

const format::VolumeRecord& matchVolume(const format::Pack& pack, const compiler::Plan& plan,
                                        const compiler::PlannedVolume& volume, std::uint32_t level) {
  const auto named = findVolume(pack, volume.name, level);
  if (named) return pack.volumes()[*named];
  const auto only = plan.volumes.size() == 1 ? findVolume(pack, "", level) : named;
  if (only) return pack.volumes()[*only];
  throw compiler::Error(level == 0 ? compiler::Fault::input : compiler::Fault::commandLine, named.error());
}

format::Result<std::vector<GridRow>> compareFrames(const format::Pack& pack, const compiler::Plan& plan,
                                                   const compiler::ImportOptions& options, std::uint32_t level,
                                                   const ObserveGrid& observe) {
  Comparison comparison(pack, options, level, observe);
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    auto issue = comparison.compareVolume(volume, matchVolume(pack, plan, volume, level));
    if (issue) return tl::make_unexpected(*issue);
  }
  return comparison.takeRows();
}

}  // namespace billow::command
