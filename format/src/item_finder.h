// Nodes, masks, child lists and units by their global indices.
#ifndef BILLOW_FORMAT_SRC_ITEM_FINDER_H
#define BILLOW_FORMAT_SRC_ITEM_FINDER_H

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rules.h"

namespace billow::format {

// Finds items by global index in the pages of one grid frame, and remembers which were found.
class ItemFinder {
 public:
  struct Run {
    std::uint32_t first;
    std::uint32_t count;
    std::uint32_t local;  // number of the run's first item among those of this finder
    std::uint32_t page;   // position in the list of pages
    const std::byte* data;
  };
  struct Found {
    const std::byte* data = nullptr;  // null: not in these pages
    std::uint32_t local = 0;
  };

  ItemFinder(const Pack& pack, std::span<const Page> pages);

  // `count` items that follow one another, all in one page.
  Found find(Stream stream, std::uint32_t first, std::uint32_t count);
  std::uint32_t localCount(Stream stream) const { return localCount_[static_cast<std::uint32_t>(stream)]; }
  std::span<const Run> runs(Stream stream) const { return runs_[static_cast<std::uint32_t>(stream)]; }
  std::span<const std::uint8_t> pagesUsed() const { return pagesUsed_; }

 private:
  std::array<std::vector<Run>, kStreamCount> runs_;  // ascending, without empty ones
  std::array<std::uint32_t, kStreamCount> localCount_{};
  std::array<std::size_t, kStreamCount> last_{};  // neighbours mostly lie in the same run
  std::vector<std::uint8_t> pagesUsed_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_ITEM_FINDER_H
