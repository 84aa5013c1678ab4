// Effects' particles into the draw's, behind those of the host: a thread a candidate.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "emitter.glsl"

layout(local_size_x = 64) in;
layout(buffer_reference, std430, buffer_reference_align = 16) writeonly buffer NewParticles { Particle items[]; };

// The last job whose first particle is not beyond `place`.
uint jobOf(uint place) {
  Spawns jobs = Spawns(meta.spawn.xy);
  uint low = 0u, high = meta.spawn.z;
  while (low + 1u < high) {
    const uint middle = (low + high) / 2u;
    if (jobs.items[middle].numbers.x <= place) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

void main() {
  if (gl_GlobalInvocationID.x >= meta.spawn.w) return;
  const uint place = meta.limits.x - meta.spawn.w + gl_GlobalInvocationID.x;
  const SpawnJob job = Spawns(meta.spawn.xy).items[jobOf(place)];
  Particle particle = particleOf(job, place - job.numbers.x);
  // Far beyond any space: not a number that those who bin could take for a place within.
  const bool near = all(lessThan(abs(particle.center), vec3(1e18))) && particle.radius < 1e18;
  if (!near) particle.radius = 0.0;
  NewParticles(meta.entries.zw).items[place] = particle;
}
