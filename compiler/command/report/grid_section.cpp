#include <fmt/format.h>

#include <algorithm>

#include "report/brick_image.h"
#include "report/charts.h"
#include "report/encodings.h"
#include "report/html.h"
#include "report/page.h"

namespace billow::command {
namespace {

std::string swatch(const std::string& colour) {
  if (colour == "pack") {
    return R"(<svg class="swatch" viewBox="0 0 26 10" aria-hidden="true"><circle class="pack" cx="13" cy="5" r="5"/></svg>)";
  }
  return fmt::format(
      R"(<svg class="swatch" viewBox="0 0 26 10" aria-hidden="true"><g class="curve {}"><polyline points="0,5 26,5"/></g></svg>)",
      colour);
}

std::string costRow(const RateCurve& curve, double packBits) {
  std::string row = fmt::format(R"(<tr data-curve="{}"><td>{}{}</td>)", escapeText(curve.name), swatch(curve.colour),
                                escapeText(curve.name));
  if (!curve.bits) return row + R"(<td class="note" colspan="2">out of reach</td></tr>)";
  return row + fmt::format("<td>{:.2f}</td><td>{:.2f}</td></tr>", *curve.bits, *curve.bits / packBits);
}

// Cheapest first, then those out of reach.
std::vector<const RateCurve*> byCost(const std::vector<RateCurve>& curves) {
  std::vector<const RateCurve*> order;
  order.reserve(curves.size());
  for (const RateCurve& curve : curves) order.push_back(&curve);
  std::stable_sort(order.begin(), order.end(),
                   [](const RateCurve* a, const RateCurve* b) { return a->bits && (!b->bits || *a->bits < *b->bits); });
  return order;
}

// The chart's legend, and what each encoding alone would cost at the pack's error.
std::string costTable(const ReportGrid& grid) {
  const ReportFrame& frame = grid.frames[grid.curveFrame];
  if (frame.bits() == 0) return "";
  std::string table = fmt::format(
      R"(<table><caption>At this pack's own error, frame {}: {}</caption><thead><tr><th>encoding</th><th>bits a voxel</th><th>× this pack</th></tr></thead><tbody>)",
      frame.row.frame, psnrText(frame.row.psnr()));
  table += fmt::format(R"(<tr class="ours"><td>{}this pack</td><td>{:.2f}</td><td>1.00</td></tr>)", swatch("pack"),
                       frame.bits());
  for (const RateCurve* curve : byCost(grid.curves)) table += costRow(*curve, frame.bits());
  return table + "</tbody></table>\n";
}

std::string curvesCard(const ReportGrid& grid, std::size_t number, int effort) {
  const ReportFrame& frame = grid.frames[grid.curveFrame];
  const std::string chart = rateChart(grid, fmt::format("rate{}", number));
  std::string card = R"(<div class="card"><h3>Rate and distortion</h3>)";
  card += chart.empty() ? R"(<p class="note">Nothing differs, so there is no distortion to draw.</p>)" : chart;
  card += costTable(grid);
  return card +
         fmt::format(
             R"(<p class="note">Curves: frame {}, the grid's worst; each encoding alone, with as many bits as a brick needs, beside constant bricks; and the mix that --psnr chooses (without local bricks, which only --gpu-budget takes). BC7 at effort {}. Counted are index and headers as this pack has them, payloads and masks before equal ones are shared, and no limit on single voxels holds; the pack's own points (small dots: its other frames) count what it holds.</p></div>)",
             frame.row.frame, effort);
}

std::string scaleBar(const std::string& gradient, const std::string& low, const std::string& high) {
  return fmt::format(R"(<div class="scale"><i style="background:{}"></i><span>{}</span><span>{}</span></div>)",
                     gradient, low, high);
}

std::string brickFigure(const WorstBrick& brick) {
  const BrickImage image = drawBrick(brick);
  const auto& o = brick.origin;
  const std::int64_t z = std::int64_t{o[2]} + (brick.worstVoxel & 7);
  std::string figure =
      R"(<figure class="brick"><div class="heads"><span>source</span><span>pack</span><span>difference</span></div>)";
  figure += fmt::format(R"(<img src="{}" width="26" height="8" alt="Slice z = {}: source, pack, difference"/>)",
                        image.slice, z);
  figure += fmt::format(
      R"(<img src="{}" width="71" height="26" alt="All eight slices, z = {} to {}: source, pack, difference"/>)",
      image.slices, o[2], std::int64_t{o[2]} + 7);
  figure += R"(<div class="scales">)" +
            scaleBar(valueGradient(), fmt::format("{:.4g}", image.low), fmt::format("{:.4g}", image.high)) +
            scaleBar(differenceGradient(), fmt::format("\xe2\x88\x92{:.2g}", image.difference),
                     fmt::format("+{:.2g}", image.difference)) +
            "</div>";
  return figure +
         fmt::format(
             R"(<figcaption><b>{:.2f} % of the range</b> RMSE; largest error {:.4g}<br/>frame {}, voxels from ({}, {}, {}), slice z = {}<br/>{}, {} active voxels</figcaption></figure>)",
             brick.relativeRmse * 100, brick.maxError, brick.frame, o[0], o[1], o[2], z, encodingName(brick.encoding),
             brick.activeVoxels);
}

std::string bricksCard(const ReportGrid& grid) {
  std::string card = R"(<div class="card"><h3>Worst bricks</h3>)";
  if (grid.worst.empty()) return card + R"(<p class="note">Every brick is exact.</p></div>)";
  card += R"(<div class="bricks">)";
  for (const WorstBrick& brick : grid.worst) card += brickFigure(brick);
  return card +
         R"(</div><p class="note">Above: the z slice of the largest error, x to the right, y up. Below: all eight slices. Source and pack share one colour scale; grey voxels are inactive.</p></div>)";
}

}  // namespace

std::string gridSection(const ReportGrid& grid, std::size_t number, int effort) {
  return fmt::format(R"(<section class="grid" aria-labelledby="grid{}"><h2 id="grid{}">{} / {}</h2><div class="pair">)",
                     number, number, nameElement(grid.volume), nameElement(grid.grid)) +
         curvesCard(grid, number, effort) + bricksCard(grid) + "</div></section>\n";
}

}  // namespace billow::command
