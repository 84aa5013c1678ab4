#include "reconstruct.h"

#include "billow/format/brick.h"

namespace billow::command {
namespace {

std::array<std::int32_t, 3> toSource(const std::uint32_t (&at)[3], const format::GridFrame& frame) {
  std::array<std::int32_t, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result[axis] = static_cast<std::int32_t>(std::int64_t{at[axis]} + frame.origin[axis]);
  }
  return result;
}

}  // namespace

compiler::ImportedGrid reconstruct(const format::GridView& view) {
  const format::GridFrame& frame = view.frame();
  compiler::ImportedGrid grid;
  grid.present = (frame.flags & format::kGridPresent) != 0;
  grid.background = frame.background;
  grid.activeVoxels = frame.activeVoxels;
  grid.min = frame.valueMin;
  grid.max = frame.valueMax;
  for (std::size_t row = 0; row < 3; ++row) {
    const double* m = &frame.indexToWorld[row * 4];
    for (std::size_t column = 0; column < 3; ++column) grid.indexToWorld[row * 4 + column] = m[column];
    // The compiler moved the origin into the translation; a source index goes the other way.
    grid.indexToWorld[row * 4 + 3] = m[3] - (m[0] * frame.origin[0] + m[1] * frame.origin[1] + m[2] * frame.origin[2]);
  }
  grid.leaves.reserve(view.leaves().size());
  for (const format::GridView::Leaf& leaf : view.leaves()) {
    const auto origin = toSource(leaf.origin, frame);
    if (format::encodingOf(leaf.node) == format::kEncodingConstant && leaf.node.mask == format::kMaskAll) {
      grid.tiles.push_back({origin, 8, leaf.node.lo});  // as OpenVDB keeps it: 2 KiB less
      continue;
    }
    compiler::Leaf& target = grid.leaves.emplace_back();
    target.origin = origin;
    format::decodeBrick(leaf.node, leaf.mask, leaf.brick, frame.background, target.values, target.active);
  }
  for (const format::GridView::Tile& tile : view.tiles()) {
    grid.tiles.push_back({toSource(tile.origin, frame), tile.dim, tile.value});
  }
  return grid;
}

}  // namespace billow::command
