#include "encode/local_lanes.h"

#include <algorithm>

#include "encode/brick_lanes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/local_lanes.cpp"
#include <hwy/foreach_target.h>

#include "encode/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

constexpr int kRounds = 4;

void rangeOfCells(Cells& cells) {
  for (std::uint32_t g = 0; g < 2; ++g) {
    for (std::uint32_t lane = 0; lane < 8; lane += kLanes) {
      V low = all(2), high = all(-1), count = all(0);
      for (std::uint32_t k = 0; k < kCellVoxels; ++k) {
        const V place = load(cells.place[g][k] + lane);
        const V weight = load(cells.weight[g][k] + lane);
        const M active = hn::Gt(weight, all(0));
        low = select(active, min(low, place), low);
        high = select(active, max(high, place), high);
        count = hn::Add(count, weight);
      }
      store(low, cells.low[g] + lane);
      store(high, cells.high[g] + lane);
      store(count, cells.count[g] + lane);
    }
  }
}

// Some cells side by side: the lanes of one vector.
struct CellLanes {
  const float* place;  // of voxel 0; those of voxel k are 8 k further
  const float* weight;
  V count;
  CellScale scale;

  V target(std::uint32_t k) const {
    return hn::Add(all(scale.offset), hn::Mul(all(scale.factor), load(place + 8 * k)));
  }
};

struct Ends {
  V base, top;
};

// Ends as bytes hold them.
Ends toBytes(Ends ends) {
  return {round(clamp(ends.base, 0, 255)), round(clamp(ends.top, 0, 255))};
}

struct Slope {
  V rise;     // of a step of the index
  V inverse;  // 0 where there is none
};

Slope slopeOf(const CellLanes& cells, Ends ends) {
  const V difference = hn::Sub(ends.top, ends.base);
  const V last = all(cells.scale.last);
  const M flat = hn::Eq(difference, all(0));
  return {hn::Div(difference, last), hn::IfThenZeroElse(flat, hn::Div(last, difference))};
}

V nearestIndex(const CellLanes& cells, Ends ends, Slope slope, V target) {
  return round(clamp(hn::Mul(hn::Sub(target, ends.base), slope.inverse), cells.scale.first, cells.scale.last));
}

// The squared error of these ends; `next` becomes the ends that fit best where voxels keep the indices that they have
// with these.
V tryEnds(const CellLanes& cells, Ends ends, Ends& next) {
  const Slope slope = slopeOf(cells, ends);
  V error = all(0), sumI = all(0), sumII = all(0), sumT = all(0), sumIT = all(0);
  for (std::uint32_t k = 0; k < kCellVoxels; ++k) {
    const V target = cells.target(k);
    const V weight = load(cells.weight + 8 * k);
    const V index = nearestIndex(cells, ends, slope, target);
    const V off = hn::Sub(target, hn::Add(ends.base, hn::Mul(slope.rise, index)));
    const V counted = hn::Mul(weight, index);
    error = hn::Add(error, hn::Mul(weight, hn::Mul(off, off)));
    sumI = hn::Add(sumI, counted);
    sumII = hn::Add(sumII, hn::Mul(counted, index));
    sumT = hn::Add(sumT, hn::Mul(weight, target));
    sumIT = hn::Add(sumIT, hn::Mul(counted, target));
  }
  const V determinant = hn::Sub(hn::Mul(cells.count, sumII), hn::Mul(sumI, sumI));
  const M fixed = hn::Gt(determinant, all(0.5f));
  const V n = max(cells.count, all(1));
  const V rise = select(
      fixed, hn::Div(hn::Sub(hn::Mul(cells.count, sumIT), hn::Mul(sumI, sumT)), select(fixed, determinant, all(1))),
      all(0));
  next.base = hn::Div(hn::Sub(sumT, hn::Mul(rise, sumI)), n);
  next.top = hn::Add(next.base, hn::Mul(rise, all(cells.scale.last)));
  return error;
}

// Levels in the middle of equal parts of the range, the first of them at index `first`.
Ends startEnds(const CellLanes& cells, V low, V high) {
  const float levels = cells.scale.last - cells.scale.first + 1;
  const V factor = all(cells.scale.factor);
  const V step = hn::Mul(hn::Mul(hn::Sub(high, low), factor), all(1 / levels));
  const V lowest = hn::Add(all(cells.scale.offset), hn::Mul(factor, low));
  const V base = hn::Add(lowest, hn::Mul(step, all(0.5f - cells.scale.first)));
  return {base, hn::Add(base, hn::Mul(step, all(cells.scale.last)))};
}

Ends fitEnds(const CellLanes& cells, Ends start) {
  Ends ends = toBytes(start), best = ends, next = ends;
  V least = tryEnds(cells, ends, next);
  for (int round = 1; round < kRounds; ++round) {
    ends = toBytes(next);
    const V error = tryEnds(cells, ends, next);
    const M better = hn::Lt(error, least);
    least = select(better, error, least);
    best.base = select(better, ends.base, best.base);
    best.top = select(better, ends.top, best.top);
  }
  const M none = hn::Eq(cells.count, all(0));
  return {hn::IfThenZeroElse(none, best.base), hn::IfThenZeroElse(none, best.top)};
}

void fitCells(const Cells& cells, const CellScale& scale, CellFit& fit) {
  for (std::uint32_t g = 0; g < 2; ++g) {
    for (std::uint32_t lane = 0; lane < 8; lane += kLanes) {
      const CellLanes lanes = {cells.place[g][0] + lane, cells.weight[g][0] + lane, load(cells.count[g] + lane), scale};
      const Ends ends = fitEnds(lanes, startEnds(lanes, load(cells.low[g] + lane), load(cells.high[g] + lane)));
      store(ends.base, fit.base[g] + lane);
      store(ends.top, fit.top[g] + lane);
      const Slope slope = slopeOf(lanes, ends);
      for (std::uint32_t k = 0; k < kCellVoxels; ++k) {
        const V weight = load(lanes.weight + 8 * k);
        store(hn::Mul(weight, nearestIndex(lanes, ends, slope, lanes.target(k))), fit.index[g][k] + lane);
      }
    }
  }
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(rangeOfCells);
HWY_EXPORT(fitCells);

namespace {

void byCells(const float* from, float (*to)[kCellVoxels][8]) {
  for (std::uint32_t x = 0; x < 8; ++x) {
    for (std::uint32_t y = 0; y < 8; ++y) {
      for (std::uint32_t z = 0; z < 8; ++z) {
        to[x >> 2][(x & 3) * 8 + (y & 3) * 2 + (z & 1)][(y >> 2) * 4 + (z >> 1)] = *from++;
      }
    }
  }
}

}  // namespace

void fillCells(const BrickSource& brick, ValueRange range, Cells& cells) {
  // In double: the width of any two floats is finite there.
  const auto low = static_cast<double>(range.min);
  const double width = static_cast<double>(range.max) - low;
  const double inverse = width > 0 ? 1 / width : 0;
  TexelWeights numbers;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const double place = (static_cast<double>((*brick.values)[i]) - low) * inverse;
    // Inactive voxels may hold anything.
    numbers[i] = static_cast<float>(place > 0 ? (place < 1 ? place : 1) : 0);
  }
  byCells(numbers.data(), cells.place);
  if (brick.activeCount == format::kBrickVoxels) {
    std::fill_n(&cells.weight[0][0][0], format::kBrickVoxels, 1.0f);
  } else {
    texelWeights(brick, numbers);
    byCells(numbers.data(), cells.weight);
  }
  HWY_DYNAMIC_DISPATCH(rangeOfCells)(cells);
}

void fitCells(const Cells& cells, const CellScale& scale, CellFit& fit) {
  HWY_DYNAMIC_DISPATCH(fitCells)(cells, scale, fit);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
