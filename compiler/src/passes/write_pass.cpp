#include "passes/write_pass.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "billow/format/gpu_size.h"
#include "billow/format/psnr.h"
#include "choose/decide.h"
#include "choose/decode_stored.h"
#include "effect/bake_effect.h"
#include "encode/error_sums.h"
#include "level/level_error.h"

namespace billow::compiler {
namespace {

std::string settingsJson(const CompileOptions& options) {
  nlohmann::ordered_json info;
  info["generator"] = "billow " BILLOW_VERSION;
  info["compression"] = options.compression == format::Compression::small  ? "small"
                        : options.compression == format::Compression::fast ? "fast"
                                                                           : "none";
  auto& quality = info["quality"];
  quality["effort"] = options.quality.effort;
  if (options.quality.psnr && !options.budget.any()) quality["psnr"] = *options.quality.psnr;
  if (options.quality.metric == Metric::depth) quality["metric"] = "depth";
  if (options.quality.maxError) quality["maxError"] = static_cast<double>(*options.quality.maxError);
  if (options.budget.gpu) quality["gpuBudget"] = *options.budget.gpu;
  if (options.budget.disk) quality["diskBudget"] = *options.budget.disk;
  return info.dump(2) + "\n";
}

format::PackWriter::Options writerOptions(const CompileOptions& options, const Plan& plan) {
  format::PackWriter::Options result;
  result.compression = options.compression;
  result.threads = options.threads;
  result.levels = std::ranges::any_of(plan.volumes, [](const PlannedVolume& volume) { return volume.level != 0; });
  result.effects = !plan.effects.empty();
  return result;
}

format::GridFrame absent() {
  format::GridFrame record{};
  record.node5 = format::kNone;
  for (int a = 0; a < 3; ++a) {
    record.activeMax[a] = -1;
    record.indexToWorld[5 * a] = 1;
  }
  return record;
}

}  // namespace

WritePass::WritePass(const std::string& output, const CompileOptions& options, const Plan& plan)
    : options_(options), plan_(plan), writer_(output, writerOptions(options, plan)), sharer_(writer_) {
  for (const PlannedVolume& volume : plan.volumes) addVolume(volume);
  bakeEffects(plan.effects, tables_);
  for (std::size_t i = 0; i < plan.effects.size(); ++i) {
    const format::EffectRecord& effect = tables_.effects.effects[i];
    report_.effects.push_back({plan.effects[i].name, effect.emitterCount, mostAlive(tables_.effects, effect)});
  }
  report_.effectBytes = effectBytes(tables_.effects);
  report_.effectGpuBytes = effectGpuBytes(tables_.effects).total();
}

void WritePass::addVolume(const PlannedVolume& volume) {
  format::VolumeRecord record{};
  record.name = tables_.addString(volume.name);
  record.firstGrid = static_cast<std::uint32_t>(tables_.grids.size());
  record.gridCount = static_cast<std::uint32_t>(volume.grids.size());
  record.firstFrame = static_cast<std::uint32_t>(tables_.frames.size());
  record.frameCount = static_cast<std::uint32_t>(volume.frames.size());
  record.firstGridFrame = gridFrames_;
  record.framesPerSecond = static_cast<float>(volume.framesPerSecond);
  record.look = volume.look;
  gridFrames_ += record.gridCount * record.frameCount;
  for (const PlannedGrid& grid : volume.grids) {
    format::GridRecord gridRecord{};
    gridRecord.name = tables_.addString(grid.name);
    gridRecord.role = static_cast<std::uint32_t>(grid.role);
    gridRecord.sourceType = static_cast<std::uint32_t>(grid.sourceType);
    gridRecord.component = grid.component;
    gridRecord.volume = static_cast<std::uint32_t>(tables_.volumes.size());
    tables_.grids.push_back(gridRecord);
    GridReport gridReport;
    gridReport.volume = volume.name;
    gridReport.grid = grid.name;
    gridReport.level = volume.level;
    gridReport.worstPsnr = std::numeric_limits<double>::infinity();
    report_.grids.push_back(gridReport);
  }
  for (const PlannedFrame& frame : volume.frames) {
    const double time = (frame.number - volume.frames.front().number) / volume.framesPerSecond;
    tables_.frames.push_back({frame.number, frame.flags, time});
  }
  tables_.volumes.push_back(record);
  if (volume.level != 0) addLevel(volume);
}

void WritePass::addLevel(const PlannedVolume& volume) {
  std::size_t errors = 0;  // of the levels before
  for (const format::LevelRecord& before : tables_.levels) {
    const format::VolumeRecord& other = tables_.volumes[before.level];
    errors += std::size_t{other.frameCount} * other.gridCount;
  }
  tables_.levels.push_back({static_cast<std::uint32_t>(volume.full),
                            static_cast<std::uint32_t>(tables_.volumes.size() - 1), volume.level,
                            static_cast<std::uint32_t>(errors)});
}

void WritePass::run(const GoalFunction& goal, const Warn& warn) {
  for (const PlannedVolume& volume : plan_.volumes) report_.frames += volume.level == 0 ? volume.frames.size() : 0;
  if (options_.progress) options_.progress(0, frameCount(plan_));
  runFrames(
      {plan_, options_.import, options_.quality.effort, warn, goal, [this](const FrameWork& frame) { write(frame); }});
  tables_.infoJson = settingsJson(options_);
  report_.gpuBytes = format::packGpuBytes(tables_.gridFrames, writer_.itemCounts()) + report_.effectGpuBytes;
  report_.fileBytes = writer_.close(tables_);
}

void WritePass::write(const FrameWork& frame) {
  const std::size_t grids = plan_.volumes[frame.job.volume].grids.size();
  const std::uint32_t firstReport = tables_.volumes[frame.job.volume].firstGrid;
  const bool level = plan_.volumes[frame.job.volume].level != 0;
  if (frame.job.frame == 0) {
    before_.assign(grids, {});
    // A level is read where the full volume is not, so the two have no page in common.
    if (level) sharer_.emplace(writer_);
    if (level) writer_.endPage();
  }
  for (std::size_t g = 0; g < grids; ++g) {
    tables_.gridFrames.push_back(frame.held ? tables_.gridFrames[tables_.gridFrames.size() - grids]
                                            : addGridFrame(frame, g));
    if (level) addLevelError(frame, g);
    if (!frame.held) tally(frame, g, report_.grids[firstReport + g]);
  }
  ++done_;
  if (options_.progress) options_.progress(done_, frameCount(plan_));
}

format::GridFrame WritePass::addGridFrame(const FrameWork& frame, std::size_t g) {
  const ImportedGrid& imported = frame.imported.grids[g];
  if (!imported.present) return absent();
  if (frame.grids[g].isNew) return addNew(frame, g);
  // The same tree and pages under this frame's transform.
  format::GridFrame record = written_.at(frame.grids[g].content).record;
  placeOrigin(imported.indexToWorld, record);
  return record;
}

format::GridFrame WritePass::addNew(const FrameWork& frame, std::size_t g) {
  const ImportedGrid& imported = frame.imported.grids[g];
  const GridWork& work = frame.grids[g];
  const std::string where = whereIs(plan_, frame.job, g);
  ChosenGrid chosen;
  if (work.trials) chosen = decide(imported, *work.goal, *work.trials, before_[g], work.unchanged, where);
  std::vector<std::uint32_t> pages;
  format::GridFrame record = sharer_->addGrid(imported, chosen, where, pages);
  record.flags = format::kGridPresent;
  record.pageListBegin = static_cast<std::uint32_t>(tables_.pageLists.size());
  record.pageListCount = static_cast<std::uint32_t>(pages.size());
  tables_.pageLists.insert(tables_.pageLists.end(), pages.begin(), pages.end());
  Written& entry = written_[work.content];
  entry.record = record;
  for (std::size_t i = 0; i < chosen.bricks.size(); ++i) {
    const ChosenBrick& brick = chosen.bricks[i];
    EncodingTally& tally = entry.encodings[brick.encoding];
    ++tally.bricks;
    tally.reused += brick.reused ? 1 : 0;
    tally.bytes += brick.reused ? 0 : brick.payload.size();
    tally.squaredError += brick.squaredError;
    tally.activeVoxels += work.trials->activeVoxels(i);
  }
  if (plan_.volumes[frame.job.volume].level != 0) entry.levelError = levelErrorOf(frame, g, chosen);
  before_[g].keep(imported, chosen);
  return record;
}

format::LevelError WritePass::levelErrorOf(const FrameWork& frame, std::size_t g, const ChosenGrid& chosen) const {
  ImportedGrid decoded = frame.imported.grids[g];
  for (std::size_t i = 0; i < decoded.leaves.size(); ++i) {
    Leaf& leaf = decoded.leaves[i];
    decodeStored(chosen.bricks[i], leaf.active, decoded.background, leaf.values);
  }
  const LevelDifference difference =
      measureLevel(frame.source.grids[g], decoded, plan_.volumes[frame.job.volume].level);
  return {difference.squaredError, roundUp(difference.maxError), 0};
}

void WritePass::addLevelError(const FrameWork& frame, std::size_t g) {
  const std::size_t grids = plan_.volumes[frame.job.volume].grids.size();
  auto& errors = tables_.levelErrors;
  if (frame.held) {
    errors.push_back(errors[errors.size() - grids]);
  } else if (!frame.imported.grids[g].present) {
    errors.push_back({0, 0, 0});
  } else {
    errors.push_back(written_.at(frame.grids[g].content).levelError);
  }
}

void WritePass::tally(const FrameWork& frame, std::size_t g, GridReport& report) const {
  const format::GridFrame& record = tables_.gridFrames.back();
  if ((record.flags & format::kGridPresent) == 0) return;
  ++report.frames;
  report.activeVoxels += record.activeVoxels;
  const auto& encodings = written_.at(frame.grids[g].content).encodings;
  for (std::size_t e = 0; e < encodings.size(); ++e) {
    report.encodings[e].bricks += encodings[e].bricks;
    report.encodings[e].reused += frame.grids[g].isNew ? encodings[e].reused : encodings[e].bricks;
    report.encodings[e].bytes += frame.grids[g].isNew ? encodings[e].bytes : 0;
    report.encodings[e].squaredError += encodings[e].squaredError;
    report.encodings[e].activeVoxels += encodings[e].activeVoxels;
  }
  report.worstPsnr = std::min(report.worstPsnr, format::psnr(record));
  report.maxError = std::max(report.maxError, record.maxError);
  if (report.level != 0) {
    const ImportedGrid& source = frame.source.grids[g];
    const format::LevelError& error = tables_.levelErrors.back();
    const double range = static_cast<double>(source.max) - static_cast<double>(source.min);
    report.levelPsnr = std::min(report.levelPsnr, format::psnr(range, error.squaredError, source.activeVoxels));
    report.levelMaxError = std::max(report.levelMaxError, error.maxError);
  }
  report.largestFrameGpuBytes = std::max(report.largestFrameGpuBytes, format::gpuBytes(record).total());
}

}  // namespace billow::compiler
