// One volume into the metavoxels of a round.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "medium.glsl"
#include "metavoxel_block.glsl"
#include "metavoxel_volume.glsl"

const int kMostSamples = 4;  // an axis

vec3 indexAlong(uint g, vec3 way) {
  return vec3(dot(params.grids[g].toIndex[0].xyz, way), dot(params.grids[g].toIndex[1].xyz, way),
              dot(params.grids[g].toIndex[2].xyz, way));
}

// Samples along an axis: a voxel of the space that spans several of the grid's takes their mean.
int samplesAlong(vec3 step) { return clamp(int(ceil(length(step) - 0.25)), 1, kMostSamples); }

float readGrid(uint g, vec3 world) {
  const vec3 offset = vec3(params.grids[g].toIndex[0].w, params.grids[g].toIndex[1].w, params.grids[g].toIndex[2].w);
  return sampleGrid(g, indexAlong(g, world) + offset, kFilterTrilinear);
}

Texel sampleVolume(vec3 voxel) {
  const vec3 world = worldOf(voxel);
  ivec3 count = ivec3(1);
  for (uint g = 0u; g < kGridSlots; ++g) {
    if (!hasGrid(g)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      count[axis] = max(count[axis], samplesAlong(indexAlong(g, meta.toWorld[axis].xyz)));
    }
  }
  // What fire gives off is no linear function of its grids: the mean over a voxel is not what its middle gives. Smoke's
  // extinction is linear, and one sample is sharper.
  const bool burning = hasGrid(kTemperatureSlot) || hasGrid(kFlamesSlot);
  const bool sharp = hasGrid(kExtinctionSlot) && count == ivec3(1);
  if (burning) count = max(count, 2);
  const int samples = count.x * count.y * count.z;
  float extinction = sharp ? extinctionOf(readGrid(kExtinctionSlot, world)) * float(samples) : 0.0;
  vec3 emission = vec3(0.0);
  for (int i = 0; i < samples && (burning || !sharp); ++i) {
    const ivec3 at = ivec3(i % count.x, i / count.x % count.y, i / (count.x * count.y));
    const vec3 shift = (vec3(at) + 0.5) / vec3(count) - 0.5;
    const vec3 place =
        world + meta.toWorld[0].xyz * shift.x + meta.toWorld[1].xyz * shift.y + meta.toWorld[2].xyz * shift.z;
    float value[3];
    for (uint g = 0u; g < kGridSlots; ++g) {
      const bool read = hasGrid(g) && !(sharp && g == kExtinctionSlot);
      value[g] = read ? readGrid(g, place) : 0.0;
    }
    if (!sharp) extinction += extinctionOf(value[extinctionSlot()]);
    if (burning) emission += emissionOf(value[kTemperatureSlot], value[kFlamesSlot]);
  }
  const float share = meta.eye.w / float(samples);
  return Texel(extinction > 0.0 ? params.albedo.rgb : vec3(0.0), extinction * share, emission * share);
}

void main() {
  const Block block = blockOf();
  const uint volumes = wordOf(block.number) >> kVolumeBit;
  if ((volumes >> pass.volume & 1u) == 0u) return;
  const bool first = (volumes & ((1u << pass.volume) - 1u)) == 0u;
  const vec3 middle = texelVoxel(block.cell, block.texel);
  const bool some = volumeHas(middle - 0.5, middle + float(kSubBlock) - 0.5);
  if (!some && !first) return;
  Texel values[2];
  for (uint i = 0u; i < 2u; ++i) {
    values[i] = Texel(vec3(0.0), 0.0, vec3(0.0));
    if (some) values[i] = sampleVolume(texelVoxel(block.cell, texelOf(block, i)));
  }
  storeBlock(block, values, first);
}
