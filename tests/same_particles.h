// Whether the GPU evaluates an effect's particles as format::particlesAt() does.
#ifndef BILLOW_TESTS_SAME_PARTICLES_H
#define BILLOW_TESTS_SAME_PARTICLES_H

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "billow/format/effect.h"

namespace billow::tests {

// By how much the GPU may be off: single precision, some tens of last digits.
struct ParticleTolerance {
  double place = 1e-5;     // world units for each that the particle is away from the origin, and one
  double relative = 1e-5;  // of radius, shape, extinction, of colours' largest
  double turn = 1e-4;      // of a quaternion's components
  double age = 2e-6;       // share of the life
  double map = 2e-4;       // maps, along their circle
};

class SameParticles {
 public:
  explicit SameParticles(const ParticleTolerance& tolerance = {}) : tolerance_(tolerance) {}

  // Both in the order of particlesAt(). The GPU's of radius 0 are not there; where both differ about who is alive, it
  // is one at the very begin or end of its life.
  void expect(const std::vector<format::Particle>& cpu, const std::vector<format::Particle>& gpu) {
    std::vector<format::Particle> there;
    const auto visible = [](const format::Particle& particle) { return particle.radius > 0; };
    std::copy_if(gpu.begin(), gpu.end(), std::back_inserter(there), visible);
    std::size_t j = 0;
    for (std::size_t i = 0; i < cpu.size(); ++i) {
      if (!visible(cpu[i])) continue;
      while (j + 1 < there.size() && there[j].seed != cpu[i].seed && there[j + 1].seed == cpu[i].seed) {
        expectAtAnEnd(there[j++]);
      }
      if (j >= there.size() || there[j].seed != cpu[i].seed) {
        expectAtAnEnd(cpu[i]);
        continue;
      }
      expectSame(cpu[i], there[j++]);
      ++compared_;
    }
    for (; j < there.size(); ++j) expectAtAnEnd(there[j]);
  }
  std::size_t compared() const { return compared_; }
  std::size_t atEnds() const { return atEnds_; }

 private:
  void expectAtAnEnd(const format::Particle& particle) {
    const auto age = static_cast<double>(particle.age);
    EXPECT_LT(std::min(age, 1 - age), tolerance_.age) << "alive on one side alone";
    ++atEnds_;
  }

  static double largest(const float (&v)[3]) {
    return static_cast<double>(std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}));
  }

  void expectSame(const format::Particle& a, const format::Particle& b) const {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(a.center[i], b.center[i], tolerance_.place * (1 + largest(a.center))) << "centre " << i;
      EXPECT_NEAR(a.shape[i], b.shape[i], tolerance_.relative * largest(a.shape)) << "shape " << i;
      EXPECT_NEAR(a.diffuse[i], b.diffuse[i], tolerance_.relative) << "diffuse " << i;
      EXPECT_NEAR(a.emission[i], b.emission[i], tolerance_.relative * (1 + largest(a.emission))) << "emission " << i;
    }
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot += static_cast<double>(a.rotation[i] * b.rotation[i]);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(a.rotation[i], dot < 0 ? -b.rotation[i] : b.rotation[i], tolerance_.turn) << "rotation " << i;
    }
    EXPECT_NEAR(a.radius, b.radius, tolerance_.relative * static_cast<double>(a.radius));
    EXPECT_NEAR(a.extinction, b.extinction, tolerance_.relative * (1 + static_cast<double>(a.extinction)));
    EXPECT_NEAR(a.displacement, b.displacement, tolerance_.relative);
    EXPECT_NEAR(a.age, b.age, tolerance_.age);
    EXPECT_EQ(format::kindIn(a.kind), format::kindIn(b.kind));
    EXPECT_EQ(a.material, b.material);
    expectSameMaps(a, b);
  }

  void expectSameMaps(const format::Particle& a, const format::Particle& b) const {
    if (a.map == b.map) {
      EXPECT_NEAR(format::mapShareIn(a.kind), format::mapShareIn(b.kind), tolerance_.map);
      return;
    }
    // On both sides of a map.
    const bool before = format::secondMapIn(a.map) == format::firstMapIn(b.map);
    EXPECT_TRUE(before || format::firstMapIn(a.map) == format::secondMapIn(b.map)) << a.map << " " << b.map;
    const format::Particle& young = before ? a : b;
    const format::Particle& old = before ? b : a;
    EXPECT_NEAR(1 - format::mapShareIn(young.kind) + format::mapShareIn(old.kind), 0, tolerance_.map);
  }

  ParticleTolerance tolerance_;
  std::size_t compared_ = 0, atEnds_ = 0;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SAME_PARTICLES_H
