#include "report/collect.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <unordered_set>
#include <utility>

#include "choose/choose.h"
#include "import_options.h"
#include "report/encodings.h"
#include "report/rate_curves.h"
#include "report/worst_bricks.h"

namespace billow::command {
namespace {

// Only the bricks are counted here, by encoding; all the rest is the pack's own account.
KindBytes countBytes(const format::GridView& view) {
  KindBytes bytes;
  bytes.bricks.resize(encodingFamilies().size() + 1);
  std::unordered_set<std::uint32_t> seen;
  std::uint64_t sum = 0;
  for (const format::GridView::Leaf& leaf : view.leaves()) {
    const std::uint32_t encoding = format::encodingOf(leaf.node);
    const std::uint32_t size = format::brickBytes(encoding).value_or(0);
    if (size == 0 || !seen.insert(leaf.node.brick).second) continue;
    bytes.bricks[familyOf(encoding)] += size;
    sum += size;
  }
  const format::GpuBytes gpu = format::gpuBytes(view.frame());
  bytes.index = gpu.indexBytes;
  bytes.masks = gpu.maskBytes;
  bytes.headers = gpu.total() - gpu.indexBytes - gpu.maskBytes - sum;
  return bytes;
}

// What the pack says it was compiled with, else the compiler's default.
int effortOf(const format::Pack& pack) {
  const int standard = compiler::Quality{}.effort;
  const auto text = pack.infoJson();
  if (!text) return standard;
  const auto info = nlohmann::json::parse(*text, nullptr, false);
  const auto at = nlohmann::json::json_pointer("/quality/effort");
  if (!info.is_object() || !info.contains(at) || !info.at(at).is_number_integer()) return standard;
  return static_cast<int>(std::clamp<std::int64_t>(info.at(at).get<std::int64_t>(), 0, 9));
}

std::vector<std::pair<std::string, std::uint64_t>> unpackedBytes(const format::Pack& pack) {
  constexpr const char* kNames[] = {"bricks", "masks", "Node5", "Node4", "brick headers", "child lists"};
  std::vector<std::pair<std::string, std::uint64_t>> result;
  for (std::uint32_t s = 0; s < format::kStreamCount; ++s) {
    std::uint64_t bytes = 0;
    for (const format::PageRecord& page : pack.pages()) {
      bytes += std::uint64_t{page.streams[s].count} * format::kStreamItemBytes[s];
    }
    result.emplace_back(s < std::size(kNames) ? kNames[s] : fmt::format("stream {}", s), bytes);
  }
  return result;
}

// The frame that a grid's curves are measured on, as an index into its frames.
std::size_t curveFrame(const ReportGrid& grid) {
  const auto worse = [](const ReportFrame& a, const ReportFrame& b) {
    if (a.row.psnr() != b.row.psnr()) return a.row.psnr() < b.row.psnr();
    return a.row.error.sourceVoxels > b.row.error.sourceVoxels;
  };
  return static_cast<std::size_t>(std::min_element(grid.frames.begin(), grid.frames.end(), worse) -
                                  grid.frames.begin());
}

}  // namespace

ReportCollector::ReportCollector(const format::Pack& pack, std::string path, std::vector<std::string> inputs)
    : pack_(pack), pageSeen_(pack.pages().size()), pageInFrame_(pack.pages().size()) {
  data_.pack = std::move(path);
  data_.inputs = std::move(inputs);
  data_.fileBytes = pack.fileSize();
  for (const format::PageRecord& page : pack.pages()) data_.pageBytes += page.storedSize;
  data_.unpackedBytes = unpackedBytes(pack);
  data_.packFrames = pack.frames().size();
  data_.effort = effortOf(pack);
}

ReportGrid& ReportCollector::gridOf(const GridRow& row) {
  for (ReportGrid& grid : data_.grids) {
    if (grid.volume == row.volume && grid.grid == row.grid) return grid;
  }
  ReportGrid& grid = data_.grids.emplace_back();
  grid.volume = row.volume;
  grid.grid = row.grid;
  return grid;
}

void ReportCollector::addDisk(const GridRow& row, const format::GridFrame& gridFrame) {
  if (data_.disk.empty() || data_.disk.back().frame != row.frame || data_.disk.back().volume != row.volume) {
    data_.disk.push_back({row.volume, row.frame, 0, 0});
    std::fill(pageInFrame_.begin(), pageInFrame_.end(), std::uint8_t{0});
  }
  for (const std::uint32_t page : pack_.pagesOf(gridFrame)) {
    if (std::exchange(pageInFrame_[page], std::uint8_t{1}) != 0) continue;
    data_.disk.back().all += pack_.pages()[page].storedSize;
    if (std::exchange(pageSeen_[page], std::uint8_t{1}) != 0) continue;
    data_.disk.back().first += pack_.pages()[page].storedSize;
  }
}

void ReportCollector::observe(const ComparedGrid& compared) {
  ReportGrid& grid = gridOf(compared.row);
  grid.frames.push_back({compared.row, countBytes(compared.view)});
  addDisk(compared.row, compared.view.frame());
  keepWorstBricks(compared, grid.worst);
}

ReportData ReportCollector::finish(std::span<const GridRow> rows, const compiler::Plan& plan,
                                   const compiler::ImportOptions& options) {
  for (const GridRow& row : rows) {
    if (!row.sound()) data_.problems.push_back(row);
  }
  for (ReportGrid& grid : data_.grids) grid.curveFrame = curveFrame(grid);
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    for (const compiler::PlannedFrame& frame : volume.frames) {
      std::optional<compiler::ImportedFrame> source;
      for (ReportGrid& grid : data_.grids) {
        const ReportFrame& measured = grid.frames[grid.curveFrame];
        if (grid.volume != volume.name || measured.row.frame != frame.number) continue;
        if (!source) source = compiler::importFrame(volume, frame, options, printWarning);
        for (std::size_t g = 0; g < volume.grids.size(); ++g) {
          if (volume.grids[g].name != grid.grid) continue;
          grid.curves = measureCurves(source->grids[g], measured, data_.effort);
        }
      }
    }
  }
  return std::move(data_);
}

}  // namespace billow::command
