// The entropy coder under the page codec: range variant of asymmetric numeral systems (J. Duda, "Asymmetric numeral
// systems", arXiv:1311.2540) with two 32-bit states that take turns, renormalised by 16-bit words_. spec/pagecodec.md.
//
// An interval is [start, start + size) of [0, kScale), size from 1 to kScale - 1.
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace billow::format::page_coder {

inline constexpr std::uint32_t kScaleLog2 = 15;
inline constexpr std::uint32_t kScale = 1u << kScaleLog2;
inline constexpr std::uint32_t kStateLow = 1u << 16;  // states are at least this between intervals

// Collects intervals; they are coded backwards at the end, since a decoder reads what was coded last.
class RansEncoder {
 public:
  void put(std::uint32_t start, std::uint32_t size) { intervals_.push_back(size << 16 | start); }

  // The bytes of all intervals put since the last call.
  std::vector<std::byte> finish() {
    words_.clear();
    std::uint32_t states[2] = {kStateLow, kStateLow};
    for (std::size_t i = intervals_.size(); i-- > 0;) {
      const std::uint32_t start = intervals_[i] & 0xffff;
      const std::uint32_t size = intervals_[i] >> 16;
      std::uint32_t& state = states[i & 1];
      if (state >> 17 >= size) {
        words_.push_back(static_cast<std::uint16_t>(state));
        state >>= 16;
      }
      state = state / size * kScale + state % size + start;
    }
    std::vector<std::byte> out;
    out.reserve(8 + 2 * words_.size());
    for (const std::uint32_t state : states) {
      for (int byte = 0; byte < 4; ++byte) out.push_back(static_cast<std::byte>(state >> (8 * byte)));
    }
    for (std::size_t i = words_.size(); i-- > 0;) {
      out.push_back(static_cast<std::byte>(words_[i]));
      out.push_back(static_cast<std::byte>(words_[i] >> 8));
    }
    intervals_.clear();
    return out;
  }

 private:
  std::vector<std::uint32_t> intervals_;
  std::vector<std::uint16_t> words_;
};

// Reads what an encoder wrote. Of other bytes it gives some intervals, reads 0 past their end, and says so in sound().
class RansDecoder {
 public:
  explicit RansDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (std::uint32_t* state : {&now_, &next_}) {
      const std::uint32_t low = word();
      *state = word() << 16 | low;
    }
  }

  // The number in [0, kScale) that lies in the next interval.
  std::uint32_t peek() const { return now_ & (kScale - 1); }

  void take(std::uint32_t start, std::uint32_t size) {
    std::uint32_t state = size * (now_ >> kScaleLog2) + (now_ & (kScale - 1)) - start;
    if (state < kStateLow) state = state << 16 | word();
    now_ = std::exchange(next_, state);
  }

  // Whether all bytes were read, none was missing, and both states are where an encoder starts.
  bool sound() const { return at_ == bytes_.size() && now_ == kStateLow && next_ == kStateLow; }

 private:
  std::uint32_t word() {
    if (bytes_.size() - at_ < 2 || at_ > bytes_.size()) {
      at_ = bytes_.size() + 1;
      return 0;
    }
    const std::uint32_t value =
        std::to_integer<std::uint32_t>(bytes_[at_]) | std::to_integer<std::uint32_t>(bytes_[at_ + 1]) << 8;
    at_ += 2;
    return value;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t now_ = 0, next_ = 0;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H
