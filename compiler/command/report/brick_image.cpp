#include "report/brick_image.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

#include "report/html.h"

namespace billow::command {
namespace {

using Colour = std::array<double, 3>;  // sRGB, 0 to 255

// Viridis at nine even steps (van der Walt and Smith, matplotlib): even in lightness, and read by colour-blind eyes.
constexpr Colour kValues[] = {{68, 1, 84},    {71, 45, 123}, {59, 82, 139},  {44, 114, 142}, {33, 145, 140},
                              {40, 174, 128}, {94, 201, 98}, {173, 220, 48}, {253, 231, 37}};
// Purple to orange through near white (ColorBrewer PuOr, reversed): the two signs differ for every eye.
constexpr Colour kDifferences[] = {{84, 39, 136},   {153, 142, 195}, {216, 218, 235}, {247, 247, 247},
                                   {254, 224, 182}, {241, 163, 64},  {179, 88, 6}};

// A veil over the page's own colour, light or dark.
constexpr Colour kInactive{128, 128, 128};
constexpr std::uint8_t kInactiveAlpha = 40;

// `at` in [0, 1].
Colour colourAt(std::span<const Colour> stops, double at) {
  const double place = std::clamp(at, 0.0, 1.0) * static_cast<double>(stops.size() - 1);
  const auto stop = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  const double part = place - static_cast<double>(stop);
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = stops[stop][c] + part * (stops[stop + 1][c] - stops[stop][c]);
  return colour;
}

std::string gradient(std::span<const Colour> stops) {
  std::string text = "linear-gradient(to right";
  for (const Colour& stop : stops) text += fmt::format(",rgb({:.0f},{:.0f},{:.0f})", stop[0], stop[1], stop[2]);
  return text + ")";
}

class Canvas {
 public:
  Canvas(std::uint32_t width, std::uint32_t height)
      : width_(width), height_(height), rgba_(std::size_t{width} * height * 4) {}

  void set(std::uint32_t x, std::uint32_t y, const Colour& colour, std::uint8_t alpha) {
    std::uint8_t* pixel = &rgba_[(std::size_t{y} * width_ + x) * 4];
    for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(std::lround(colour[c]));
    pixel[3] = alpha;
  }

  std::string dataUri() const {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = width_;
    image.height = height_;
    image.format = PNG_FORMAT_RGBA;
    std::vector<std::byte> bytes(std::size_t{64} + rgba_.size() * 2 + height_ * 16);
    png_alloc_size_t size = bytes.size();
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgba_.data(), 0, nullptr) == 0) {
      throw std::runtime_error(std::string("libpng: ") + image.message);
    }
    bytes.resize(size);
    return "data:image/png;base64," + base64(bytes);
  }

 private:
  std::uint32_t width_, height_;
  std::vector<std::uint8_t> rgba_;
};

enum class Panel { source, pack, difference };
constexpr Panel kPanels[] = {Panel::source, Panel::pack, Panel::difference};

Colour colourOf(const WorstBrick& brick, const BrickImage& scale, Panel panel, std::uint32_t voxel) {
  const double source = static_cast<double>(brick.source[voxel]), pack = static_cast<double>(brick.pack[voxel]);
  if (panel == Panel::difference) return colourAt(kDifferences, 0.5 + (pack - source) / (2 * scale.difference));
  const double low = static_cast<double>(scale.low), range = static_cast<double>(scale.high) - low;
  return colourAt(kValues, range > 0 ? ((panel == Panel::source ? source : pack) - low) / range : 0.5);
}

// One z slice of one panel, its upper left pixel at (left, top).
void drawSlice(const WorstBrick& brick, const BrickImage& scale, Panel panel, std::uint32_t z, std::uint32_t left,
               std::uint32_t top, Canvas& canvas) {
  for (std::uint32_t x = 0; x < 8; ++x) {
    for (std::uint32_t y = 0; y < 8; ++y) {
      const std::uint32_t voxel = format::voxelIndex(x, y, z);
      const bool active = format::maskBit(brick.active, voxel);
      const Colour colour = active ? colourOf(brick, scale, panel, voxel) : kInactive;
      canvas.set(left + x, top + 7 - y, colour, active ? 255 : kInactiveAlpha);
    }
  }
}

void findScale(const WorstBrick& brick, BrickImage& image) {
  image.low = std::numeric_limits<float>::max();
  image.high = std::numeric_limits<float>::lowest();
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(brick.active, i)) continue;
    image.low = std::min({image.low, brick.source[i], brick.pack[i]});
    image.high = std::max({image.high, brick.source[i], brick.pack[i]});
  }
  image.difference = brick.maxError;
}

}  // namespace

BrickImage drawBrick(const WorstBrick& brick) {
  constexpr std::uint32_t kPitch = 9;  // a slice and a gap
  BrickImage image;
  findScale(brick, image);
  Canvas slice(3 * kPitch - 1, 8), slices(8 * kPitch - 1, 3 * kPitch - 1);
  for (std::uint32_t p = 0; p < 3; ++p) {
    drawSlice(brick, image, kPanels[p], brick.worstVoxel & 7, p * kPitch, 0, slice);
    for (std::uint32_t z = 0; z < 8; ++z) drawSlice(brick, image, kPanels[p], z, z * kPitch, p * kPitch, slices);
  }
  image.slice = slice.dataUri();
  image.slices = slices.dataUri();
  return image;
}

std::string valueGradient() {
  return gradient(kValues);
}
std::string differenceGradient() {
  return gradient(kDifferences);
}

}  // namespace billow::command
