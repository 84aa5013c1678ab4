#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/axis.h"
#include "report/charts.h"
#include "report/html.h"

namespace billow::command {
namespace {

constexpr double kWidth = 520, kHeight = 360;
constexpr double kLeft = 46, kRight = 508, kTop = 12, kBottom = 312;

bool drawable(const ReportFrame& frame) {
  return frame.bits() > 0 && std::isfinite(frame.row.psnr());
}

struct Window {
  double bitsLow = std::numeric_limits<double>::infinity(), bitsHigh = 0;
  double psnrLow = std::numeric_limits<double>::infinity(), psnrHigh = -psnrLow;

  void add(double bits, double psnr) {
    bitsLow = std::min(bitsLow, bits);
    bitsHigh = std::max(bitsHigh, bits);
    psnrLow = std::min(psnrLow, psnr);
    psnrHigh = std::max(psnrHigh, psnr);
  }
  bool empty() const { return bitsHigh <= 0; }
};

Window windowOf(const ReportGrid& grid) {
  Window window;
  for (const RateCurve& curve : grid.curves) {
    for (const RatePoint& point : curve.points) window.add(point.bits, point.psnr);
  }
  for (const ReportFrame& frame : grid.frames) {
    if (drawable(frame)) window.add(frame.bits(), frame.row.psnr());
  }
  return window;
}

class RateChart {
 public:
  RateChart(const ReportGrid& grid, std::string id, const Window& window) : grid_(grid), id_(std::move(id)) {
    bits_ = {window.bitsLow / 1.08, window.bitsHigh * 1.08, kLeft, kRight, true};
    const double low = 5 * std::floor((window.psnrLow - 1) / 5), high = 5 * std::ceil((window.psnrHigh + 1) / 5);
    psnr_ = {low, high, kBottom, kTop, false};
  }

  std::string draw() const {
    std::string svg = fmt::format(
        R"(<svg class="rate" viewBox="0 0 {} {}" role="img" aria-labelledby="{}t {}d"><title id="{}t">{}</title>)",
        kWidth, kHeight, id_, id_, id_, "Rate against distortion of " + escapeText(grid_.grid));
    svg += fmt::format(R"(<desc id="{}d">{}</desc>)", id_, description());
    svg += axes();
    for (const RateCurve& curve : grid_.curves) svg += line(curve);
    svg += dots();
    return svg + "</svg>\n";
  }

 private:
  std::string description() const {
    const ReportFrame& frame = grid_.frames[grid_.curveFrame];
    return fmt::format("Curves of frame {}. This pack: {:.2f} bits an active voxel, {}.", frame.row.frame, frame.bits(),
                       psnrText(frame.row.psnr()));
  }

  std::string axes() const {
    std::string svg = R"(<g class="axis">)";
    for (const double tick : evenTicks(psnr_.low, psnr_.high, 8)) {
      const double y = psnr_.place(tick);
      svg += chartLine(kLeft, y, kRight, y, "rule");
      svg += chartText(kLeft - 6, y + 4, "end", fmt::format("{:g}", tick));
    }
    for (const double tick : octaveTicks(bits_.low, bits_.high)) {
      const double x = bits_.place(tick);
      svg += chartLine(x, kTop, x, kBottom, "rule");
      svg += chartText(x, kBottom + 17, "middle", fmt::format("{:.3g}", tick));
    }
    svg += chartText((kLeft + kRight) / 2, kHeight - 8, "middle", "bits an active voxel, GPU bytes all included");
    svg +=
        fmt::format(R"svg(<text transform="translate(13 {:.1f}) rotate(-90)" text-anchor="middle">PSNR, dB</text>)svg",
                    (kTop + kBottom) / 2);
    return svg + "</g>";
  }

  std::string line(const RateCurve& curve) const {
    if (curve.points.empty()) return "";
    std::string places;
    std::string marks;
    for (const RatePoint& point : curve.points) {
      const double x = bits_.place(point.bits), y = psnr_.place(point.psnr);
      places += fmt::format("{}{:.1f},{:.1f}", places.empty() ? "" : " ", x, y);
      marks += fmt::format(
          R"(<circle{} cx="{:.1f}" cy="{:.1f}" r="3.5"><title>{}: {:.2f} bits, {:.2f} dB</title></circle>)",
          curve.points.size() == 1 ? R"( class="only")" : "", x, y, escapeText(curve.name), point.bits, point.psnr);
    }
    return fmt::format(R"(<g class="curve {}" data-curve="{}" data-encodings="{}"><polyline points="{}"/>{}</g>)",
                       curve.colour, escapeText(curve.name), curve.encodings, places, marks);
  }

  std::string dots() const {
    std::string svg;
    for (std::size_t f = 0; f < grid_.frames.size(); ++f) {
      if (f != grid_.curveFrame && drawable(grid_.frames[f])) svg += dot(grid_.frames[f], "frame", 2.6);
    }
    const ReportFrame& measured = grid_.frames[grid_.curveFrame];
    if (drawable(measured)) svg += dot(measured, "pack", 6);
    return svg;
  }

  std::string dot(const ReportFrame& frame, const char* kind, double radius) const {
    return fmt::format(
        R"(<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="{}"><title>this pack, frame {}: {:.2f} bits, {}</title></circle>)",
        kind, bits_.place(frame.bits()), psnr_.place(frame.row.psnr()), radius, frame.row.frame, frame.bits(),
        psnrText(frame.row.psnr()));
  }

  const ReportGrid& grid_;
  std::string id_;
  Axis bits_, psnr_;
};

}  // namespace

std::string rateChart(const ReportGrid& grid, const std::string& id) {
  const Window window = windowOf(grid);
  return window.empty() ? "" : RateChart(grid, id, window).draw();
}

}  // namespace billow::command
