// What a particle adds at a point: the reference for whatever fills volumes with particles. particle.h has the
// formulae.
#ifndef BILLOW_FORMAT_PARTICLE_FIELD_H
#define BILLOW_FORMAT_PARTICLE_FIELD_H

#include <array>
#include <cstdint>
#include <vector>

#include "billow/format/cube_map.h"
#include "billow/format/effect.h"
#include "billow/format/particle.h"

namespace billow::format {

// Red, green and blue (shares of a ramp's colour) at a radius r and an age, both clamped to [0, 1].
std::array<float, 3> sampleRamp(const RampTable& ramp, float radius, float age);

struct ParticleSample {
  float density = 0;                // in [0, 1]; times the particle's extinction: what it adds
  std::array<float, 3> diffuse{};   // albedo there
  std::array<float, 3> emission{};  // radiance per world unit, density included
};

class ParticleField {
 public:
  // Decodes the cube maps. `tables` must keep the rules and outlive this.
  explicit ParticleField(const EffectTables& tables);

  // At a world point. The particle must be one of particlesAt() for these tables.
  ParticleSample sample(const Particle& particle, const std::array<float, 3>& point) const;

 private:
  float displacementMap(const Particle& particle, const std::array<float, 3>& q) const;
  float profile(const ParticleMaterial& material, float r) const;

  const EffectTables& tables_;
  std::vector<DecodedCube> maps_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_PARTICLE_FIELD_H
