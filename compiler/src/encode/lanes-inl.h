// Floats side by side, one block a lane, by Google Highway: included once for each instruction set that a file is
// compiled for. Every operation is a single IEEE one (no fused multiply-add) and nothing is summed across lanes, so
// that all instruction sets give the same bits, whatever their width.
#if defined(BILLOW_COMPILER_ENCODE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BILLOW_COMPILER_ENCODE_LANES_INL_H
#undef BILLOW_COMPILER_ENCODE_LANES_INL_H
#else
#define BILLOW_COMPILER_ENCODE_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FloatLanes = hn::CappedTag<float, 8>;
using V = hn::Vec<FloatLanes>;
using M = hn::Mask<FloatLanes>;

// Arrays of one float a block hold eight; a vector takes some of them, and loops run over the rest.
inline constexpr std::uint32_t kBlockLanes = 8;
inline constexpr auto kLanes = static_cast<std::uint32_t>(hn::MaxLanes(FloatLanes()));

HWY_INLINE V all(float value) {
  return hn::Set(FloatLanes(), value);
}
HWY_INLINE V load(const float* from) {
  return hn::LoadU(FloatLanes(), from);
}
HWY_INLINE void store(V value, float* to) {
  hn::StoreU(value, FloatLanes(), to);
}
HWY_INLINE V select(M condition, V yes, V no) {
  return hn::IfThenElse(condition, yes, no);
}
HWY_INLINE V min(V a, V b) {
  return hn::Min(a, b);
}
HWY_INLINE V max(V a, V b) {
  return hn::Max(a, b);
}
HWY_INLINE V clamp(V value, float low, float high) {
  return hn::Min(hn::Max(value, all(low)), all(high));
}
// The integer part of values in [0, 2^22].
HWY_INLINE V truncate(V value) {
  return hn::Trunc(value);
}
// The nearest integer (halves upwards) of values in [0, 2^22].
HWY_INLINE V round(V value) {
  return hn::Trunc(hn::Add(value, all(0.5f)));
}
HWY_INLINE bool any(M condition) {
  return !hn::AllFalse(FloatLanes(), condition);
}
HWY_INLINE M both(M a, M b) {
  return hn::And(a, b);
}

}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
