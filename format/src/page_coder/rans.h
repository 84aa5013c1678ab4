// The entropy coder under the page codec: range variant of asymmetric numeral systems (J. Duda, "Asymmetric numeral
// systems", arXiv:1311.2540) with two 32-bit states that take turns, renormalised by 16-bit words; and bits without a
// model, from the end of the same bytes. spec/pagecodec.md.
//
// An interval is [start, start + size) of [0, kScale), size from 1 to kScale.
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace billow::format::page_coder {

static_assert(std::endian::native == std::endian::little);

inline constexpr std::uint32_t kScaleLog2 = 15;
inline constexpr std::uint32_t kScale = 1u << kScaleLog2;
inline constexpr std::uint32_t kStateLow = 1u << 16;  // states are at least this between intervals

// Collects intervals; they are coded backwards at the end, since a decoder reads what was coded last.
class RansEncoder {
 public:
  void put(std::uint32_t start, std::uint32_t size) { intervals_.push_back(start << 16 | size); }

  void reserve(std::size_t count) { intervals_.reserve(intervals_.size() + count); }

  // `count` bits without a model, at most 32.
  void putBits(std::uint32_t count, std::uint32_t value) {
    pending_ = pending_ << count | value;
    pendingCount_ += count;
    while (pendingCount_ >= 8) {
      pendingCount_ -= 8;
      bits_.push_back(static_cast<std::byte>(pending_ >> pendingCount_));
    }
  }

  // The bytes of all that was put since the last call.
  std::vector<std::byte> finish() {
    words_.resize(intervals_.size() + 4);
    std::uint16_t* word = words_.data() + words_.size();
    std::uint32_t states[2] = {kStateLow, kStateLow};
    for (std::size_t i = intervals_.size(); i-- > 0;) {
      const std::uint32_t size = intervals_[i] & 0xffff;
      std::uint32_t state = states[i & 1];
      // Without a branch: nobody can foretell it.
      const std::uint32_t full = 0u - (state >> 17 >= size);
      word[-1] = static_cast<std::uint16_t>(state);
      word += static_cast<std::int32_t>(full);
      state -= full & (state - (state >> 16));
      states[i & 1] = state + quotient(state, size) * (kScale - size) + (intervals_[i] >> 16);
    }
    for (const std::uint32_t state : {states[1], states[0]}) {
      *--word = static_cast<std::uint16_t>(state >> 16);
      *--word = static_cast<std::uint16_t>(state);
    }
    const auto wordCount = static_cast<std::size_t>(words_.data() + words_.size() - word);
    if (pendingCount_ > 0) putBits(8 - pendingCount_, 0);
    std::vector<std::byte> out(2 * wordCount + bits_.size());
    std::memcpy(out.data(), word, 2 * wordCount);
    std::reverse_copy(bits_.begin(), bits_.end(), out.data() + 2 * wordCount);
    intervals_.clear();
    bits_.clear();
    return out;
  }

 private:
  // Sizes of tokens are multiples of 32, and multiplying is quicker than dividing: n / d is n * (2^37 / d + 1) >> 37
  // for n < 2^27 and d <= 2^10.
  static constexpr auto kReciprocals = [] {
    std::array<std::uint64_t, kScale / 32 + 1> all{};
    for (std::uint64_t i = 1; i < all.size(); ++i) all[i] = (std::uint64_t{1} << 37) / i + 1;
    return all;
  }();
  static std::uint32_t quotient(std::uint32_t state, std::uint32_t size) {
    if (size % 32 != 0) return state / size;
    return static_cast<std::uint32_t>((state / 32) * kReciprocals[size / 32] >> 37);
  }

  std::vector<std::uint32_t> intervals_;  // start << 16 | size
  std::vector<std::uint16_t> words_;
  std::vector<std::byte> bits_;
  std::uint64_t pending_ = 0;
  std::uint32_t pendingCount_ = 0;
};

// Stored bytes with room on both sides, so that a decoder may read a little beyond them.
class PaddedBytes {
 public:
  static constexpr std::size_t kBefore = 16, kAfter = 80;

  explicit PaddedBytes(std::span<const std::byte> bytes) : bytes_(kBefore + bytes.size() + kAfter) {
    std::copy(bytes.begin(), bytes.end(), bytes_.begin() + kBefore);
  }
  const std::byte* begin() const { return bytes_.data() + kBefore; }
  std::size_t size() const { return bytes_.size() - kBefore - kAfter; }

 private:
  std::vector<std::byte> bytes_;
};

// Reads what an encoder wrote. Of other bytes it gives some intervals and bits, and says so in sound().
class RansDecoder {
 public:
  // `bytes` must live as long as this.
  explicit RansDecoder(const PaddedBytes& bytes)
      : begin_(bytes.begin()), size_(bytes.size()), at_(begin_), end_(begin_ + size_) {
    for (std::uint32_t* state : {&now_, &next_}) {
      *state = word();
      *state |= word() << 16;
    }
  }

  // The number in [0, kScale) that lies in the next interval.
  std::uint32_t peek() const { return now_ & (kScale - 1); }

  // The next number's interval. At most kUnchecked calls without one of stayInside().
  static constexpr std::uint32_t kUnchecked = 32;
  void takeUnchecked(std::uint32_t start, std::uint32_t size) {
    const std::uint32_t state = size * (now_ >> kScaleLog2) + (now_ & (kScale - 1)) - start;
    std::uint16_t next;
    std::memcpy(&next, at_, sizeof next);
    // Without a branch: nobody can foretell it.
    const std::uint32_t low = 0u - (state < kStateLow);
    now_ = std::exchange(next_, state + (low & ((state << 16 | next) - state)));
    at_ += low & 2;
  }
  void stayInside() { at_ = std::min(at_, end_ + 2); }

  void take(std::uint32_t start, std::uint32_t size) {
    takeUnchecked(start, size);
    stayInside();
  }

  // Makes at least 56 bits without a model ready.
  void refill() { window_ = nextBits(); }
  // `count` bits that are ready, the first one highest.
  std::uint32_t readyBits(std::uint32_t count) {
    const std::uint64_t value = window_ >> 1 >> (63 - count);
    window_ <<= count;
    bitsRead_ += count;
    return static_cast<std::uint32_t>(value);
  }
  // At most 32 bits.
  std::uint32_t bits(std::uint32_t count) {
    refill();
    return readyBits(count);
  }

  // Whether all bytes were read and none was missing, the bits beside the last are 0, and both states are where an
  // encoder starts.
  bool sound() const {
    const std::size_t bitBytes = (bitsRead_ + 7) >> 3;
    const auto wordBytes = static_cast<std::size_t>(at_ - begin_);
    if (wordBytes > size_ || bitBytes != size_ - wordBytes) return false;
    const std::uint64_t rest = (bitsRead_ & 7) == 0 ? 0 : nextBits() >> (56 + (bitsRead_ & 7));
    return rest == 0 && now_ == kStateLow && next_ == kStateLow;
  }

 private:
  std::uint64_t nextBits() const {
    const std::size_t whole = std::min(bitsRead_ >> 3, size_ + 1);
    std::uint64_t window;
    std::memcpy(&window, begin_ + size_ - whole - sizeof window, sizeof window);
    return window << (bitsRead_ & 7);
  }
  std::uint32_t word() {
    std::uint16_t value;
    std::memcpy(&value, at_, sizeof value);
    at_ += 2;
    return value;
  }

  const std::byte* begin_;
  std::size_t size_;
  const std::byte* at_;  // the next word
  const std::byte* end_;
  std::size_t bitsRead_ = 0;
  std::uint64_t window_ = 0;  // of them, those that come next
  std::uint32_t now_ = 0, next_ = 0;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_RANS_H
