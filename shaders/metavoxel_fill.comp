// Particles into the metavoxels of a round: a workgroup a block of 8^3 texels, two texels a thread. Extinction and
// emission add, diffuse colour takes the maximum. Sums are of integers, so that the order of a list, which nobody
// chooses, changes nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_block.glsl"
#include "particle.glsl"

layout(local_size_x = 8, local_size_y = 8, local_size_z = 4) in;

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

void add(Particle particle, vec3 place, inout Sums sums) {
  Matter matter;
  if (!matterAt(particle, place, matter)) return;
  const float edge = meta.eye.w;
  sums.extinction = added(sums.extinction, units(matter.extinction * edge, kExtinctionUnits));
  for (int i = 0; i < 3; ++i) {
    sums.emission[i] = added(sums.emission[i], units(matter.emission[i] * edge, kEmissionUnits));
  }
  sums.albedo = max(sums.albedo, matter.diffuse);
}

void collect(Block block, uvec2 list, uint first) {
  barrier();
  if (gl_LocalInvocationIndex == 0u) nearCount = 0u;
  barrier();
  const uint i = first + gl_LocalInvocationIndex;
  if (i < list.y) {
    const uint number = Words(meta.entries.xy).items[list.x + i];
    const Particle particle = Particles(meta.entries.zw).items[number];
    const vec3 low = texelVoxel(block.cell, block.texel);
    const vec3 center = voxelOf(vectorOf(particle.center));
    if (meets(center, particle.radius / meta.eye.w, low, low + float(kSubBlock - 1u))) {
      near[atomicAdd(nearCount, 1u)] = number;
    }
  }
  barrier();
}

void store(Block block, uvec3 texel, Sums sums, bool first) {
  Texel value = Texel(sums.albedo, float(sums.extinction) / kExtinctionUnits, vec3(sums.emission) / kEmissionUnits);
  if (!first) {
    const Texel old = loadTexel(block.slot, texel);
    value = Texel(max(old.albedo, value.albedo), old.extinction + value.extinction, old.emission + value.emission);
  }
  storeTexel(block.slot, texel, value);
}

void main() {
  const Block block = blockOf();
  const uint word = wordOf(block.number);
  const bool first = word >> kVolumeBit == 0u;
  const uvec2 list = Pairs(meta.lists.xy).items[block.position];
  if (list.y == 0u && !first) return;
  uvec3 texels[2];
  vec3 places[2];
  Sums sums[2];
  for (uint i = 0u; i < 2u; ++i) {
    texels[i] = block.texel + uvec3(gl_LocalInvocationID.xy, gl_LocalInvocationID.z + 4u * i);
    places[i] = worldOf(texelVoxel(block.cell, texels[i]));
    sums[i] = Sums(0u, uvec3(0u), vec3(0.0));
  }
  for (uint at = 0u; at < list.y; at += kBatch) {
    collect(block, list, at);
    for (uint j = 0u; j < nearCount; ++j) {
      const Particle particle = Particles(meta.entries.zw).items[near[j]];
      add(particle, places[0], sums[0]);
      add(particle, places[1], sums[1]);
    }
  }
  for (uint i = 0u; i < 2u; ++i) {
    if (all(lessThan(texels[i], uvec3(edgeTexels())))) store(block, texels[i], sums[i], first);
  }
}
