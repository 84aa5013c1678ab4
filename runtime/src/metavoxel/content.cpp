#include "content.h"

#include <algorithm>
#include <cstring>

#include "billow/format/noise.h"

namespace billow::runtime {
namespace {

// Two hashes of 32 bits of a row of words, as metavoxel_compare.comp has them of particles.
class Hash {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(sizeof(T) % 4 == 0);
    std::array<std::uint32_t, sizeof(T) / 4> words;
    std::memcpy(words.data(), &value, sizeof(T));
    for (const std::uint32_t word : words) {
      low_ = format::hashInteger(low_ ^ word);
      high_ = format::hashInteger(high_ + word * 0x9e3779b1u);
    }
  }
  std::array<std::uint32_t, 2> both() const { return {low_, high_}; }

 private:
  std::uint32_t low_ = 0x2545f491u, high_ = 0x9e3779b9u;
};

}  // namespace

std::uint32_t hashOf(const Space& space) {
  Hash hash;
  hash.add(space.axes);
  hash.add(space.center);
  hash.add(space.voxel);
  return std::max(hash.both()[0], 1u);
}

std::array<std::uint32_t, 2> hashOf(const PlacedLayer& layer, std::uint64_t frameNumber) {
  const gpu::MarchParams& params = layer.params;
  Hash hash;
  hash.add(frameNumber);  // addresses are given to one frame after another
  hash.add(params.grids);
  hash.add(params.flow);
  hash.add(params.ambient.w);
  hash.add(params.albedo);
  hash.add(params.emission);
  hash.add(params.smoke);
  return hash.both();
}

}  // namespace billow::runtime
