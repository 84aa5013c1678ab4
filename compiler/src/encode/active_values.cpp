#include "encode/active_values.h"

#include <bit>

#include "encode/brick_lanes.h"

namespace billow::compiler {
namespace {

template <class Function>
void forEachActive(const format::Mask3& active, const Function& function) {
  for (std::uint32_t w = 0; w < 16; ++w) {
    for (std::uint32_t word = active.words[w]; word != 0; word &= word - 1) {
      function(w * 32 + static_cast<std::uint32_t>(std::countr_zero(word)));
    }
  }
}

}  // namespace

ActiveValues::ActiveValues(const BrickSource& brick) : range(activeRange(brick)), count(0) {
  if (brick.activeCount == format::kBrickVoxels) {
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) value[i] = (*brick.values)[i];
    count = format::kBrickVoxels;
  } else {
    forEachActive(*brick.active, [&](std::uint32_t i) { value[count++] = (*brick.values)[i]; });
  }
  // In double: the width of any two floats is finite there.
  const auto low = static_cast<double>(range.min);
  const double width = static_cast<double>(range.max) - low;
  const double inverse = width > 0 ? 1 / width : 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    place[i] = static_cast<float>((static_cast<double>(value[i]) - low) * inverse);
  }
}

void spread(const BrickSource& brick, const float* ofActive, format::Texels& texels) {
  if (brick.activeCount != format::kBrickVoxels) texels.fill(0);
  forEachActive(*brick.active, [&](std::uint32_t i) {
    texels[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(*ofActive++));
  });
}

}  // namespace billow::compiler
