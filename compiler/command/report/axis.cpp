#include "report/axis.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

namespace billow::command {

double Axis::place(double value) const {
  const double part = logarithmic ? std::log2(value / low) / std::log2(high / low) : (value - low) / (high - low);
  return from + part * (to - from);
}

std::vector<double> evenTicks(double low, double high, std::size_t most) {
  double step = std::pow(10.0, std::floor(std::log10((high - low) / static_cast<double>(most))));
  for (const double factor : {2.0, 2.5, 2.0}) {
    if ((high - low) / step <= static_cast<double>(most)) break;
    step *= factor;
  }
  std::vector<double> ticks;
  const auto first = static_cast<std::int64_t>(std::ceil(low / step - 1e-9));  // whole, so that 0 has no sign
  for (std::int64_t tick = first; static_cast<double>(tick) * step <= high + step * 1e-9; ++tick) {
    ticks.push_back(static_cast<double>(tick) * step);
  }
  return ticks;
}

std::vector<double> octaveTicks(double low, double high) {
  std::vector<double> ticks;
  for (const int parts : {1, 2, 4}) {
    ticks.clear();
    for (int octave = std::ilogb(low); std::ldexp(1.0, octave) <= high; ++octave) {
      for (int part = 0; part < parts; ++part) {
        const double tick = std::ldexp(1 + 1.0 * part / parts, octave);
        if (tick >= low && tick <= high) ticks.push_back(tick);
      }
    }
    if (ticks.size() >= 3) break;
  }
  return ticks;
}

std::string chartText(double x, double y, const std::string& anchor, const std::string& escaped) {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>)", x, y, anchor, escaped);
}

std::string chartLine(double x1, double y1, double x2, double y2, const std::string& colour) {
  return fmt::format(R"(<line class="{}" x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}"/>)", colour, x1, y1, x2, y2);
}

}  // namespace billow::command
