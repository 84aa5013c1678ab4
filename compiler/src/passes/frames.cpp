#include "passes/frames.h"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>

#include <array>
#include <set>
#include <span>

#include "level/coarsen.h"

namespace billow::compiler {
namespace {

// Frames in the pipeline at once: one on its way in, one being tried, while another is consumed.
constexpr std::size_t kFramesInFlight = 2;

static_assert(sizeof(Tile) == 20, "Tile has no padding that a hash would meet");

using FramePtr = std::shared_ptr<FrameWork>;

// Of a level, apart from all full volumes' and from other levels of equal ones.
Hash128 contentOf(const Hash128& content, const Hash128& source, std::uint32_t level) {
  const std::array<std::uint64_t, 5> parts{content[0], content[1], source[0], source[1], level};
  return hashOf(std::as_bytes(std::span(parts)));
}

Hash128 contentOf(const ImportedGrid& grid, const std::vector<LeafKey>& keys) {
  static_assert(sizeof(LeafKey) == 32);  // 4 of padding, left out here
  std::vector<std::byte> bytes;
  bytes.reserve(16 + keys.size() * 28 + grid.tiles.size() * sizeof(Tile));
  const auto add = [&](const auto* items, std::size_t count) {
    const std::span<const std::byte> more = std::as_bytes(std::span(items, count));
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  const std::uint64_t leaves = keys.size();
  add(&leaves, 1);
  add(&grid.background, 1);
  for (const LeafKey& key : keys) {
    add(key.origin.data(), key.origin.size());
    add(key.hash.data(), key.hash.size());
  }
  add(grid.tiles.data(), grid.tiles.size());
  return hashOf(bytes);
}

class Pipeline {
 public:
  explicit Pipeline(const FrameRun& run) : run_(run) {
    for (std::size_t v = 0; v < run.plan.volumes.size(); ++v) {
      for (std::size_t f = 0; f < run.plan.volumes[v].frames.size(); ++f) jobs_.push_back({v, f});
    }
  }

  void run() {
    constexpr auto kInOrder = tbb::filter_mode::serial_in_order;
    constexpr auto kParallel = tbb::filter_mode::parallel;
    std::size_t next = 0;
    tbb::parallel_pipeline(
        kFramesInFlight,
        tbb::make_filter<void, Job>(kInOrder,
                                    [&](tbb::flow_control& control) {
                                      if (next == jobs_.size()) control.stop();
                                      return next == jobs_.size() ? Job{} : jobs_[next++];
                                    }) &
            tbb::make_filter<Job, FramePtr>(kParallel, [this](const Job& job) { return import(job); }) &
            tbb::make_filter<FramePtr, FramePtr>(kInOrder, [this](const FramePtr& frame) { return match(frame); }) &
            tbb::make_filter<FramePtr, FramePtr>(kParallel, [this](const FramePtr& frame) { return tryGrids(frame); }) &
            tbb::make_filter<FramePtr, void>(kInOrder, [this](const FramePtr& frame) { run_.consume(*frame); }));
  }

 private:
  FramePtr import(const Job& job) const {
    auto frame = std::make_shared<FrameWork>();
    frame->job = job;
    const PlannedVolume& volume = run_.plan.volumes[job.volume];
    frame->held = (volume.frames[job.frame].flags & format::kFrameHeld) != 0;
    if (frame->held) return frame;
    // The full volume's frames have told what there is to tell.
    const Warn silent = [](const std::string&) {};
    frame->imported =
        importFrame(volume, volume.frames[job.frame], run_.import, volume.level == 0 ? run_.warn : silent);
    if (volume.level != 0) coarsenFrame(volume.level, *frame);
    for (std::size_t g = 0; g < frame->imported.grids.size(); ++g) {
      const ImportedGrid& grid = frame->imported.grids[g];
      GridWork& work = frame->grids.emplace_back();
      work.keys = leafKeys(grid);
      work.content = contentOf(grid, work.keys);
      if (volume.level == 0) continue;
      const ImportedGrid& source = frame->source.grids[g];
      work.content = contentOf(work.content, contentOf(source, leafKeys(source)), volume.level);
    }
    return frame;
  }

  static void coarsenFrame(std::uint32_t level, FrameWork& frame) {
    frame.source = std::move(frame.imported);
    frame.imported.grids.clear();
    for (const ImportedGrid& grid : frame.source.grids) frame.imported.grids.push_back(coarsen(grid, level));
  }

  // Cheap, so it may be serial: then what is tried does not depend on how far other frames are.
  FramePtr match(const FramePtr& frame) {
    if (frame->job.frame == 0) before_.assign(frame->grids.size(), {});
    for (std::size_t g = 0; g < frame->grids.size(); ++g) {
      GridWork& work = frame->grids[g];
      work.isNew = frame->imported.grids[g].present && contents_.insert(work.content).second;
      if (!work.isNew) continue;
      work.unchanged = unchangedLeaves(before_[g], work.keys);
      before_[g] = work.keys;
    }
    return frame;
  }

  FramePtr tryGrids(const FramePtr& frame) const {
    for (std::size_t g = 0; g < frame->grids.size(); ++g) {
      GridWork& work = frame->grids[g];
      const ImportedGrid& grid = frame->imported.grids[g];
      if (!work.isNew || grid.leaves.empty()) continue;
      work.goal = run_.goal(frame->job, g, grid);
      work.trials = std::make_unique<GridTrials>(grid, *work.goal, run_.effort, work.unchanged);
    }
    return frame;
  }

  const FrameRun& run_;
  std::vector<Job> jobs_;
  std::set<Hash128> contents_;                // of every grid frame so far
  std::vector<std::vector<LeafKey>> before_;  // by grid of the volume: the last new content
};

}  // namespace

void runFrames(const FrameRun& run) {
  Pipeline(run).run();
}

std::string whereIs(const Plan& plan, const Job& job, std::size_t grid) {
  const PlannedVolume& volume = plan.volumes[job.volume];
  const PlannedFrame& frame = volume.frames[job.frame];
  return fmt::format("{}: frame {}: grid '{}'", frame.files.empty() ? volume.name : frame.files.front(), frame.number,
                     volume.grids[grid].name);
}

std::size_t frameCount(const Plan& plan) {
  std::size_t count = 0;
  for (const PlannedVolume& volume : plan.volumes) count += volume.frames.size();
  return count;
}

}  // namespace billow::compiler
