// The share stage: chosen bricks become masks, Node3s, Node4s and a Node5, each stored once in the whole pack.
#ifndef BILLOW_COMPILER_SHARE_H
#define BILLOW_COMPILER_SHARE_H

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "billow/format/writer.h"
#include "choose/choose.h"
#include "stages.h"

namespace billow::compiler {

// Where pack voxel (0, 0, 0) of a grid lies in source index space, so that all of [min, max] fits 4096^3. The coarsest
// alignment that fits is taken (4096, 128, 8), so that a tree keeps its shape from frame to frame.
// Throws Error(input) naming `where` and the extent when nothing fits.
std::array<std::int32_t, 3> chooseOrigin(const std::array<std::int64_t, 3>& min, const std::array<std::int64_t, 3>& max,
                                         const std::string& where);

// Inclusive box of active voxels and tiles in source index space; min > max where nothing is active.
void activeBox(const ImportedGrid& grid, std::array<std::int64_t, 3>& min, std::array<std::int64_t, 3>& max);

// The record's transform: from pack index space, whose zero is source index record.origin, to the world.
void placeOrigin(const std::array<double, 12>& sourceToWorld, format::GridFrame& record);

// Appends what is new to the writer and remembers what was written by its content (XXH3-128). Not thread-safe:
// called frame by frame in order, so the pack's bytes do not depend on timing.
class Sharer {
 public:
  explicit Sharer(format::PackWriter& writer) : writer_(writer) {}

  // Fills everything of the record but flags. `pages` gets the pages that the grid frame needs, ascending.
  format::GridFrame addGrid(const ImportedGrid& grid, const ChosenGrid& chosen, const std::string& where,
                            std::vector<std::uint32_t>& pages);

 private:
  struct Key {
    std::uint64_t low, high;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const { return key.low; }
  };
  friend class TreeBuilder;

  Key keyOf(format::Stream stream, const void* bytes, std::size_t size, std::uint32_t meaning) const;
  // Index of equal content of the same `meaning` that lies where the grid frame reads anyway, or of the appended items.
  std::uint32_t intern(format::Stream stream, const void* items, std::uint32_t count, std::uint32_t meaning = 0);
  // Null where the content is new.
  const std::uint32_t* find(const Key& key) const;

  // A grid frame begins: it reads the page that is open, those after it, and of older ones such that hold a good part
  // of it or that it uses a good part of. A few equal bytes in each of many pages would make it read them all.
  void beginGrid(const ImportedGrid& grid, std::span<const ChosenBrick> bricks);
  static Key contentOf(const ImportedGrid& grid, std::span<const ChosenBrick> bricks);
  void countUse(format::Stream stream, const void* items, std::size_t bytes, std::uint32_t meaning);

  format::PackWriter& writer_;
  // Two generations: what has not been met again for a generation is forgotten (and would be stored anew), so that
  // memory stays bounded however long the sequence is: about 60 bytes an entry.
  static constexpr std::size_t kGeneration = 1u << 20;
  std::unordered_map<Key, std::uint32_t, KeyHash> recent_, older_;
  std::vector<std::uint32_t> pageBytes_;                       // that were appended, by page
  std::uint32_t openPage_ = 0;                                 // when the grid frame began
  std::unordered_map<std::uint32_t, std::uint64_t> pageUses_;  // bytes of older pages that it has as bricks and masks
  struct Tree {
    format::GridFrame frame{};
    std::vector<std::uint32_t> pages;
  };
  std::unordered_map<Key, Tree, KeyHash> trees_;  // by content: equal grid frames are one tree, whatever lies between
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_SHARE_H
