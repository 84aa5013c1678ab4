// Particles into the metavoxels of a round. Extinction and
// emission add, diffuse colour takes the maximum. Sums are of integers, so that the order of a list, which nobody
// chooses, changes nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_block.glsl"
#include "particle.glsl"

const uint kBatch = 256u;
const float kExtinctionUnits = 67108864.0;  // 2^26: optical depth of a voxel up to 32 in steps of 1.5e-8
const float kEmissionUnits = 1048576.0;     // 2^20: up to 2048 in steps of 1e-6
const uint kMostUnits = 0x7fffffffu;

shared uint near[kBatch];  // the batch's particles that reach the block
shared uint nearCount;

struct Sums {
  uint extinction;
  uvec3 emission;
  vec3 albedo;
};

// Both are at most kMostUnits, and so is the result: the order of additions makes no difference.
uint added(uint a, uint b) { return min(a + b, kMostUnits); }
uint units(float amount, float scale) { return uint(min(amount * scale, 2147483520.0) + 0.5); }

void add(Particle particle, ParticleMaterial material, vec3 apart, inout Sums sums) {
  Matter matter;
  if (!matterAt(particle, material, apart, matter)) return;
  const float edge = meta.eye.w;
  sums.extinction = added(sums.extinction, units(matter.extinction * edge, kExtinctionUnits));
  for (int i = 0; i < 3; ++i) {
    sums.emission[i] = added(sums.emission[i], units(matter.emission[i] * edge, kEmissionUnits));
  }
  sums.albedo = max(sums.albedo, matter.diffuse);
}

// A particle into both texels of the thread, `places` relative to the space's centre. Most of it is read only where its
// bounding sphere is.
void addBoth(uint number, vec3 places[2], inout Sums sums[2]) {
  Particles particles = Particles(meta.entries.zw);
  const vec3 center = vectorOf(particles.items[number].center);
  const float radius = particles.items[number].radius;
  const vec3 apart[2] = vec3[2](places[0] - center, places[1] - center);
  const bvec2 inside = lessThan(vec2(dot(apart[0], apart[0]), dot(apart[1], apart[1])), vec2(radius * radius));
  if (!any(inside)) return;
  const Particle particle = particles.items[number];
  const ParticleMaterial material = Materials(meta.tables.xy).items[particle.material];
  if (inside.x) add(particle, material, apart[0], sums[0]);
  if (inside.y) add(particle, material, apart[1], sums[1]);
}

void collect(Block block, uvec2 list, uint first) {
  barrier();
  if (gl_LocalInvocationIndex == 0u) nearCount = 0u;
  barrier();
  const uint i = first + gl_LocalInvocationIndex;
  if (i < list.y) {
    const uint number = Words(meta.entries.xy).items[list.x + i];
    Particles particles = Particles(meta.entries.zw);
    const vec3 low = texelVoxel(block.cell, block.texel);
    const vec3 center = voxelOf(vectorOf(particles.items[number].center));
    if (meets(center, particles.items[number].radius / meta.eye.w, low, low + float(kSubBlock - 1u))) {
      near[atomicAdd(nearCount, 1u)] = number;
    }
  }
  barrier();
}

void main() {
  const Block block = blockOf();
  const bool first = wordOf(block.number) >> kVolumeBit == 0u;
  const uvec2 list = Pairs(meta.lists.xy).items[block.position];
  vec3 places[2];
  Sums sums[2];
  for (uint i = 0u; i < 2u; ++i) {
    places[i] = worldOf(texelVoxel(block.cell, texelOf(block, i)));
    sums[i] = Sums(0u, uvec3(0u), vec3(0.0));
  }
  bool some = false;
  for (uint at = 0u; at < list.y; at += kBatch) {
    collect(block, list, at);
    some = some || nearCount != 0u;
    for (uint j = 0u; j < nearCount; ++j) addBoth(near[j], places, sums);
  }
  if (!some && !first) return;
  Texel values[2];
  for (uint i = 0u; i < 2u; ++i) {
    values[i] =
        Texel(sums[i].albedo, float(sums[i].extinction) / kExtinctionUnits, vec3(sums[i].emission) / kEmissionUnits);
  }
  storeBlock(block, values, first);
}
