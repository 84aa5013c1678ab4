// The page's charts, as SVG text. Colours are classes that the page's style sheet defines: c0, c1, ... for series.
#ifndef BILLOW_COMMAND_REPORT_CHARTS_H
#define BILLOW_COMMAND_REPORT_CHARTS_H

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "report/report_data.h"

namespace billow::command {

// Bits an active voxel (logarithmic, octaves) against dB: the grid's curves, each of its frames as a dot, and the one
// that the curves are measured on as a disc. `id` is unique in the page. "" where nothing has a finite PSNR.
std::string rateChart(const ReportGrid& grid, const std::string& id);

// The encodings that a chart or bar may show, as classes and words.
struct Series {
  std::string name;
  std::string colour;  // class
};

struct Column {
  std::int32_t frame = 0;
  std::vector<std::uint64_t> bytes;  // by series, from the bottom
};
// Bytes over frames, stacked. `title` is plain text, and so are the names of series.
std::string columnChart(const std::string& title, std::span<const Series> series, std::span<const Column> columns);

// One stacked bar without words, as long as bytes / scale of the width; each part has its title.
std::string stackedBar(const std::string& title, std::span<const Series> series, std::span<const std::uint64_t> bytes,
                       std::uint64_t scale);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_CHARTS_H
