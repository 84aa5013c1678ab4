#include <algorithm>
#include <numeric>
#include <utility>

#include "choose/choose.h"

namespace billow::compiler {
namespace {

// One step of a brick from a hull point to the next dearer one.
struct Step {
  double gain;  // squared error saved a byte
  std::uint32_t brick;
  std::uint32_t to;    // index into the brick's choices
  std::uint32_t rank;  // of the step along the brick's hull
};

// Indices of the choices on the lower convex hull, by ascending bytes. `order` is scratch.
void findHull(const std::vector<Choice>& choices, float maxError, std::vector<std::uint32_t>& order,
              std::vector<std::uint32_t>& hull) {
  order.clear();
  hull.clear();
  for (std::uint32_t i = 0; i < choices.size(); ++i) {
    if (choices[i].maxError <= maxError) order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    if (choices[a].bytes != choices[b].bytes) return choices[a].bytes < choices[b].bytes;
    if (choices[a].squaredError != choices[b].squaredError) return choices[a].squaredError < choices[b].squaredError;
    return a < b;
  });
  const auto slope = [&](std::uint32_t a, std::uint32_t b) {
    return (choices[a].squaredError - choices[b].squaredError) / double(choices[b].bytes - choices[a].bytes);
  };
  for (const std::uint32_t next : order) {
    if (!hull.empty() && choices[next].squaredError >= choices[hull.back()].squaredError) continue;
    if (!hull.empty() && choices[next].bytes == choices[hull.back()].bytes) continue;
    while (hull.size() >= 2 && slope(hull[hull.size() - 2], hull.back()) <= slope(hull.back(), next)) hull.pop_back();
    hull.push_back(next);
  }
}

}  // namespace

std::optional<Allocation> allocate(std::span<const std::vector<Choice>> bricks, double budget, float maxError) {
  std::vector<std::uint32_t> chosen(bricks.size());
  std::vector<Step> steps;
  std::vector<std::uint32_t> order, hull;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    findHull(bricks[b], maxError, order, hull);
    if (hull.empty()) return std::nullopt;
    chosen[b] = hull.front();
    for (std::size_t h = 1; h < hull.size(); ++h) {
      const Choice& from = bricks[b][hull[h - 1]];
      const Choice& to = bricks[b][hull[h]];
      steps.push_back({(from.squaredError - to.squaredError) / double(to.bytes - from.bytes), b, hull[h],
                       static_cast<std::uint32_t>(h)});
    }
  }
  // A brick's steps lose gain along its hull, so the sorted order keeps them in sequence.
  std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) {
    if (a.gain != b.gain) return a.gain > b.gain;
    return a.brick != b.brick ? a.brick < b.brick : a.rank < b.rank;
  });
  const auto total = [&] {
    double sum = 0;
    for (std::size_t b = 0; b < bricks.size(); ++b) sum += bricks[b][chosen[b]].squaredError;
    return sum;
  };
  double error = total();
  std::size_t next = 0;
  if (!(budget >= 0)) return std::nullopt;  // NaN too
  // The running sum drifts by rounding, so it is taken afresh before the answer is believed.
  for (;; error = total()) {
    for (; error > budget && next < steps.size(); ++next) {
      const Step& step = steps[next];
      error -= bricks[step.brick][chosen[step.brick]].squaredError - bricks[step.brick][step.to].squaredError;
      chosen[step.brick] = step.to;
    }
    if (total() <= budget) return Allocation{std::move(chosen), next == 0 ? 0 : steps[next - 1].gain};
    if (next == steps.size()) return std::nullopt;
  }
}

}  // namespace billow::compiler
