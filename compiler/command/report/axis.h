// From figures to places on a chart.
#ifndef BILLOW_COMMAND_REPORT_AXIS_H
#define BILLOW_COMMAND_REPORT_AXIS_H

#include <string>
#include <vector>

namespace billow::command {

// Maps [low, high] to [from, to] in the units of the SVG; low < high, and low > 0 where it is logarithmic.
struct Axis {
  double low = 0, high = 1;
  double from = 0, to = 1;
  bool logarithmic = false;

  double place(double value) const;
  bool contains(double value) const { return value >= low && value <= high; }
};

// Even steps of 1, 2 or 5 times a power of ten, at most `most` of them, within [low, high].
std::vector<double> evenTicks(double low, double high, std::size_t most);

// Octaves within [low, high]; halves and quarters of octaves' spans too where there are fewer than three.
std::vector<double> octaveTicks(double low, double high);

// "<text ...>": `anchor` is start, middle or end.
std::string chartText(double x, double y, const std::string& anchor, const std::string& escaped);

std::string chartLine(double x1, double y1, double x2, double y2, const std::string& colour);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_AXIS_H
