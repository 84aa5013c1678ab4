// XXH3-64, the one checksum of a pack.
#ifndef BILLOW_FORMAT_SRC_HASH_H
#define BILLOW_FORMAT_SRC_HASH_H

#include <xxhash.h>

#include <bit>
#include <cstdint>
#include <memory>
#include <new>
#include <span>

namespace billow::format {

static_assert(std::endian::native == std::endian::little, "packs are read and written in place, as little-endian data");

inline std::uint64_t hashBytes(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

// Its low half.
inline std::uint32_t lowHash(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(hashBytes(bytes));
}

// The checksum of bytes that arrive in pieces.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState(), &XXH3_freeState) {
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
  }
  void add(std::span<const std::byte> bytes) { XXH3_64bits_update(state_.get(), bytes.data(), bytes.size()); }
  std::uint64_t digest() const { return XXH3_64bits_digest(state_.get()); }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_HASH_H
