// Any bytes as a page's stored bytes under runs that they choose: decoding ends, stays in the page, and what it gives
// is coded and decoded to the same.
#include <array>
#include <cstdlib>
#include <vector>

#include "billow/format/page_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace billow::format;
  constexpr std::uint8_t kMost[kStreamCount] = {64, 16, 2, 3, 32, 64};
  if (size < kStreamCount) return 0;
  std::array<StreamRange, kStreamCount> runs{};
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < kStreamCount; ++i) {
    runs[i] = {static_cast<std::uint32_t>(i), std::uint32_t{data[i]} % kMost[i]};
    bytes += std::size_t{runs[i].count} * kStreamItemBytes[i];
  }
  const auto* first = reinterpret_cast<const std::byte*>(data) + kStreamCount;
  const std::vector<std::byte> stored(first, first + (size - kStreamCount));
  std::vector<std::byte> page(bytes);
  decodePage(runs, stored, page);
  std::vector<std::byte> back(bytes);
  if (!decodePage(runs, encodePage(runs, page), back) || back != page) std::abort();
  return 0;
}
