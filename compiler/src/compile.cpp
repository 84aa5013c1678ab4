#include "compile.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>
#include <unordered_map>

#include "billow/format/gpu_size.h"
#include "billow/format/psnr.h"
#include "share/share.h"

namespace billow::compiler {
namespace {

// Frames that are imported and encoded while others are written: one on its way in, one being encoded.
constexpr std::size_t kFramesInFlight = 2;

struct Job {
  std::size_t volume = 0;
  std::size_t frame = 0;
};

// A frame between the parallel and the serial stage.
struct EncodedFrame {
  Job job;
  ImportedFrame imported;
  std::vector<std::uint64_t> contents;  // contentOf() each grid
  std::vector<ChosenGrid> chosen;
};

// What a grid in a frame became, for frames that hold the same again.
struct Written {
  format::GridFrame record;
  std::array<EncodingTotal, format::kEncodingCount> encodings{};
};

// Hash of all that the tree of a grid depends on: voxels, tiles and background, not the transform.
std::uint64_t contentOf(const ImportedGrid& grid) {
  std::uint64_t hash = XXH3_64bits_withSeed(&grid.background, sizeof(grid.background), grid.leaves.size());
  for (const Leaf& leaf : grid.leaves) hash = XXH3_64bits_withSeed(&leaf, sizeof(leaf), hash);
  for (const Tile& tile : grid.tiles) hash = XXH3_64bits_withSeed(&tile, sizeof(tile), hash);
  return hash;
}
static_assert(std::has_unique_object_representations_v<decltype(Leaf::origin)> && sizeof(Leaf) == 12 + 64 + 2048,
              "Leaf has no padding that a hash would meet");
static_assert(sizeof(Tile) == 20, "Tile has no padding that a hash would meet");

std::string settingsJson(const CompileOptions& options) {
  nlohmann::ordered_json info;
  info["generator"] = "billow " BILLOW_VERSION;
  info["quality"]["effort"] = options.quality.effort;
  info["compression"] = options.compression == format::Compression::small ? "small" : "fast";
  if (options.quality.psnr) info["quality"]["psnr"] = *options.quality.psnr;
  if (options.quality.metric == Metric::depth) info["quality"]["metric"] = "depth";
  if (options.quality.maxError) info["quality"]["maxError"] = static_cast<double>(*options.quality.maxError);
  return info.dump(2) + "\n";
}

class Compiler {
 public:
  Compiler(const std::string& output, const CompileOptions& options, const Warn& warn, Plan plan)
      : options_(options),
        warn_(warn),
        plan_(std::move(plan)),
        writer_(output, writerOptions(options)),
        sharer_(writer_) {
    for (std::size_t v = 0; v < plan_.volumes.size(); ++v) {
      addVolume(plan_.volumes[v]);
      for (std::size_t f = 0; f < plan_.volumes[v].frames.size(); ++f) jobs_.push_back({v, f});
    }
  }

  CompileReport run() {
    if (options_.progress) options_.progress(0, jobs_.size());
    std::size_t next = 0;
    tbb::parallel_pipeline(kFramesInFlight,
                           tbb::make_filter<void, Job>(tbb::filter_mode::serial_in_order,
                                                       [&](tbb::flow_control& control) {
                                                         if (next == jobs_.size()) control.stop();
                                                         return next == jobs_.size() ? Job{} : jobs_[next++];
                                                       }) &
                               tbb::make_filter<Job, std::shared_ptr<EncodedFrame>>(
                                   tbb::filter_mode::parallel, [this](Job job) { return encode(job); }) &
                               tbb::make_filter<std::shared_ptr<EncodedFrame>, void>(
                                   tbb::filter_mode::serial_in_order,
                                   [this](const std::shared_ptr<EncodedFrame>& frame) { write(*frame); }));
    tables_.infoJson = settingsJson(options_);
    writer_.finish(tables_);
    report_.frames = jobs_.size();
    return std::move(report_);
  }

 private:
  static format::PackWriter::Options writerOptions(const CompileOptions& options) {
    format::PackWriter::Options result;
    result.compression = options.compression;
    result.threads = options.threads;
    return result;
  }

  void addVolume(const PlannedVolume& volume) {
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
      gridReport.worstPsnr = std::numeric_limits<double>::infinity();
      report_.grids.push_back(gridReport);
    }
    for (const PlannedFrame& frame : volume.frames) {
      const double time = (frame.number - volume.frames.front().number) / volume.framesPerSecond;
      tables_.frames.push_back({frame.number, frame.flags, time});
    }
    tables_.volumes.push_back(record);
  }

  std::string where(const Job& job, std::size_t grid) const {
    const PlannedVolume& volume = plan_.volumes[job.volume];
    const PlannedFrame& frame = volume.frames[job.frame];
    return fmt::format("{}: frame {}: grid '{}'", frame.files.empty() ? volume.name : frame.files.front(), frame.number,
                       volume.grids[grid].name);
  }

  bool isHeld(const Job& job) const {
    return (plan_.volumes[job.volume].frames[job.frame].flags & format::kFrameHeld) != 0;
  }

  std::shared_ptr<EncodedFrame> encode(const Job& job) {
    auto frame = std::make_shared<EncodedFrame>();
    frame->job = job;
    if (isHeld(job)) return frame;
    const PlannedVolume& volume = plan_.volumes[job.volume];
    frame->imported = importFrame(volume, volume.frames[job.frame], options_.import, warn_);
    for (const ImportedGrid& grid : frame->imported.grids) frame->contents.push_back(contentOf(grid));
    if (allKnown(*frame)) {
      frame->chosen.resize(volume.grids.size());
      return frame;
    }
    frame->chosen =
        chooseEncodings(frame->imported.grids, options_.quality, [&](std::size_t grid) { return where(job, grid); });
    return frame;
  }

  // Whether every grid of the frame was written before. What this saves is time only: write() decides by itself, in
  // frame order, so the bytes do not depend on when an earlier frame was done. A budget ties a frame's grids together,
  // so then nothing is taken from another frame.
  bool allKnown(const EncodedFrame& frame) {
    if (options_.quality.gpuBudget) return false;
    const std::lock_guard lock(mutex_);
    return std::all_of(frame.contents.begin(), frame.contents.end(),
                       [this](std::uint64_t content) { return written_.contains(content); });
  }

  void write(const EncodedFrame& frame) {
    const std::size_t grids = plan_.volumes[frame.job.volume].grids.size();
    const std::uint32_t firstReport = tables_.volumes[frame.job.volume].firstGrid;
    for (std::size_t g = 0; g < grids; ++g) {
      tables_.gridFrames.push_back(isHeld(frame.job) ? tables_.gridFrames[tables_.gridFrames.size() - grids]
                                                     : addGridFrame(frame, g));
      if (!isHeld(frame.job)) tally(frame, g, report_.grids[firstReport + g]);
    }
    ++done_;
    if (options_.progress) options_.progress(done_, jobs_.size());
  }

  format::GridFrame addGridFrame(const EncodedFrame& frame, std::size_t g) {
    const ImportedGrid& imported = frame.imported.grids[g];
    if (!imported.present) return absent();
    const std::uint64_t content = frame.contents[g];
    const std::lock_guard lock(mutex_);
    const auto before = written_.find(content);
    if (before != written_.end() && !options_.quality.gpuBudget) return again(before->second, imported);
    std::vector<std::uint32_t> pages;
    format::GridFrame record = sharer_.addGrid(imported, frame.chosen[g], where(frame.job, g), pages);
    record.flags = format::kGridPresent;
    record.pageListBegin = static_cast<std::uint32_t>(tables_.pageLists.size());
    record.pageListCount = static_cast<std::uint32_t>(pages.size());
    tables_.pageLists.insert(tables_.pageLists.end(), pages.begin(), pages.end());
    Written& entry = written_[content];
    entry.record = record;
    for (const ChosenBrick& brick : frame.chosen[g].bricks) {
      ++entry.encodings[brick.encoding].bricks;
      entry.encodings[brick.encoding].squaredError += brick.squaredError;
    }
    return record;
  }

  // The same tree and pages under this frame's transform.
  static format::GridFrame again(const Written& before, const ImportedGrid& imported) {
    format::GridFrame record = before.record;
    placeOrigin(imported.indexToWorld, record);
    return record;
  }

  static format::GridFrame absent() {
    format::GridFrame record{};
    record.node5 = format::kNone;
    for (int a = 0; a < 3; ++a) {
      record.activeMax[a] = -1;
      record.indexToWorld[5 * a] = 1;
    }
    return record;
  }

  void tally(const EncodedFrame& frame, std::size_t g, GridReport& report) const {
    const format::GridFrame& record = tables_.gridFrames.back();
    if ((record.flags & format::kGridPresent) == 0) return;
    ++report.frames;
    report.activeVoxels += record.activeVoxels;
    const auto& encodings = written_.at(frame.contents[g]).encodings;
    for (std::size_t e = 0; e < encodings.size(); ++e) {
      report.encodings[e].bricks += encodings[e].bricks;
      report.encodings[e].squaredError += encodings[e].squaredError;
    }
    report.worstPsnr = std::min(report.worstPsnr, format::psnr(record));
    report.maxError = std::max(report.maxError, record.maxError);
    report.largestFrameGpuBytes = std::max(report.largestFrameGpuBytes, format::gpuBytes(record).total());
  }

  const CompileOptions& options_;
  const Warn& warn_;
  Plan plan_;
  format::PackWriter writer_;
  Sharer sharer_;
  format::PackTables tables_;
  std::vector<Job> jobs_;
  std::uint32_t gridFrames_ = 0;
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, Written> written_;  // by content; some 300 bytes a grid and frame
  std::size_t done_ = 0;
  CompileReport report_;
};

}  // namespace

namespace {

// The rename at the end would put the pack in the source's place.
void refuseToReplaceInputs(const Plan& plan, const std::string& output) {
  for (const PlannedVolume& volume : plan.volumes) {
    for (const PlannedFrame& frame : volume.frames) {
      for (const std::string& file : frame.files) {
        std::error_code absent;
        if (!std::filesystem::equivalent(file, output, absent)) continue;
        throw Error(Fault::commandLine, output + ": is an input of this compile; give the pack another name");
      }
    }
  }
}

}  // namespace

CompileReport compile(const std::vector<std::string>& inputs, const std::string& output, const CompileOptions& options,
                      const Warn& warn) {
  std::optional<tbb::global_control> limit;
  if (options.threads != 0) limit.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  Plan plan = planInputs(inputs, options.import, warn);
  refuseToReplaceInputs(plan, output);
  CompileReport report = Compiler(output, options, warn, std::move(plan)).run();
  report.fileBytes = std::filesystem::file_size(output);
  return report;
}

}  // namespace billow::compiler
