// Where in a grid the values of a place are.
#ifndef BILLOW_COMPILER_METRIC_CELL_LOOKUP_H
#define BILLOW_COMPILER_METRIC_CELL_LOOKUP_H

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "stages.h"

namespace billow::compiler {

using Origin = std::array<std::int32_t, 3>;

// Finds the leaf or tile that covers a cell of 8^3 voxels. The grid must outlive it; its tiles need not be aligned to
// their size. Reading is thread-safe.
class CellLookup {
 public:
  explicit CellLookup(const ImportedGrid& grid);

  std::uint64_t activeVoxels() const { return active_; }
  // The leaf at a multiple of 8, or null.
  const Leaf* leafAt(const Origin& cell) const;
  // The tile that covers the cube of `dim` voxels at `origin` whole, or null.
  const Tile* tileOver(const Origin& origin, std::uint32_t dim) const;

 private:
  struct OriginHash {
    std::size_t operator()(const Origin& at) const {
      std::uint64_t hash = 0;
      for (const std::int32_t x : at) hash = (hash ^ static_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15u;
      return static_cast<std::size_t>(hash ^ hash >> 32);
    }
  };

  std::unordered_map<Origin, const Leaf*, OriginHash> leaves_;
  std::unordered_map<Origin, const Tile*, OriginHash> small_;       // of 8^3
  std::unordered_multimap<Origin, const Tile*, OriginHash> tiles_;  // of 128^3, by the aligned cubes they touch
  std::vector<const Tile*> large_;
  std::uint64_t active_ = 0;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_METRIC_CELL_LOOKUP_H
