#include "encode/uniform_lanes.h"

#include "encode/error_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/uniform_lanes.cpp"
#include <hwy/foreach_target.h>

#include "encode/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

constexpr std::uint32_t kParts = kBlockLanes / kLanes;

// Eight sums whatever the vectors' width, added in one order: every machine gives the same bits.
struct EightSums {
  V part[kParts];
  EightSums() {
    for (V& v : part) v = all(0);
  }
  double total() const {
    float lane[kBlockLanes];
    for (std::uint32_t p = 0; p < kParts; ++p) store(part[p], lane + p * kLanes);
    double sum = 0;
    for (const float value : lane) sum += static_cast<double>(value);
    return sum;
  }
};

LevelSums sumNearest(const ActiveValues& active, const Levels& levels) {
  const V first = all(levels.first), step = all(levels.step);
  const V inverse = all(levels.step > 0 ? 1 / levels.step : 0);
  EightSums level, levelSquared, product, place, error;
  const auto add = [&](std::uint32_t i, std::uint32_t p, M counts) {
    const V t = hn::IfThenElseZero(counts, load(active.place + i));  // beyond the count lies anything, NaN too
    const V nearest = round(clamp(hn::Mul(hn::Sub(t, first), inverse), 0, levels.last));
    const V off = hn::Sub(t, hn::Add(first, hn::Mul(step, nearest)));
    const V l = hn::IfThenElseZero(counts, nearest);
    level.part[p] = hn::Add(level.part[p], l);
    levelSquared.part[p] = hn::Add(levelSquared.part[p], hn::Mul(l, l));
    product.part[p] = hn::Add(product.part[p], hn::Mul(l, t));
    place.part[p] = hn::Add(place.part[p], t);
    error.part[p] = hn::Add(error.part[p], hn::IfThenElseZero(counts, hn::Mul(off, off)));
  };
  const M whole = hn::FirstN(FloatLanes(), kLanes);
  for (std::uint32_t i = 0; i < active.count; i += kBlockLanes) {
    for (std::uint32_t p = 0; p < kParts; ++p) {
      const std::uint32_t at = i + p * kLanes;
      if (at + kLanes <= active.count) {
        add(at, p, whole);
      } else if (at < active.count) {
        add(at, p, hn::FirstN(FloatLanes(), active.count - at));
      }
    }
  }
  return {level.total(), levelSquared.total(), product.total(), place.total(), error.total()};
}

void measureIndices(const ActiveValues& active, const float* indices, Fit& fit) {
  const std::uint32_t count = active.count;
  // format::reconstruct, repeated here so that it can be vectorised; the tests hold the two together.
  alignas(32) float decoded[format::kBrickVoxels];
  for (std::uint32_t i = 0; i < count; ++i) {
    const float product = fit.scale * indices[i];
    decoded[i] = fit.lo + product;
  }
  ErrorSums sums;
  static_assert(ErrorSums::kParts == kBlockLanes);
  const auto add = [&](std::uint32_t i, std::uint32_t lane) {
    const double error = static_cast<double>(decoded[i]) - static_cast<double>(active.value[i]);
    const double magnitude = error < 0 ? -error : error;
    sums.squared[lane] += error * error;
    sums.largest[lane] = sums.largest[lane] > magnitude ? sums.largest[lane] : magnitude;
  };
  std::uint32_t i = 0;
  for (; i + kBlockLanes <= count; i += kBlockLanes) {
    for (std::uint32_t lane = 0; lane < kBlockLanes; ++lane) add(i + lane, lane);
  }
  for (std::uint32_t lane = 0; i + lane < count; ++lane) add(i + lane, lane);
  sums.setErrors(fit);
}

void quantise(const ActiveValues& active, std::uint32_t first, std::uint32_t last, float* indices, Fit& fit) {
  const double inverse = fit.scale > 0 ? 1 / static_cast<double>(fit.scale) : 0;
  const auto lo = static_cast<double>(fit.lo);
  const auto low = static_cast<double>(first), high = static_cast<double>(last);
  const std::uint32_t count = active.count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double raw = (static_cast<double>(active.value[i]) - lo) * inverse;
    const double above = raw > low ? raw : low;
    indices[i] = static_cast<float>(static_cast<std::int32_t>((above < high ? above : high) + 0.5));
  }
  HWY_NAMESPACE::measureIndices(active, indices, fit);
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(sumNearest);
HWY_EXPORT(quantise);
HWY_EXPORT(measureIndices);

LevelSums sumNearest(const ActiveValues& active, const Levels& levels) {
  return HWY_DYNAMIC_DISPATCH(sumNearest)(active, levels);
}

void quantise(const ActiveValues& active, std::uint32_t first, std::uint32_t last, float* indices, Fit& fit) {
  HWY_DYNAMIC_DISPATCH(quantise)(active, first, last, indices, fit);
}

void measureIndices(const ActiveValues& active, const float* indices, Fit& fit) {
  HWY_DYNAMIC_DISPATCH(measureIndices)(active, indices, fit);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
