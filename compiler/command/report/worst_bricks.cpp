#include "report/worst_bricks.h"

#include <algorithm>
#include <cmath>

namespace billow::command {
namespace {

using compiler::ImportedGrid;
using compiler::Leaf;

const Leaf* findLeaf(const ImportedGrid& grid, const std::array<std::int32_t, 3>& origin) {
  const auto before = [](const Leaf& leaf, const std::array<std::int32_t, 3>& at) { return leaf.origin < at; };
  const auto found = std::lower_bound(grid.leaves.begin(), grid.leaves.end(), origin, before);
  return found != grid.leaves.end() && found->origin == origin ? &*found : nullptr;
}

// Errors of voxels that both have; values are left for later, as few bricks are kept.
WorstBrick measureBrick(const Leaf& source, const format::Values& pack, const format::Mask3& packActive, double range) {
  WorstBrick brick;
  brick.origin = source.origin;
  double squared = 0;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(source.active, i) || !format::maskBit(packActive, i)) continue;
    const double error = std::fabs(static_cast<double>(source.values[i]) - static_cast<double>(pack[i]));
    ++brick.activeVoxels;
    squared += error * error;
    if (error <= brick.maxError) continue;
    brick.maxError = error;
    brick.worstVoxel = i;
  }
  if (brick.activeVoxels != 0) brick.rmse = std::sqrt(squared / brick.activeVoxels);
  brick.relativeRmse = range > 0 ? brick.rmse / range : brick.rmse;
  return brick;
}

// Where the brick goes in `worst`, after others of its place have left it; worst.size() where it is not among them.
std::size_t makePlace(const WorstBrick& brick, std::vector<WorstBrick>& worst) {
  const auto same = std::find_if(worst.begin(), worst.end(), [&](const auto& o) { return o.origin == brick.origin; });
  if (same != worst.end()) {
    if (same->relativeRmse >= brick.relativeRmse) return kWorstBricks;
    worst.erase(same);
  }
  const auto above = [&](const WorstBrick& other) { return other.relativeRmse >= brick.relativeRmse; };
  return static_cast<std::size_t>(std::find_if_not(worst.begin(), worst.end(), above) - worst.begin());
}

void keep(const ComparedGrid& compared, const Leaf& source, const format::Values& pack, const format::Mask3& packActive,
          std::uint32_t encoding, std::vector<WorstBrick>& worst) {
  WorstBrick brick = measureBrick(source, pack, packActive, compared.row.range);
  if (!(brick.relativeRmse > 0)) return;
  if (worst.size() == kWorstBricks && brick.relativeRmse <= worst.back().relativeRmse) return;
  const std::size_t place = makePlace(brick, worst);
  if (place >= kWorstBricks) return;
  brick.frame = compared.row.frame;
  brick.encoding = encoding;
  brick.active = source.active;
  brick.source = source.values;
  brick.pack = pack;
  worst.insert(worst.begin() + static_cast<std::ptrdiff_t>(place), brick);
  if (worst.size() > kWorstBricks) worst.pop_back();
}

}  // namespace

void keepWorstBricks(const ComparedGrid& compared, std::vector<WorstBrick>& worst) {
  format::Mask3 all;
  std::fill(std::begin(all.words), std::end(all.words), ~0u);
  format::Values constant;
  auto leaf = compared.pack.leaves.begin();
  auto tile = compared.pack.tiles.begin();
  // reconstruct() made a leaf, or for a full constant brick a tile, of each of the view's leaves, in their order.
  for (const format::GridView::Leaf& stored : compared.view.leaves()) {
    const std::uint32_t encoding = format::encodingOf(stored.node);
    const bool asTile = encoding == format::kEncodingConstant && stored.node.mask == format::kMaskAll;
    const std::array<std::int32_t, 3> origin = asTile ? (tile++)->origin : (leaf++)->origin;
    const Leaf* source = findLeaf(compared.source, origin);
    if (source == nullptr) continue;
    if (asTile) {
      constant.fill(std::prev(tile)->value);
      keep(compared, *source, constant, all, encoding, worst);
    } else {
      keep(compared, *source, std::prev(leaf)->values, std::prev(leaf)->active, encoding, worst);
    }
  }
}

}  // namespace billow::command
