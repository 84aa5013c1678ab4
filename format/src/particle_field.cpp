#include "billow/format/particle_field.h"

#include <algorithm>
#include <cmath>

#include "billow/format/noise.h"

namespace billow::format {
namespace {

using Vec3 = std::array<float, 3>;

float dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// World point to the particle's own space: the quaternion's conjugate turns it.
Vec3 toOwn(const Particle& particle, const Vec3& point) {
  const Vec3 d{point[0] - particle.center[0], point[1] - particle.center[1], point[2] - particle.center[2]};
  const Vec3 axis{-particle.rotation[0], -particle.rotation[1], -particle.rotation[2]};
  const Vec3 t = cross(axis, d);
  const Vec3 twice{2 * t[0], 2 * t[1], 2 * t[2]};
  const Vec3 u = cross(axis, twice);
  Vec3 own{};
  for (std::size_t i = 0; i < 3; ++i) own[i] = d[i] + particle.rotation[3] * twice[i] + u[i];
  return own;
}

// The share of the way from the middle to the surface before displacement; 2 where there is no inside.
float surfaceShare(const Particle& particle, const Vec3& q) {
  constexpr float kOutside = 2;
  const Vec3 shape{particle.shape[0], particle.shape[1], particle.shape[2]};
  const auto ratio = [](float length, float whole) { return whole > 0 ? length / whole : kOutside; };
  switch (kindIn(particle.kind)) {
    case kKindSphere:
      return ratio(std::sqrt(dot(q, q)), particle.radius);
    case kKindEllipsoid: {
      const Vec3 s{ratio(q[0], shape[0]), ratio(q[1], shape[1]), ratio(q[2], shape[2])};
      return std::sqrt(dot(s, s));
    }
    case kKindCapsule: {
      const float half = dot(shape, shape);
      const float along = half > 0 ? std::clamp(dot(q, shape) / half, -1.0f, 1.0f) : 0;
      const Vec3 off{q[0] - along * shape[0], q[1] - along * shape[1], q[2] - along * shape[2]};
      return ratio(std::sqrt(dot(off, off)), particle.radius - std::sqrt(half));
    }
    default: {
      const float x = ratio(std::abs(q[0]), shape[0]), y = ratio(std::abs(q[1]), shape[1]);
      return std::max({x, y, ratio(std::abs(q[2]), shape[2])});
    }
  }
}

float erosion(const Particle& particle, const ParticleMaterial& material, const Vec3& q) {
  if (!(material.erosion > 0)) return 1;
  const auto at = [&](float x) { return x / particle.radius * material.erosionFrequency; };
  const float noise = erosionNoise(at(q[0]), at(q[1]), at(q[2]), particle.seed);
  return std::clamp(1 - material.erosion + noise, 0.0f, 1.0f);
}

Vec3 times(const float (&a)[3], const Vec3& b, float factor) {
  return {a[0] * b[0] * factor, a[1] * b[1] * factor, a[2] * b[2] * factor};
}

}  // namespace

std::array<float, 3> sampleRamp(const RampTable& ramp, float radius, float age) {
  const auto split = [](float x, std::uint32_t count, std::size_t& index) {
    const float at = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(count - 1);
    index = std::min<std::size_t>(static_cast<std::size_t>(at), count - 2);
    return at - static_cast<float>(index);
  };
  std::size_t column = 0, row = 0;
  const float u = split(radius, kRampRadii, column), v = split(age, kRampAges, row);
  std::array<float, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto along = [&](std::size_t r) {
      const float left = ramp.values[r][column][i];
      return left + (ramp.values[r][column + 1][i] - left) * u;
    };
    const float young = along(row);
    colour[i] = young + (along(row + 1) - young) * v;
  }
  return colour;
}

ParticleField::ParticleField(const EffectTables& tables) : tables_(tables) {
  maps_.reserve(tables.maps.size());
  for (const CubeMap& map : tables.maps) maps_.emplace_back(map);
}

float ParticleField::displacementMap(const Particle& particle, const std::array<float, 3>& q) const {
  if (particle.map == kNoMap) return 1;
  const float first = maps_[firstMapIn(particle.map)].sample(q), share = mapShareIn(particle.kind);
  return share > 0 ? first + (maps_[secondMapIn(particle.map)].sample(q) - first) * share : first;
}

float ParticleField::profile(const ParticleMaterial& material, float r) const {
  if (material.profile == kProfileConstant) return 1;
  if (material.profile == kProfileRadial) return 1 - r * r;
  return std::clamp(sampleCurve(tables_.curves[material.profileRow], r), 0.0f, 1.0f);
}

ParticleSample ParticleField::sample(const Particle& particle, const std::array<float, 3>& point) const {
  ParticleSample result;
  if (!(particle.radius > 0)) return result;
  const Vec3 q = toOwn(particle, point);
  const float share = surfaceShare(particle, q);
  if (!(share < 1)) return result;
  const ParticleMaterial& material = tables_.materials[particle.material];
  const float m = displacementMap(particle, q);
  const float r = share / (1 - particle.displacement * (1 - m));
  if (!(r < 1)) return result;
  const float fade = std::min((1 - r) / material.softness, 1.0f);
  result.density = profile(material, r) * fade * erosion(particle, material, q);
  const auto ramp = [&](std::uint32_t number) {
    return number == kNoRow ? Vec3{1, 1, 1} : sampleRamp(tables_.ramps[number], r, particle.age);
  };
  result.diffuse = times(particle.diffuse, ramp(material.diffuseRamp), 1 - material.occlusion * (1 - m));
  result.emission = times(particle.emission, ramp(material.emissionRamp), result.density);
  return result;
}

}  // namespace billow::format
