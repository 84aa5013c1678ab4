// Pictures that descriptions refer to.
#ifndef BILLOW_COMPILER_EFFECT_IMAGE_H
#define BILLOW_COMPILER_EFFECT_IMAGE_H

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace billow::compiler {

// Row by row from the top; red, green, blue, linear and finite.
struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<std::array<float, 3>> pixels;

  // Linear between the four nearest pixels, whose middles lie at (i + 1/2) / size; the outermost go on outward, or
  // around where `wrap`, along u.
  std::array<double, 3> sample(double u, double v, bool wrap) const;
};

// Reads *.exr (channels R, G, B, or Y for all three) or *.png (its values made linear). At most 8192 pixels an edge and
// 2^24 in all. Throws Error: Fault::file where it cannot be opened, Fault::input where it is broken, too large or of
// another kind.
Image readImage(const std::string& path);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_IMAGE_H
