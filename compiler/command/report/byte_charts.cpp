#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "report/axis.h"
#include "report/charts.h"
#include "report/html.h"

namespace billow::command {
namespace {

constexpr double kWidth = 520, kHeight = 240;
constexpr double kLeft = 84, kRight = 514, kTop = 12, kBottom = 194;

std::uint64_t sum(std::span<const std::uint64_t> bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
}

std::string partsText(std::span<const Series> series, std::span<const std::uint64_t> bytes) {
  std::string text;
  for (std::size_t s = 0; s < series.size(); ++s) {
    if (bytes[s] == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", series[s].name, byteText(static_cast<double>(bytes[s])));
  }
  return text;
}

std::string tickText(double bytes) {
  const double unit = bytes >= 1e9 ? 1e9 : bytes >= 1e6 ? 1e6 : bytes >= 1e3 ? 1e3 : 1;
  return fmt::format("{:g} {}", bytes / unit, unit >= 1e9 ? "GB" : unit >= 1e6 ? "MB" : unit >= 1e3 ? "kB" : "B");
}

class ColumnChart {
 public:
  ColumnChart(std::span<const Series> series, std::span<const Column> columns) : series_(series), columns_(columns) {
    std::uint64_t most = 1;
    for (const Column& column : columns) most = std::max(most, sum(column.bytes));
    bytes_ = {0, static_cast<double>(most), kBottom, kTop, false};
    pitch_ = (kRight - kLeft) / static_cast<double>(columns.size());
    // Few frames are narrow columns; many have no gaps, and overlap a little so that rounding leaves none.
    dense_ = pitch_ < 5;
    width_ = std::min(dense_ ? pitch_ + 0.3 : pitch_ - 1.5, 40.0);
  }

  std::string draw(const std::string& title) const {
    std::string svg = fmt::format(R"(<svg class="columns{}" viewBox="0 0 {} {}" role="img"><title>{}</title>)",
                                  dense_ ? " dense" : "", kWidth, kHeight, escapeText(title));
    svg += R"(<g class="axis">)";
    for (const double tick : evenTicks(bytes_.low, bytes_.high, 4)) {
      const double y = bytes_.place(tick);
      svg += chartLine(kLeft, y, kRight, y, "rule") + chartText(kLeft - 6, y + 4, "end", tickText(tick));
    }
    const std::size_t every = (columns_.size() + 7) / 8;
    for (std::size_t i = 0; i < columns_.size(); i += every) {
      svg += chartText(middle(i), kBottom + 17, "middle", fmt::format("{}", columns_[i].frame));
    }
    svg += chartText((kLeft + kRight) / 2, kHeight - 8, "middle", "frame") + "</g>";
    for (std::size_t i = 0; i < columns_.size(); ++i) svg += column(i);
    return svg + "</svg>\n";
  }

 private:
  double middle(std::size_t i) const { return kLeft + pitch_ * (static_cast<double>(i) + 0.5); }

  std::string column(std::size_t i) const {
    const Column& column = columns_[i];
    std::string svg = fmt::format(R"(<g class="column"><title>frame {}: {} ({})</title>)", column.frame,
                                  byteText(static_cast<double>(sum(column.bytes))), partsText(series_, column.bytes));
    std::uint64_t below = 0;
    for (std::size_t s = 0; s < series_.size(); ++s) {
      if (column.bytes[s] == 0) continue;
      const double bottom = bytes_.place(static_cast<double>(below));
      below += column.bytes[s];
      const double top = bytes_.place(static_cast<double>(below));
      svg += fmt::format(R"(<rect class="{}" x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}"/>)",
                         series_[s].colour, middle(i) - width_ / 2, top, width_, bottom - top);
    }
    return svg + "</g>";
  }

  std::span<const Series> series_;
  std::span<const Column> columns_;
  Axis bytes_;
  double pitch_ = 0, width_ = 0;
  bool dense_ = false;
};

}  // namespace

std::string columnChart(const std::string& title, std::span<const Series> series, std::span<const Column> columns) {
  return columns.empty() ? "" : ColumnChart(series, columns).draw(title);
}

std::string stackedBar(const std::string& title, std::span<const Series> series, std::span<const std::uint64_t> bytes,
                       std::uint64_t scale) {
  std::string svg = fmt::format(
      R"(<svg class="bar" viewBox="0 0 1000 10" preserveAspectRatio="none" role="img"><title>{}: {}</title>)",
      escapeText(title), escapeText(partsText(series, bytes)));
  double left = 0;
  for (std::size_t s = 0; s < series.size(); ++s) {
    if (bytes[s] == 0) continue;
    const double width = 1000 * static_cast<double>(bytes[s]) / static_cast<double>(scale);
    svg += fmt::format(
        R"(<rect class="{}" data-bytes="{}" x="{:.2f}" y="0" width="{:.2f}" height="10"><title>{} {}</title></rect>)",
        series[s].colour, bytes[s], left, width, escapeText(series[s].name), byteText(static_cast<double>(bytes[s])));
    left += width;
  }
  return svg + "</svg>";
}

}  // namespace billow::command
