// A grid's values around a block of texels, read once by the whole workgroup: where a texel takes the mean of several
// samples, they share most of the voxels that they are interpolated between.
#ifndef BILLOW_METAVOXEL_STAGE
#define BILLOW_METAVOXEL_STAGE

#include "metavoxel_volume.glsl"

const uint kStagedVoxels = 3584u;  // 14 KiB, of the 16 that every device has

shared float staged[kStagedVoxels];

struct Stage {
  ivec3 first;  // pack index
  uvec3 count;
};

// What filtered reads between two places of the space touch; rounding may move them by a little.
Stage stageOf(uint g, vec3 from, vec3 to) {
  vec3 low, high;
  indexBox(g, from, to, low, high);
  Stage stage;
  stage.first = ivec3(floor(low - 1e-3));
  stage.count = uvec3(ivec3(floor(high + 1e-3)) - stage.first + 2);
  return stage;
}

bool fits(Stage stage) {
  return all(lessThan(stage.count, uvec3(256u))) && stage.count.x * stage.count.y * stage.count.z <= kStagedVoxels;
}

// Called by all threads of the group; what was staged before is forgotten.
void loadStage(uint g, Stage stage) {
  const uint threads = gl_WorkGroupSize.x * gl_WorkGroupSize.y * gl_WorkGroupSize.z;
  const uvec3 n = stage.count;
  barrier();
  for (uint i = gl_LocalInvocationIndex; i < n.x * n.y * n.z; i += threads) {
    staged[i] = getVoxel(g, stage.first + ivec3(i % n.x, i / n.x % n.y, i / (n.x * n.y)));
  }
  barrier();
}

// Trilinear, at a pack index.
float readStage(Stage stage, vec3 p) {
  const vec3 base = clamp(floor(p), vec3(stage.first), vec3(stage.first + ivec3(stage.count) - 2));
  const vec3 f = p - base;
  const uvec3 at = uvec3(ivec3(base) - stage.first);
  const uvec3 step = uvec3(1u, stage.count.x, stage.count.x * stage.count.y);
  const uint i = at.x * step.x + at.y * step.y + at.z * step.z;
  const vec4 low = vec4(staged[i], staged[i + step.y], staged[i + step.z], staged[i + step.y + step.z]);
  const vec4 high = vec4(staged[i + 1u], staged[i + step.y + 1u], staged[i + step.z + 1u],
                         staged[i + step.y + step.z + 1u]);
  const vec4 alongX = mix(low, high, f.x);
  const vec2 alongY = mix(alongX.xz, alongX.yw, f.y);
  return mix(alongY.x, alongY.y, f.z);
}

#endif
