// One layer of a volume into the metavoxels of a round.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "medium.glsl"
#include "metavoxel_block.glsl"
#include "metavoxel_carry.glsl"
#include "metavoxel_stage.glsl"

const int kMostSamples = 4;  // an axis

// Samples along an axis: a voxel of the space that spans several of the grid's takes their mean.
int samplesAlong(vec3 step) { return clamp(int(ceil(length(step) - 0.25)), 1, kMostSamples); }

bool burning() { return hasGrid(kTemperatureSlot) || hasGrid(kFlamesSlot); }

// Samples of a texel along each axis, for what is linear in its grid.
ivec3 samplesOf() {
  ivec3 count = ivec3(1);
  for (uint g = 0u; g < kMatterSlots; ++g) {
    if (!hasGrid(g)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      count[axis] = max(count[axis], samplesAlong(indexAlong(g, meta.toWorld[axis].xyz)));
    }
  }
  return count;
}

vec3 sampleShift(int i, ivec3 count) {
  const ivec3 at = ivec3(i % count.x, i / count.x % count.y, i / (count.x * count.y));
  const vec3 shift = (vec3(at) + 0.5) / vec3(count) - 0.5;
  return meta.toWorld[0].xyz * shift.x + meta.toWorld[1].xyz * shift.y + meta.toWorld[2].xyz * shift.z;
}

Texel texelOf(float extinction, vec3 emission) {
  return Texel(extinction > 0.0 ? params.albedo.rgb : vec3(0.0), extinction * meta.eye.w, emission * meta.eye.w);
}

// What fire gives off is no linear function of its grids: the mean over a voxel is not what its middle gives. Smoke's
// extinction is linear, and one sample is sharper.
Texel sampleVolume(vec3 voxel, ivec3 count) {
  const vec3 world = worldOf(voxel);
  const bool sharp = hasGrid(kExtinctionSlot) && count == ivec3(1);
  if (burning()) count = max(count, 2);
  const int samples = count.x * count.y * count.z;
  float extinction = sharp ? extinctionOf(readGrid(kExtinctionSlot, world)) * float(samples) : 0.0;
  vec3 emission = vec3(0.0);
  for (int i = 0; i < samples && (burning() || !sharp); ++i) {
    const vec3 place = world + sampleShift(i, count);
    float value[kMatterSlots];
    for (uint g = 0u; g < kMatterSlots; ++g) {
      const bool read = hasGrid(g) && !(sharp && g == kExtinctionSlot);
      value[g] = read ? readGrid(g, place) : 0.0;
    }
    if (!sharp) extinction += extinctionOf(value[extinctionSlot()]);
    if (burning()) emission += emissionOf(value[kTemperatureSlot], value[kFlamesSlot]);
  }
  return texelOf(extinction / float(samples), emission / float(samples));
}

// The same for both texels of each thread, 2^3 samples each, from staged values. One grid is staged at a time.
const int kStagedSamples = 8;

void sampleStaged(vec3 voxels[2], Stage temperature, Stage flames, out Texel values[2]) {
  float heat[2 * kStagedSamples];
  float extinction[2] = float[2](0.0, 0.0);
  vec3 emission[2] = vec3[2](vec3(0.0), vec3(0.0));
  const uint source = extinctionSlot();
  vec3 middle[2];
  for (uint i = 0u; i < 2u; ++i) {
    middle[i] = worldOf(voxels[i]);
    if (source == kExtinctionSlot) {
      extinction[i] = extinctionOf(readGrid(source, middle[i])) * float(kStagedSamples);
    }
  }
  if (hasGrid(kTemperatureSlot)) loadStage(kTemperatureSlot, temperature);
  for (int s = 0; s < 2 * kStagedSamples; ++s) {
    const vec3 place = middle[s / kStagedSamples] + sampleShift(s % kStagedSamples, ivec3(2));
    heat[s] = hasGrid(kTemperatureSlot) ? readStage(temperature, indexOf(kTemperatureSlot, place)) : 0.0;
    if (source == kTemperatureSlot) extinction[s / kStagedSamples] += extinctionOf(heat[s]);
  }
  if (hasGrid(kFlamesSlot)) loadStage(kFlamesSlot, flames);
  for (int s = 0; s < 2 * kStagedSamples; ++s) {
    const vec3 place = middle[s / kStagedSamples] + sampleShift(s % kStagedSamples, ivec3(2));
    const float flame = hasGrid(kFlamesSlot) ? readStage(flames, indexOf(kFlamesSlot, place)) : 0.0;
    emission[s / kStagedSamples] += emissionOf(heat[s], flame);
    if (source == kFlamesSlot) extinction[s / kStagedSamples] += extinctionOf(flame);
  }
  for (uint i = 0u; i < 2u; ++i) {
    values[i] = texelOf(extinction[i] / float(kStagedSamples), emission[i] / float(kStagedSamples));
  }
}

// `voxels` are where the thread's texels read, all of the group's between `from` and `to`.
void sampleBlock(vec3 voxels[2], vec3 from, vec3 to, out Texel values[2]) {
  const ivec3 count = samplesOf();
  if (burning() && count == ivec3(1)) {
    const Stage temperature = stageOf(kTemperatureSlot, from, to);
    const Stage flames = stageOf(kFlamesSlot, from, to);
    const bool fit = (!hasGrid(kTemperatureSlot) || fits(temperature)) && (!hasGrid(kFlamesSlot) || fits(flames));
    if (fit) {
      sampleStaged(voxels, temperature, flames, values);
      return;
    }
  }
  for (uint i = 0u; i < 2u; ++i) values[i] = sampleVolume(voxels[i], count);
}

void main() {
  if (workItem() >= Rounds(meta.rounds.xy).items[pass.round].volumes.w) return;
  const uvec2 item = Pairs(meta.work.xy).items[workItem()];
  const Block block = blockOf(item);
  const uint volumes = wordOf(item.y) >> kVolumeBit;
  if ((volumes >> pass.volume & 1u) == 0u) return;
  const bool first = (volumes & ((1u << pass.volume) - 1u)) == 0u && pass.level == 0u;
  const bool stale = (blockHolds(block.slot, block.at) & kBlockStale) != 0u;
  const vec3 middle = texelVoxel(block.cell, block.texel);
  vec3 from = middle - 0.5;
  vec3 to = middle + float(kSubBlock) - 0.5;
  bool some = volumeHas(from - farthest(), to + farthest());
  vec3 voxels[2];
  for (uint i = 0u; i < 2u; ++i) voxels[i] = texelVoxel(block.cell, texelOf(block, i));
  if (carries() && some) {
    carryBack(voxels, from, to);
    some = volumeHas(from, to);
  }
  if (!some && !(first && stale)) return;
  Texel values[2] = Texel[2](Texel(vec3(0.0), 0.0, vec3(0.0)), Texel(vec3(0.0), 0.0, vec3(0.0)));
  if (some) sampleBlock(voxels, from, to, values);
  storeBlock(block, values, first);
}
