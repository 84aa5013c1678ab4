#include "metric/depth_error.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <vector>

#include "billow/format/psnr.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

// Lines come in patches of 8 by 8: (u / 8, v / 8). A leaf touches one patch, or two neighbours in u along diagonals.
constexpr std::int64_t kPatch = 8;

struct Line {
  std::array<double, 2> sum{};  // of source and result
  bool met = false;             // an active voxel
};

// A leaf or tile of the source (grid 0) or the result (grid 1).
struct Item {
  std::array<std::int32_t, 3> origin;
  std::int32_t dim;
  const Leaf* leaf;  // null: a tile
  double value;      // of a tile, less the background
  double background;
  std::size_t grid;
};

std::vector<Item> gatherItems(const ImportedGrid& source, const ImportedGrid& result) {
  std::vector<Item> items;
  items.reserve(source.leaves.size() + source.tiles.size() + result.leaves.size() + result.tiles.size());
  std::size_t index = 0;
  for (const ImportedGrid* grid : {&source, &result}) {
    const double background = static_cast<double>(grid->background);
    for (const Leaf& leaf : grid->leaves) items.push_back({leaf.origin, 8, &leaf, 0, background, index});
    for (const Tile& tile : grid->tiles) {
      items.push_back({tile.origin, static_cast<std::int32_t>(tile.dim), nullptr,
                       static_cast<double>(tile.value) - background, background, index});
    }
    ++index;
  }
  // One order for both grids: where they hold equal values their sums round alike, and the line's error is 0.
  std::sort(items.begin(), items.end(),
            [](const Item& a, const Item& b) { return a.origin != b.origin ? a.origin < b.origin : a.grid < b.grid; });
  return items;
}

std::int64_t floorDivide(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

// The lines of one direction and one slab, v in [8 slab, 8 slab + 8).
class Slab {
 public:
  explicit Slab(const LineDirection& direction) : direction_(direction) {}

  // `members` must touch the slab.
  DepthError measure(const std::vector<Item>& items, std::span<const std::uint32_t> members) {
    for (const std::uint32_t member : members) addPatches(items[member]);
    std::sort(patches_.begin(), patches_.end());
    patches_.erase(std::unique(patches_.begin(), patches_.end()), patches_.end());
    lines_.resize(patches_.size() * kPatch * kPatch);
    for (const std::uint32_t member : members) {
      const Item& item = items[member];
      if (item.dim == kPatch) {
        addCell(item);
      } else {
        addTile(item);
      }
    }
    return total();
  }

 private:
  std::int64_t uBegin(const Item& item) const {
    std::int64_t u = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      u += std::int64_t{direction_.u[a]} * item.origin[a];
      if (direction_.u[a] < 0) u -= item.dim - 1;
    }
    return u;
  }
  // One past the last u that an item touches.
  std::int64_t uEnd(const Item& item) const {
    const std::int64_t width = item.dim;
    return uBegin(item) + (direction_.diagonal ? 2 * width - 1 : width);
  }

  void addPatches(const Item& item) {
    const std::int64_t last = floorDivide(uEnd(item) - 1, kPatch);
    for (std::int64_t p = floorDivide(uBegin(item), kPatch); p <= last; ++p) patches_.push_back(p);
  }

  // The first line of a patch. Patches that follow each other in u do so in memory: line (u, v) is the
  // (u - 8 patch) * 8 + v - 8 slab th from it.
  Line* linesOf(std::int64_t patch) {
    const auto found = std::lower_bound(patches_.begin(), patches_.end(), patch);
    return lines_.data() + (found - patches_.begin()) * kPatch * kPatch;
  }

  // A leaf, or a tile of one cell, which is summed voxel by voxel like the leaf it may stand for.
  void addCell(const Item& item) {
    const std::int64_t patch = floorDivide(uBegin(item), kPatch);
    std::int64_t u = 0;
    std::array<std::ptrdiff_t, 3> stride{};
    for (std::size_t a = 0; a < 3; ++a) {
      u += std::int64_t{direction_.u[a]} * item.origin[a];
      stride[a] = direction_.u[a] * kPatch + (a == direction_.v ? 1 : 0);
    }
    Line* const first = linesOf(patch);
    const std::ptrdiff_t offset = (u - patch * kPatch) * kPatch;
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (item.leaf != nullptr && !format::maskBit(item.leaf->active, i)) continue;
      const auto x = static_cast<std::ptrdiff_t>(i >> 6);
      const auto y = static_cast<std::ptrdiff_t>(i >> 3 & 7);
      const auto z = static_cast<std::ptrdiff_t>(i & 7);
      Line& line = first[offset + x * stride[0] + y * stride[1] + z * stride[2]];
      line.sum[item.grid] +=
          item.leaf != nullptr ? static_cast<double>(item.leaf->values[i]) - item.background : item.value;
      line.met = true;
    }
  }

  // A larger tile covers the slab's eight v alike.
  void addTile(const Item& item) {
    const std::int64_t begin = uBegin(item);
    const std::int64_t end = uEnd(item);
    Line* const first = linesOf(floorDivide(begin, kPatch));
    const std::int64_t base = floorDivide(begin, kPatch) * kPatch;
    for (std::int64_t u = begin; u < end; ++u) {
      // Along a diagonal, the voxels of a square that lie on its uth line.
      const std::int64_t voxels = direction_.diagonal ? item.dim - std::abs(u - begin - (item.dim - 1)) : item.dim;
      for (std::int64_t v = 0; v < kPatch; ++v) {
        Line& line = first[(u - base) * kPatch + v];
        line.sum[item.grid] += static_cast<double>(voxels) * item.value;
        line.met = true;
      }
    }
  }

  DepthError total() const {
    const double step = direction_.diagonal ? std::sqrt(2.0) : 1;
    DepthError error;
    for (const Line& line : lines_) {
      if (!line.met) continue;
      const double difference = step * (line.sum[1] - line.sum[0]);
      ++error.lines;
      error.squaredError += difference * difference;
      error.leastIntegral = std::min(error.leastIntegral, step * line.sum[0]);
      error.largestIntegral = std::max(error.largestIntegral, step * line.sum[0]);
    }
    return error;
  }

  const LineDirection& direction_;
  std::vector<std::int64_t> patches_;  // u / 8 of those touched, ascending
  std::vector<Line> lines_;            // of the patches, one after another; v fastest
};

struct SlabMember {
  std::int64_t slab;
  std::uint32_t item;
};

void addTo(DepthError& sum, const DepthError& part) {
  sum.lines += part.lines;
  sum.squaredError += part.squaredError;
  sum.leastIntegral = std::min(sum.leastIntegral, part.leastIntegral);
  sum.largestIntegral = std::max(sum.largestIntegral, part.largestIntegral);
}

DepthError measureDirection(const LineDirection& direction, const std::vector<Item>& items) {
  std::vector<SlabMember> sorted;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    const std::int64_t first = floorDivide(items[i].origin[direction.v], kPatch);
    for (std::int64_t s = 0; s < items[i].dim / kPatch; ++s) sorted.push_back({first + s, i});
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](auto& a, auto& b) { return a.slab < b.slab; });
  std::vector<std::uint32_t> members(sorted.size());
  std::vector<std::size_t> begins;
  for (std::size_t m = 0; m < sorted.size(); ++m) {
    members[m] = sorted[m].item;
    if (m == 0 || sorted[m].slab != sorted[m - 1].slab) begins.push_back(m);
  }
  std::vector<DepthError> parts(begins.size());
  parallelRanges(begins.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s != end; ++s) {
      const std::size_t last = s + 1 < begins.size() ? begins[s + 1] : members.size();
      parts[s] = Slab(direction).measure(items, std::span(members).subspan(begins[s], last - begins[s]));
    }
  });
  DepthError sum;
  for (const DepthError& part : parts) addTo(sum, part);
  return sum;
}

}  // namespace

double DepthError::range() const {
  return largestIntegral - leastIntegral;
}

double DepthError::rmse() const {
  return lines == 0 ? 0 : std::sqrt(squaredError / static_cast<double>(lines));
}

double DepthError::psnr() const {
  return format::psnr(range(), squaredError, lines);
}

DepthError measureDepth(const ImportedGrid& source, const ImportedGrid& result) {
  const std::vector<Item> items = gatherItems(source, result);
  DepthError error;
  for (const LineDirection& direction : kLineDirections) addTo(error, measureDirection(direction, items));
  return error;
}

}  // namespace billow::compiler
