// Effects that are turned, scaled and moved as a whole.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "billow/format/particle_field.h"
#include "billow/format/similarity.h"

namespace billow {
namespace {

using namespace format;
using Matrix = std::array<double, 12>;
using Vec3 = std::array<double, 3>;

// Turned by a random quaternion, scaled and moved: the textbook's matrix, apart from the code under test.
Matrix randomMatrix(std::mt19937& random, double scale) {
  std::normal_distribution<double> any;
  double q[4], length = 0;
  for (double& part : q) {
    part = any(random);
    length += part * part;
  }
  for (double& part : q) part /= std::sqrt(length);
  const auto [x, y, z, w] = std::array{q[0], q[1], q[2], q[3]};
  Matrix m{1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),     any(random),
           2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),     any(random),
           2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y), any(random)};
  for (std::size_t i = 0; i < 12; ++i) m[i] *= i % 4 == 3 ? 10 : scale;
  return m;
}

Vec3 times(const Matrix& m, const Vec3& p) {
  Vec3 result{};
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = m[i * 4] * p[0] + m[i * 4 + 1] * p[1] + m[i * 4 + 2] * p[2] + m[i * 4 + 3];
  }
  return result;
}

TEST(Similarity, GoesWhereItsMatrixDoes) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    const Matrix m = randomMatrix(random, std::pow(10.0, round % 9 - 4));
    const auto similarity = similarityOf(m);
    ASSERT_TRUE(similarity.has_value());
    const Vec3 p{0.3, -1.7, 2.4};
    const Vec3 expected = times(m, p), got = transformed(p, *similarity);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(got[i], expected[i], 1e-12 * (10 + similarity->scale)) << round;
  }
  // Half turns, where the quaternion's w is 0.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Matrix m{-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0};
    m[axis * 5] = 1;
    const Vec3 p{1, 2, 3};
    EXPECT_EQ(transformed(p, similarityOf(m).value()), times(m, p));
  }
}

TEST(Similarity, RefusesWhatIsNone) {
  const Matrix one{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_TRUE(similarityOf(one).has_value());
  const auto with = [&](std::size_t index, double value) {
    Matrix m = one;
    m[index] = value;
    return similarityOf(m).has_value();
  };
  EXPECT_TRUE(with(3, 1e6));
  EXPECT_TRUE(with(0, 1.00001));
  EXPECT_FALSE(with(0, 1.001));  // stretched
  EXPECT_FALSE(with(1, 0.001));  // sheared
  EXPECT_FALSE(with(10, -1));    // mirrored
  EXPECT_FALSE(with(10, 0));     // flat
  EXPECT_FALSE(with(7, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(with(2, std::nan("")));
  Matrix huge = one;
  for (double& value : huge) value *= 1e7;
  EXPECT_FALSE(similarityOf(huge).has_value());
}

// A ray through a particle meets the same matter after both were transformed.
TEST(Similarity, KeepsWhatARayMeets) {
  EffectTables tables;
  tables.materials.push_back({kProfileRadial, kNoRow, kNoRow, kNoRow, 0.5f, 2, 0, 0.25f});
  const ParticleField field(tables);
  std::mt19937 random(9);
  for (std::uint32_t kind = 0; kind < kKindCount; ++kind) {
    Particle particle{};
    particle.center[0] = 0.5f;
    particle.radius = 1.2f;
    particle.rotation[0] = 0.6f;
    particle.rotation[3] = 0.8f;
    const float shape[3] = {0.6f, 0.3f, 0.4f};
    std::copy(shape, shape + 3, particle.shape);
    std::fill(particle.diffuse, particle.diffuse + 3, 0.5f);
    std::fill(particle.emission, particle.emission + 3, 2.0f);
    particle.extinction = 3;
    particle.kind = kind;
    particle.map = kNoMap;
    particle.seed = 4;
    const auto by = similarityOf(randomMatrix(random, 2.5)).value();
    const Particle moved = transformed(particle, by);
    double inside = 0;
    for (int i = 0; i < 400; ++i) {
      const Vec3 p{0.5 + (i % 20 - 10) * 0.09, (i / 20 - 10) * 0.09, 0.05};
      const Vec3 q = transformed(p, by);
      const auto at = [&](const Particle& which, const Vec3& where) {
        return field.sample(which,
                            {static_cast<float>(where[0]), static_cast<float>(where[1]), static_cast<float>(where[2])});
      };
      const ParticleSample before = at(particle, p), after = at(moved, q);
      inside += static_cast<double>(before.density);
      EXPECT_NEAR(after.density, before.density, 1e-4f) << kind;
      EXPECT_NEAR(after.emission[0] * 2.5f, before.emission[0], 5e-4f) << kind;
      EXPECT_NEAR(moved.extinction * 2.5f, particle.extinction, 1e-6f);
    }
    EXPECT_GT(inside, 1);
  }
}

}  // namespace
}  // namespace billow
