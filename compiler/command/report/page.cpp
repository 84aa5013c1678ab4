#include "report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "report/html.h"

namespace billow::command {
namespace {

constexpr std::size_t kInputsShown = 4;
constexpr std::size_t kProblemsShown = 20;

std::string tile(const std::string& term, const std::string& figure, const std::string& more) {
  return fmt::format("<div><dt>{}</dt><dd><b>{}</b>{}</dd></div>", term, figure, more);
}

const GridRow* worstRow(const ReportData& data) {
  const GridRow* worst = nullptr;
  for (const ReportGrid& grid : data.grids) {
    for (const ReportFrame& frame : grid.frames) {
      if (worst == nullptr || frame.row.psnr() < worst->psnr()) worst = &frame.row;
    }
  }
  return worst;
}

struct GpuTotals {
  std::uint64_t bytes = 0, voxels = 0;  // over all grids and frames
  std::uint64_t largest = 0;            // of a frame, its grids together
  std::int32_t largestFrame = 0;
};

GpuTotals gpuTotals(const ReportData& data) {
  GpuTotals totals;
  std::map<std::pair<std::string, std::int32_t>, std::uint64_t> frames;
  for (const ReportGrid& grid : data.grids) {
    for (const ReportFrame& frame : grid.frames) {
      totals.bytes += frame.gpu.total();
      totals.voxels += frame.row.error.sourceVoxels;
      frames[{grid.volume, frame.row.frame}] += frame.gpu.total();
    }
  }
  for (const auto& [key, bytes] : frames) {
    if (bytes <= totals.largest) continue;
    totals.largest = bytes;
    totals.largestFrame = key.second;
  }
  return totals;
}

std::string summary(const ReportData& data) {
  const GpuTotals gpu = gpuTotals(data);
  std::string html = R"(<dl class="tiles">)";
  if (const GridRow* worst = worstRow(data)) {
    html += tile("worst PSNR", psnrText(worst->psnr()),
                 fmt::format("{}, frame {}", nameElement(worst->grid), worst->frame));
  }
  html += tile("on disk", byteText(static_cast<double>(data.fileBytes)), "the whole pack");
  html += tile("on the GPU, at most", byteText(static_cast<double>(gpu.largest)),
               fmt::format("frame {}, all grids", gpu.largestFrame));
  const double bits = gpu.voxels == 0 ? 0 : static_cast<double>(gpu.bytes) * 8 / static_cast<double>(gpu.voxels);
  html += tile("bits an active voxel", fmt::format("{:.2f}", bits),
               fmt::format("on the GPU, all included; {} in all frames", byteText(static_cast<double>(gpu.bytes))));
  html += tile("frames compared", countText(data.disk.size()), fmt::format("of {} in the pack", data.packFrames));
  html +=
      tile("grids", countText(data.grids.size()), fmt::format("{} active voxels in all frames", countText(gpu.voxels)));
  return html + "</dl>";
}

std::string inputsText(const ReportData& data) {
  std::string text;
  for (std::size_t i = 0; i < std::min(data.inputs.size(), kInputsShown); ++i) {
    text += (i == 0 ? "" : ", ") + nameElement(data.inputs[i]);
  }
  if (data.inputs.size() > kInputsShown) text += fmt::format(" and {} more", data.inputs.size() - kInputsShown);
  return text;
}

std::string problemText(const GridRow& row) {
  std::string where = nameElement(row.volume);
  if (!row.grid.empty()) where += " / " + nameElement(row.grid);
  where += fmt::format(", frame {}: ", row.frame);
  if (!row.problem.empty()) return where + escapeText(row.problem);
  return where + fmt::format("{} voxels are active in one of the two only", countText(row.error.mismatchedVoxels));
}

std::string problems(const ReportData& data) {
  const auto bad = std::ranges::count_if(data.effects, [](const EffectRow& row) { return !row.sound(); });
  if (data.problems.empty() && bad == 0) return "";
  std::string html = R"(<section class="bad" role="alert"><h2>The pack does not hold what the source holds</h2><ul>)";
  for (std::size_t i = 0; i < std::min(data.problems.size(), kProblemsShown); ++i) {
    html += "<li>" + problemText(data.problems[i]) + "</li>";
  }
  if (data.problems.size() > kProblemsShown) {
    html += fmt::format("<li>and {} more</li>", data.problems.size() - kProblemsShown);
  }
  if (bad > 0) html += fmt::format("<li>{} parts of effects: see below</li>", bad);
  return html + "</ul></section>\n";
}

// A cell that sorts by `value`.
std::string cell(const std::string& text, double value) {
  if (std::isinf(value)) value = std::copysign(std::numeric_limits<double>::max(), value);
  return fmt::format(R"(<td data-value="{}">{}</td>)", value, text);
}

std::string tableRow(const ReportGrid& grid, std::size_t number, const ReportFrame& frame) {
  const GridRow& row = frame.row;
  const auto voxels = static_cast<double>(row.error.sourceVoxels);
  const auto bytes = static_cast<double>(frame.gpu.total());
  return fmt::format(R"(<tr{}>)", row.sound() ? "" : R"( class="bad")") +
         cell(nameElement(grid.volume) + " / " + nameElement(grid.grid), static_cast<double>(number)) +
         cell(fmt::format("{}", row.frame), row.frame) + cell(psnrText(row.psnr()), row.psnr()) +
         cell(fmt::format("{:.4g}", row.error.rmse()), row.error.rmse()) +
         cell(fmt::format("{:.4g}", row.error.maxError), row.error.maxError) +
         cell(row.range > 0 ? fmt::format("{:.2f}", row.error.maxError / row.range * 100) : "",
              row.range > 0 ? row.error.maxError / row.range : 0) +
         cell(countText(row.error.sourceVoxels), voxels) + cell(byteText(bytes), bytes) +
         cell(fmt::format("{:.2f}", frame.bits()), frame.bits()) + "</tr>\n";
}

}  // namespace

std::string tableSection(const ReportData& data) {
  std::string html =
      R"(<section aria-labelledby="table"><h2 id="table">Every grid and frame</h2><div class="card scroll" tabindex="0" role="region" aria-labelledby="table"><table class="frames"><thead><tr>)";
  for (const char* name :
       {"grid", "frame", "PSNR", "RMSE", "max error", "% of range", "active voxels", "on the GPU", "bits a voxel"}) {
    html += fmt::format(R"(<th scope="col"><button type="button">{}</button></th>)", name);
  }
  html += "</tr></thead><tbody>\n";
  for (std::size_t g = 0; g < data.grids.size(); ++g) {
    for (const ReportFrame& frame : data.grids[g].frames) html += tableRow(data.grids[g], g, frame);
  }
  return html +
         R"(</tbody></table></div><p class="note">PSNR is 20 log10((max − min) / RMSE) over active voxels; max and min are the source's, background included. Errors are in the grid's own unit.</p></section>)";
}

std::string renderPage(const ReportData& data) {
  std::string html = R"(<!DOCTYPE html>
<html xmlns="http://www.w3.org/1999/xhtml" lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"/>
)";
  html += fmt::format("<title>{} against its source</title>\n<style>", escapeText(data.pack));
  html += pageStyle();
  html += fmt::format("</style>\n</head>\n<body>\n<header><h1>{} against its source</h1>", nameElement(data.pack));
  html += fmt::format(R"(<p class="note">Source: {}</p>)", inputsText(data));
  html += summary(data) + "</header>\n<main>\n" + problems(data);
  for (std::size_t g = 0; g < data.grids.size(); ++g) html += gridSection(data.grids[g], g, data.effort);
  html += bytesSection(data) + tableSection(data) + effectsSection(data) + "</main>\n<script>";
  html += pageScript();
  return html + "</script>\n</body>\n</html>\n";
}

}  // namespace billow::command
