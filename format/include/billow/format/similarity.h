// Similarities: transforms that turn, scale and move an effect as a whole, so that its particles stay what they are.
#ifndef BILLOW_FORMAT_SIMILARITY_H
#define BILLOW_FORMAT_SIMILARITY_H

#include <array>
#include <optional>

#include "billow/format/particle.h"

namespace billow::format {

// Point p goes to scale * (p turned by rotation) + translation.
struct Similarity {
  std::array<double, 4> rotation{0, 0, 0, 1};  // unit quaternion x y z w
  std::array<double, 3> translation{0, 0, 0};
  double scale = 1;  // in [1e-6, 1e6]
};

// Of a row-major 3x4 matrix. None where its columns differ in length or from right angles by more than a 1e-4th, where
// it mirrors, or where its scale or a number is out of range.
std::optional<Similarity> similarityOf(const std::array<double, 12>& matrix);

// Where a point goes, or a direction with its length: the same without the translation.
std::array<double, 3> transformed(const std::array<double, 3>& point, const Similarity& by);
std::array<double, 3> transformedWay(const std::array<double, 3>& way, const Similarity& by);

// What the particle looks like from outside of its effect. Lengths grow with the scale; extinction and emission shrink
// with it, so that a ray meets as much of both on its way through.
Particle transformed(const Particle& particle, const Similarity& by);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SIMILARITY_H
