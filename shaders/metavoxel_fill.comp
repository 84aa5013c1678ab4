// Particles into the metavoxels of a round. Extinction and emission add, diffuse colour takes the maximum or the mean.
// Sums are of integers, so that the order of a list, which nobody chooses, changes nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_block.glsl"
#include "particle.glsl"

const uint kBatch = 64u;  // particles of a list that are looked at together
const float kExtinctionUnits = 67108864.0;  // 2^26: optical depth of a voxel up to 32 in steps of 1.5e-8
const float kEmissionUnits = 1048576.0;     // 2^20: up to 2048 in steps of 1e-6
const uint kMostUnits = 0x7fffffffu;

// The batch's particles that reach the block, with their materials, in quadruples: shared memory gives four words as fast
// as one.
const uint kParticleQuads = 6u;
const uint kRecordQuads = 8u;
shared uvec4 near[kBatch * kRecordQuads];
shared uint nearCount;

struct Sums {
  uint extinction;
  uvec3 emission;
  vec3 albedo;
  uvec3 weighted;  // albedo times extinction, in units of that
};

// Both are at most kMostUnits, and so is the result: the order of additions makes no difference.
uint added(uint a, uint b) { return min(a + b, kMostUnits); }
uint units(float amount, float scale) { return uint(min(amount * scale, 2147483520.0) + 0.5); }

vec4 nearNumbers(uint quad) { return uintBitsToFloat(near[quad]); }

Particle nearParticle(uint i) {
  const uint at = i * kRecordQuads;
  const vec4 sphere = nearNumbers(at);
  const vec4 shape = nearNumbers(at + 2u);
  const vec4 diffuse = nearNumbers(at + 3u);
  const vec4 emission = nearNumbers(at + 4u);
  const uvec4 last = near[at + 5u];
  return Particle(sphere.xyz, sphere.w, nearNumbers(at + 1u), shape.xyz, shape.w, diffuse.rgb, diffuse.a,
                  emission.rgb, emission.a, last.x, last.y, last.z, last.w);
}

ParticleMaterial nearMaterial(uint i) {
  const uvec4 rows = near[i * kRecordQuads + 6u];
  const vec4 rest = nearNumbers(i * kRecordQuads + 7u);
  return ParticleMaterial(rows.x, rows.y, rows.z, rows.w, rest.x, rest.y, rest.z, rest.w);
}

void add(Particle particle, ParticleMaterial material, vec3 apart, inout Sums sums) {
  Matter matter;
  if (!matterAt(particle, material, apart, matter)) return;
  const float edge = meta.eye.w;
  sums.extinction = added(sums.extinction, units(matter.extinction * edge, kExtinctionUnits));
  if (matter.emission != vec3(0.0)) {
    for (int c = 0; c < 3; ++c) {
      sums.emission[c] = added(sums.emission[c], units(matter.emission[c] * edge, kEmissionUnits));
    }
  }
  if (!kWeighted) sums.albedo = max(sums.albedo, matter.diffuse);
  for (int i = 0; i < 3 && kWeighted; ++i) {
    sums.weighted[i] = added(sums.weighted[i], units(matter.extinction * edge * matter.diffuse[i], kExtinctionUnits));
  }
}

// A particle into both texels of the thread. Most of it is read only where its bounding sphere is.
void addBoth(uint i, vec3 places[2], inout Sums sums[2]) {
  const vec4 sphere = nearNumbers(i * kRecordQuads);
  for (uint t = 0u; t < 2u; ++t) {
    const vec3 apart = places[t] - sphere.xyz;
    if (dot(apart, apart) < sphere.w * sphere.w) add(nearParticle(i), nearMaterial(i), apart, sums[t]);
  }
}

void readNear(uint number, uint at) {
  for (uint q = 0u; q < kParticleQuads; ++q) near[at + q] = Quads(meta.entries.zw).items[number * kParticleQuads + q];
  const uint material = Particles(meta.entries.zw).items[number].material;
  for (uint q = 0u; q < 2u; ++q) near[at + kParticleQuads + q] = Quads(meta.tables.xy).items[material * 2u + q];
}

// Of a batch of the list, from `first` on, what reaches the block.
void collect(Block block, uvec2 list, uint first) {
  barrier();
  if (gl_LocalInvocationIndex == 0u) nearCount = 0u;
  barrier();
  const uint i = first + gl_LocalInvocationIndex;
  if (gl_LocalInvocationIndex < kBatch && i < list.y) {
    const uint number = Words(meta.entries.xy).items[list.x + i];
    Particles particles = Particles(meta.entries.zw);
    const vec3 low = texelVoxel(block.cell, block.texel);
    const vec3 center = voxelOf(particles.items[number].center);
    if (meets(center, particles.items[number].radius / meta.eye.w, low, low + float(kSubBlock - 1u))) {
      readNear(number, atomicAdd(nearCount, 1u) * kRecordQuads);
    }
  }
  barrier();
}

void main() {
  if (workItem() >= Rounds(meta.rounds.xy).items[pass.round].fill.w) return;
  const uvec4 item = Quads(meta.work.zw).items[workItem()];
  const Block block = blockOf(item.xy);
  vec3 places[2];  // relative to the space's centre
  Sums sums[2];
  for (uint i = 0u; i < 2u; ++i) {
    places[i] = worldOf(texelVoxel(block.cell, texelOf(block, i)));
    sums[i] = Sums(0u, uvec3(0u), vec3(0.0), uvec3(0u));
  }
  for (uint at = 0u; at < item.w; at += kBatch) {
    collect(block, item.zw, at);
    for (uint j = 0u; j < nearCount; ++j) addBoth(j, places, sums);
  }
  Texel values[2];
  for (uint i = 0u; i < 2u; ++i) {
    if (kWeighted) sums[i].albedo = vec3(sums[i].weighted) / float(max(sums[i].extinction, 1u));
    values[i] =
        Texel(sums[i].albedo, float(sums[i].extinction) / kExtinctionUnits, vec3(sums[i].emission) / kEmissionUnits);
  }
  storeBlock(block, values, (item.x & kAfterVolumes) == 0u);
}
