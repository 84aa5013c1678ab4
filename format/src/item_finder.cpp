#include "item_finder.h"

#include <algorithm>

namespace billow::format {

ItemFinder::ItemFinder(const Pack& pack, std::span<const Page> pages) : pagesUsed_(pages.size()) {
  for (std::uint32_t p = 0; p < pages.size(); ++p) {
    const PageRecord& record = pack.pages()[pages[p].number];
    for (std::uint32_t s = 0; s < kStreamCount; ++s) {
      const StreamRange& run = record.streams[s];
      if (run.count == 0) continue;
      runs_[s].push_back(
          {run.first, run.count, localCount_[s], p, pages[p].stream(record, static_cast<Stream>(s)).data()});
      localCount_[s] += run.count;
    }
  }
}

ItemFinder::Found ItemFinder::find(Stream stream, std::uint32_t first, std::uint32_t count) {
  const auto which = static_cast<std::uint32_t>(stream);
  const std::vector<Run>& runs = runs_[which];
  if (runs.empty()) return {};
  const auto holds = [&](const Run& run) {
    return first >= run.first && first - run.first < run.count && count <= run.count - (first - run.first);
  };
  if (!holds(runs[last_[which]])) {
    const auto after = std::upper_bound(runs.begin(), runs.end(), first,
                                        [](std::uint32_t value, const Run& run) { return value < run.first; });
    if (after == runs.begin() || !holds(*(after - 1))) return {};
    last_[which] = static_cast<std::size_t>(after - 1 - runs.begin());
  }
  const Run& run = runs[last_[which]];
  pagesUsed_[run.page] = 1;
  return {run.data + std::size_t{first - run.first} * kStreamItemBytes[which], run.local + (first - run.first)};
}

}  // namespace billow::format
