#include "stream/distance_field.h"

#include <algorithm>

#include "interface.h"

namespace billow::runtime {
namespace {

constexpr std::uint8_t kFar = 255;

// All loops over rows are plain ones over bytes, of which compilers make vector code.
void lower(std::uint8_t* row, const std::uint8_t* by, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) row[i] = std::min(row[i], by[i]);
}

constexpr std::uint8_t oneMore(std::uint8_t distance) {
  return static_cast<std::uint8_t>(std::min<std::uint8_t>(distance, kFar - 1) + 1);
}

}  // namespace

std::uint64_t DistanceField::scratchOf(const format::CellBox& cells) {
  const std::uint64_t z = std::uint64_t{cells.dim[2]} + 1;
  return (std::uint64_t{cells.dim[0]} + 1) * (cells.dim[1] + 1) * z + (z + 2) + z;
}

DistanceField::DistanceField(const format::CellBox& cells, std::span<std::uint8_t> scratch)
    : x_(cells.dim[0] + 1), y_(cells.dim[1] + 1), z_(cells.dim[2] + 1) {
  const std::size_t count = std::size_t{x_} * y_ * z_;
  cells_ = scratch.first(count);
  least_ = scratch.subspan(count, z_ + 2);
  near_ = scratch.subspan(count + z_ + 2, z_);
}

void DistanceField::addTo(std::span<std::uint32_t> table) {
  std::fill(cells_.begin(), cells_.end(), kFar);
  markBusy(table);
  // Two sweeps of the 3x3x3 neighbourhood give exact distances in the maximum norm.
  sweep(1);
  sweep(-1);
  std::uint32_t* entries = table.data();
  for (std::uint32_t x = 1; x < x_; ++x) {
    for (std::uint32_t y = 1; y < y_; ++y, entries += z_ - 1) {
      const std::uint8_t* distances = row(x, y) + 1;
      for (std::uint32_t z = 0; z + 1 < z_; ++z) {
        entries[z] = distances[z] != 0 ? gpu::kSkip | distances[z] : entries[z];
      }
    }
  }
}

// A cell with a record is sampled, and so are the seven before it.
void DistanceField::markBusy(std::span<const std::uint32_t> table) {
  const std::uint32_t* entries = table.data();
  std::fill(least_.begin(), least_.end(), kFar);
  for (std::uint32_t x = 1; x < x_; ++x) {
    for (std::uint32_t y = 1; y < y_; ++y, entries += z_ - 1) {
      for (std::uint32_t z = 1; z < z_; ++z) least_[z] = entries[z - 1] != 0 ? 0 : kFar;
      for (std::uint32_t z = 0; z < z_; ++z) near_[z] = std::min(least_[z], least_[z + 1]);
      for (std::uint32_t i = 0; i < 4; ++i) lower(row(x - (i >> 1), y - (i & 1)), near_.data(), z_);
    }
  }
}

// Into near_: the least of the rows that were swept before this one, over three cells each.
void DistanceField::gatherNear(int x, int y, int order) {
  std::fill(least_.begin(), least_.end(), kFar);
  const auto add = [&](int atX, int atY) {
    if (atX < 0 || atX >= static_cast<int>(x_) || atY < 0 || atY >= static_cast<int>(y_)) return;
    lower(least_.data() + 1, row(static_cast<std::uint32_t>(atX), static_cast<std::uint32_t>(atY)), z_);
  };
  for (int dy = -1; dy <= 1; ++dy) add(x - order, y + dy);
  add(x, y - order);
  for (std::uint32_t z = 0; z < z_; ++z) {
    near_[z] = std::min(std::min(least_[z], least_[z + 1]), least_[z + 2]);
  }
}

void DistanceField::sweep(int order) {
  const int sizeX = static_cast<int>(x_), sizeY = static_cast<int>(y_), sizeZ = static_cast<int>(z_);
  const auto from = [order](int size) { return order > 0 ? 0 : size - 1; };
  for (int x = from(sizeX); x >= 0 && x < sizeX; x += order) {
    for (int y = from(sizeY); y >= 0 && y < sizeY; y += order) {
      gatherNear(x, y, order);
      std::uint8_t* const cells = row(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
      std::uint8_t before = kFar;
      for (int z = from(sizeZ); z >= 0 && z < sizeZ; z += order) {
        const auto at = static_cast<std::size_t>(z);
        before = std::min(cells[at], oneMore(std::min(near_[at], before)));
        cells[at] = before;
      }
    }
  }
}

}  // namespace billow::runtime
