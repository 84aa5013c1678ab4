#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "report/charts.h"
#include "report/encodings.h"
#include "report/html.h"
#include "report/page.h"

namespace billow::command {
namespace {

// Kinds of GPU bytes, from what a brick holds to what finds it.
std::vector<Series> gpuSeries() {
  std::vector<Series> series;
  for (std::size_t f = 0; f < encodingFamilies().size(); ++f) {
    series.push_back({std::string(encodingFamilies()[f].name) + " bricks", fmt::format("c{}", f)});
  }
  series.push_back({"other bricks", "c11"});
  series.push_back({"masks", "cm"});
  series.push_back({"brick headers", "ch"});
  series.push_back({"index", "ci"});
  return series;
}

std::vector<std::uint64_t> gpuValues(const KindBytes& bytes) {
  std::vector<std::uint64_t> values = bytes.bricks;
  values.insert(values.end(), {bytes.masks, bytes.headers, bytes.index});
  return values;
}

void add(std::vector<std::uint64_t>& sum, const std::vector<std::uint64_t>& values) {
  sum.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) sum[i] += values[i];
}

std::uint64_t total(const std::vector<std::uint64_t>& values) {
  std::uint64_t sum = 0;
  for (const std::uint64_t value : values) sum += value;
  return sum;
}

// Only what occurs in `values`.
std::string legend(const std::vector<Series>& series, const std::vector<std::uint64_t>& values) {
  std::string list = R"(<ul class="legend">)";
  for (std::size_t s = 0; s < series.size(); ++s) {
    if (values[s] == 0) continue;
    list += fmt::format(
        R"(<li><svg class="swatch {}" viewBox="0 0 12 12" aria-hidden="true"><rect width="12" height="12"/></svg>{}</li>)",
        series[s].colour, escapeText(series[s].name));
  }
  return list + "</ul>";
}

std::string barRow(const std::string& label, const std::string& figure, const std::string& bar) {
  return fmt::format(R"(<div><p><span>{}</span><span>{}</span></p>{}</div>)", label, figure, bar);
}

struct GridTotal {
  const ReportGrid* grid;
  std::vector<std::uint64_t> bytes;
  std::uint64_t voxels = 0;
};

std::string gpuCard(const ReportData& data, const std::vector<Series>& series) {
  std::vector<GridTotal> totals;
  std::vector<std::uint64_t> all(series.size());
  std::uint64_t most = 1;
  for (const ReportGrid& grid : data.grids) {
    GridTotal sum{&grid, std::vector<std::uint64_t>(series.size())};
    for (const ReportFrame& frame : grid.frames) {
      add(sum.bytes, gpuValues(frame.gpu));
      sum.voxels += frame.row.error.sourceVoxels;
    }
    add(all, sum.bytes);
    most = std::max(most, total(sum.bytes));
    totals.push_back(std::move(sum));
  }
  std::string card =
      R"(<div class="card"><h3>On the GPU, by kind</h3>)" + legend(series, all) + R"(<div class="bars">)";
  for (const GridTotal& sum : totals) {
    const auto bytes = static_cast<double>(total(sum.bytes));
    const std::string bits =
        sum.voxels == 0 ? "" : fmt::format(", {:.2f} bits a voxel", bytes * 8 / static_cast<double>(sum.voxels));
    card += barRow(nameElement(sum.grid->volume) + " / " + nameElement(sum.grid->grid), byteText(bytes) + bits,
                   stackedBar(sum.grid->grid, series, sum.bytes, most));
  }
  return card +
         R"(</div><p class="note">Each frame's bytes as if it were alone on the GPU, summed over the frames compared.</p></div>)";
}

// Of the pages' streams, in their order; none of them an encoding's that the other bars show.
constexpr const char* kStreamColours[] = {"c5", "cm", "c6", "c10", "ch", "c8"};

std::string diskCard(const ReportData& data) {
  const std::vector<Series> stored{{"pages, compressed", "c7"}, {"tables", "ci"}};
  const std::vector<std::uint64_t> storedBytes{data.pageBytes, data.fileBytes - data.pageBytes};
  std::vector<Series> unpacked;
  std::vector<std::uint64_t> unpackedBytes;
  for (const auto& [name, bytes] : data.unpackedBytes) {
    unpacked.push_back({name, unpacked.size() < std::size(kStreamColours) ? kStreamColours[unpacked.size()] : "c11"});
    unpackedBytes.push_back(bytes);
  }
  const std::uint64_t scale = std::max({total(storedBytes), total(unpackedBytes), std::uint64_t{1}});
  std::vector<Series> all = stored;
  all.insert(all.end(), unpacked.begin(), unpacked.end());
  std::vector<std::uint64_t> allBytes = storedBytes;
  allBytes.insert(allBytes.end(), unpackedBytes.begin(), unpackedBytes.end());
  return R"(<div class="card"><h3>On disk</h3>)" + legend(all, allBytes) + R"(<div class="bars">)" +
         barRow("the file", byteText(static_cast<double>(data.fileBytes)),
                stackedBar("the file", stored, storedBytes, scale)) +
         barRow("its pages unpacked", byteText(static_cast<double>(total(unpackedBytes))),
                stackedBar("its pages unpacked", unpacked, unpackedBytes, scale)) +
         R"(</div><p class="note">The whole pack; what frames and grids share is in it once.</p></div>)";
}

using FrameKey = std::pair<std::string, std::int32_t>;

std::string framesPair(const ReportData& data, const std::string& volume, const std::vector<Series>& series,
                       const std::map<FrameKey, std::vector<std::uint64_t>>& gpu) {
  std::vector<Column> onGpu, onDisk;
  for (const FrameDisk& frame : data.disk) {
    if (frame.volume != volume) continue;
    onGpu.push_back({frame.frame, gpu.at({volume, frame.frame})});
    onDisk.push_back({frame.frame, {frame.first, frame.all - frame.first}});
  }
  const std::vector<Series> disk{{"first needed here", "c7"}, {"shared with an earlier frame", "cm"}};
  std::string html = fmt::format(R"(<div class="card"><h3>On the GPU, by frame: {}</h3>)", nameElement(volume));
  html += columnChart("GPU bytes by frame of " + volume, series, onGpu);
  html += R"(<p class="note">All grids of the frame together; colours as above.</p></div>)";
  html += fmt::format(R"(<div class="card"><h3>On disk, by frame: {}</h3>)", nameElement(volume));
  html += legend(disk, {1, 1}) + columnChart("Disk bytes by frame of " + volume, disk, onDisk);
  return html + R"(<p class="note">Compressed pages that the frame needs.</p></div>)";
}

}  // namespace

std::string bytesSection(const ReportData& data) {
  const std::vector<Series> series = gpuSeries();
  std::map<FrameKey, std::vector<std::uint64_t>> gpu;
  for (const ReportGrid& grid : data.grids) {
    for (const ReportFrame& frame : grid.frames) add(gpu[{grid.volume, frame.row.frame}], gpuValues(frame.gpu));
  }
  std::string html = R"(<section aria-labelledby="bytes"><h2 id="bytes">Bytes</h2><div class="pair even">)" +
                     gpuCard(data, series) + diskCard(data);
  std::string volume;
  for (std::size_t i = 0; i < data.disk.size(); ++i) {
    if (i > 0 && data.disk[i].volume == volume) continue;
    volume = data.disk[i].volume;
    html += framesPair(data, volume, series, gpu);
  }
  return html + "</div></section>\n";
}

}  // namespace billow::command
