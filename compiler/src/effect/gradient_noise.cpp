#include "effect/gradient_noise.h"

#include <cmath>

#include "billow/format/noise.h"

namespace billow::compiler {

Lattice latticeOf(const std::array<double, 3>& p) {
  Lattice lattice{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double whole = std::floor(p[i]);
    lattice.at[i] = static_cast<int>(whole);
    lattice.share[i] = p[i] - whole;
  }
  return lattice;
}

namespace {

// The slope at a lattice point times the way from it: one of the twelve directions to the edges of a cube.
double slope(std::uint32_t hash, double x, double y, double z) {
  const std::uint32_t which = hash >> 28;
  const double u = which < 8 ? x : y;
  const double v = which < 4 ? y : which == 12 || which == 14 ? x : z;
  return ((which & 1) != 0 ? -u : u) + ((which & 2) != 0 ? -v : v);
}

}  // namespace

double gradientNoise(const std::array<double, 3>& p, std::uint32_t seed) {
  const Lattice l = latticeOf(p);
  const auto corner = [&](int x, int y, int z) {
    return slope(format::hashPoint(l.at[0] + x, l.at[1] + y, l.at[2] + z, seed), l.share[0] - x, l.share[1] - y,
                 l.share[2] - z);
  };
  const double sx = fade(l.share[0]), sy = fade(l.share[1]), sz = fade(l.share[2]);
  const auto row = [&](int y, int z) { return mix(corner(0, y, z), corner(1, y, z), sx); };
  return mix(mix(row(0, 0), row(1, 0), sy), mix(row(0, 1), row(1, 1), sy), sz);
}

}  // namespace billow::compiler
