// The active values of an OpenVDB tree as leaves and tiles.
#ifndef BILLOW_COMPILER_IMPORT_TREE_SOURCE_H
#define BILLOW_COMPILER_IMPORT_TREE_SOURCE_H

#include <fmt/format.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "import/value_notes.h"
#include "import/vdb_read.h"
#include "parallel.h"
#include "stages.h"

namespace billow::compiler {

template <class ValueT>
auto componentOf(const ValueT& value, std::uint32_t component) {
  if constexpr (openvdb::VecTraits<ValueT>::IsVec) {
    return value[static_cast<int>(component)];
  } else {
    return value;
  }
}

inline std::array<std::int32_t, 3> toArray(const openvdb::Coord& at) {
  return {at.x(), at.y(), at.z()};
}

inline std::string where(const std::array<std::int32_t, 3>& at) {
  return fmt::format("({}, {}, {})", at[0], at[1], at[2]);
}

inline std::array<std::int32_t, 3> voxelAt(const std::array<std::int32_t, 3>& origin, std::uint32_t index) {
  return {origin[0] + static_cast<std::int32_t>(index >> 6), origin[1] + static_cast<std::int32_t>(index >> 3 & 7),
          origin[2] + static_cast<std::int32_t>(index & 7)};
}

// One tree of a file, walked once; each component is converted from it.
template <class TreeT>
class TreeSource {
 public:
  using ValueT = typename TreeT::ValueType;
  using LeafT = typename TreeT::LeafNodeType;

  TreeSource(const TreeT& tree, std::string name, std::string what, const ReadContext& context)
      : background_(tree.background()), name_(std::move(name)), what_(std::move(what)), context_(context) {
    collect(tree);
  }

  // False, with a warning, when the component does not fit a float.
  bool convertTo(std::uint32_t component, ImportedGrid& out) const {
    Notes total;
    out.background = convert(componentOf(background_, component), 0, total);
    if (total.nonFinite != 0 && context_.options.nonFinite == NonFinite::error) {
      failNonFinite("the background is not finite");
    }
    total.nonFinite = 0;
    total.rounding = 0;  // it is about voxels
    total.rounded = 0;
    if (total.tooLarge != 0) return warnTooLarge("the background", componentOf(background_, component));
    out.leaves.resize(leaves_.size());
    std::vector<Notes> notes(leaves_.size());
    parallelRanges(leaves_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) {
        convertLeaf(*leaves_[i], component, out.background, out.leaves[i], notes[i]);
      }
    });
    total.min = total.max = out.background;
    for (std::size_t i = 0; i < leaves_.size(); ++i) total.add(notes[i]);
    std::vector<Notes> tileNotes(tiles_.size());
    for (std::size_t i = 0; i < tiles_.size(); ++i) {
      const float value = convert(componentOf(tiles_[i].value, component), 0, tileNotes[i]);
      tileNotes[i].min = tileNotes[i].max = value;
      out.tiles.push_back({tiles_[i].origin, tiles_[i].dim, value});
      total.add(tileNotes[i]);
    }
    out.activeVoxels = activeVoxels_;
    out.min = total.min;
    out.max = total.max;
    return report(component, notes, tileNotes, total);
  }

 private:
  struct TileSource {
    std::array<std::int32_t, 3> origin;
    std::uint32_t dim;
    ValueT value;
  };

  void collect(const TreeT& tree) {
    const auto& root = tree.root();
    for (auto tile = root.cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 4096, *tile);
    for (auto upper = root.cbeginChildOn(); upper; ++upper) {
      for (auto tile = upper->cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 128, *tile);
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        for (auto tile = lower->cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 8, *tile);
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) addLeaf(*leaf);
      }
    }
    std::sort(leaves_.begin(), leaves_.end(), [](const LeafT* a, const LeafT* b) { return a->origin() < b->origin(); });
    std::sort(tiles_.begin(), tiles_.end(), [](const TileSource& a, const TileSource& b) {
      return std::tie(a.origin, a.dim) < std::tie(b.origin, b.dim);
    });
  }

  void addTile(const openvdb::Coord& origin, std::uint32_t dim, const ValueT& value) {
    tiles_.push_back({toArray(origin), dim, value});
    activeVoxels_ += std::uint64_t{dim} * dim * dim;
  }

  void addLeaf(const LeafT& leaf) {
    const std::uint64_t active = leaf.onVoxelCount();
    if (active == 0) return;
    leaves_.push_back(&leaf);
    activeVoxels_ += active;
  }

  // Voxel index -> value; a pointer where the leaf has one, for getValue() asks each time whether it is loaded.
  static auto valuesOf(const LeafT& leaf) {
    if constexpr (std::is_same_v<ValueT, bool>) {
      return [&leaf](std::uint32_t i) { return leaf.getValue(i); };
    } else {
      return [data = leaf.buffer().data()](std::uint32_t i) -> const ValueT& { return data[i]; };
    }
  }

  static void convertLeaf(const LeafT& leaf, std::uint32_t component, float background, Leaf& out, Notes& notes) {
    out.origin = toArray(leaf.origin());
    for (std::uint32_t word = 0; word < 8; ++word) {
      const auto bits = leaf.getValueMask().template getWord<std::uint64_t>(word);
      out.active.words[2 * word] = static_cast<std::uint32_t>(bits);
      out.active.words[2 * word + 1] = static_cast<std::uint32_t>(bits >> 32);
    }
    notes.min = std::numeric_limits<float>::max();
    notes.max = std::numeric_limits<float>::lowest();
    const auto values = valuesOf(leaf);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      float value = background;
      if (format::maskBit(out.active, i)) {
        value = convert(componentOf(values(i), component), i, notes);
        notes.min = std::min(notes.min, value);
        notes.max = std::max(notes.max, value);
      }
      out.values[i] = value;
    }
  }

  bool report(std::uint32_t component, const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
              const Notes& total) const {
    if (total.nonFinite != 0 && context_.options.nonFinite == NonFinite::error) {
      const auto [at, value] = firstWith(component, leafNotes, tileNotes, &Notes::nonFinite, &Notes::firstNonFinite);
      failNonFinite(fmt::format("{} active voxels or tiles are not finite, the first at index {} is {}",
                                total.nonFinite, where(at), value));
    }
    if (total.tooLarge != 0) {
      const auto [at, value] = firstWith(component, leafNotes, tileNotes, &Notes::tooLarge, &Notes::firstTooLarge);
      return warnTooLarge(fmt::format("the voxel at index {}", where(at)), value);
    }
    if (total.denormal != 0) {
      context_.warn(
          fmt::format("{}: {} values are smaller than 1.2e-38 (denormal), which a GPU takes for 0; they are "
                      "set to 0",
                      what_, total.denormal));
    }
    // A millionth of the range: well below what any encoding keeps.
    const double range = static_cast<double>(total.max) - static_cast<double>(total.min);
    if (range > 0 && total.rounding > range * 0x1p-20) {
      context_.warn(fmt::format("{}: {} values are rounded to single precision, by {} at most, at index {}", what_,
                                total.rounded, total.rounding,
                                where(mostRounded(leafNotes, tileNotes, total.rounding))));
    }
    return true;
  }

  std::array<std::int32_t, 3> mostRounded(const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
                                          double rounding) const {
    for (std::size_t i = 0; i < leafNotes.size(); ++i) {
      if (leafNotes[i].rounding == rounding) return voxelAt(toArray(leaves_[i]->origin()), leafNotes[i].mostRounded);
    }
    std::size_t i = 0;
    while (tileNotes[i].rounding != rounding) ++i;
    return tiles_[i].origin;
  }

  struct Found {
    std::array<std::int32_t, 3> at;
    double value;
  };

  Found firstWith(std::uint32_t component, const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
                  std::uint32_t Notes::*count, std::uint32_t Notes::*first) const {
    for (std::size_t i = 0; i < leafNotes.size(); ++i) {
      if (leafNotes[i].*count == 0) continue;
      const std::uint32_t index = leafNotes[i].*first;
      return {voxelAt(toArray(leaves_[i]->origin()), index),
              static_cast<double>(componentOf(leaves_[i]->getValue(index), component))};
    }
    std::size_t i = 0;
    while (tileNotes[i].*count == 0) ++i;
    return {tiles_[i].origin, static_cast<double>(componentOf(tiles_[i].value, component))};
  }

  [[noreturn]] void failNonFinite(const std::string& detail) const {
    throw Error(Fault::input, fmt::format("{}: {}; --non-finite zero sets such voxels to 0", what_, detail));
  }

  template <class T>
  bool warnTooLarge(const std::string& place, T value) const {
    context_.warn(
        fmt::format("{}: {} is {}, which single precision cannot hold with room to spare (at most 1e37); the "
                    "grid is skipped",
                    what_, place, static_cast<double>(value)));
    return false;
  }

  ValueT background_;
  std::string name_;
  std::string what_;  // file, frame and grid
  const ReadContext& context_;
  std::vector<const LeafT*> leaves_;
  std::vector<TileSource> tiles_;
  std::uint64_t activeVoxels_ = 0;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_TREE_SOURCE_H
