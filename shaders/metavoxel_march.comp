// Marches the round's metavoxels, a thread a pixel. Samples lie at whole steps of depth along `forward`, whichever
// metavoxel they fall into, so that a picture of many is that of one.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_picture.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 1, binding = 2) uniform sampler3D lit;
layout(set = 1, binding = 7, r32f) readonly uniform image2D sceneDepth;  // along `forward`

struct Ray {  // in voxels of the space; t is the distance in world units
  vec3 origin;
  vec3 direction;
  vec3 inverse;
  float perDepth;  // t a unit of depth
};

struct Box {  // cells
  uvec3 low;
  uvec3 high;  // past the end
};

const float kFar = 3.0e38;

Ray makeRay(vec2 unit) {
  const vec3 along =
      params.forward.xyz + (2.0 * unit.x - 1.0) * params.right.xyz + (1.0 - 2.0 * unit.y) * params.up.xyz;
  const vec3 direction = voxelsAlong(normalize(along));
  const vec3 safe = mix(direction, vec3(1e-12), lessThan(abs(direction), vec3(1e-12)));
  return Ray(voxelOf(meta.eye.xyz), direction, 1.0 / safe, length(along));
}

vec2 crossBox(Ray ray, vec3 low, vec3 high) {
  const vec3 a = (low - ray.origin) * ray.inverse;
  const vec3 b = (high - ray.origin) * ray.inverse;
  const vec3 near = min(a, b);
  const vec3 far = max(a, b);
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// A fixed pattern in [0, 1) that hides banding (Jimenez 2014, "Next generation post processing in Call of Duty").
float interleavedNoise(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }

// One step of `edges` voxel edges, as the direct march has it; both values are per voxel edge.
void shade(vec4 value, float t, float edges, inout Sum sum) {
  const float opticalDepth = value.a * edges;
  const float after = exp(-opticalDepth);
  const float span = opticalDepth < 1e-3 ? edges * (1.0 - 0.5 * opticalDepth) : (1.0 - after) / value.a;
  sum.radiance += sum.transmittance * value.rgb * span;
  sum.depth += sum.transmittance * (1.0 - after) * t;
  sum.transmittance *= after;
}

// Samples lie at distances (k + shift) * dt.
struct Steps {
  float dt;
  float shift;
  float edges;  // of a whole step
  float end;    // of the scene, in voxel edges, and half a step
};

// From sample k on through a box of texels of one metavoxel, to sample `next`.
void marchBox(Ray ray, Steps steps, uint slot, vec3 corner, float next, float seen, inout float k, inout Sum sum) {
  const vec3 origin = ray.origin - corner;
  const vec3 first = (vec3(slotCorner(slot)) + 1.0) * meta.texel.xyz;
  for (; k < next && sum.transmittance * seen > kOpaque; k += 1.0) {
    const float t = (k + steps.shift) * steps.dt;
    const vec3 inCell = clamp(origin + ray.direction * t, 0.0, float(innerVoxels()));
    const vec4 value = textureLod(lit, first + inCell * meta.texel.xyz, 0.0);
    // A step that crosses the scene counts for what lies before it.
    const float edges = min(steps.edges, max(steps.end - (k + steps.shift) * steps.edges, 0.0));
    shade(value, t, edges, sum);
  }
}

Sum march(Ray ray, float end, float shift, float seen) {
  Sum sum = Sum(vec3(0.0), 1.0, 0.0);
  const MetavoxelCounters counters = Counters(meta.ramps.zw).value;
  const uvec4 range = Rounds(meta.rounds.xy).items[pass.round].range;
  const Box box = Box(~counters.boxMin.xyz, counters.boxMax.xyz);
  const float inner = float(innerVoxels());
  const vec2 span = crossBox(ray, vec3(box.low) * inner, vec3(box.high) * inner);
  const float dt = params.forward.w * meta.eye.w * ray.perDepth;
  const float edges = dt / meta.eye.w;
  const Steps steps = Steps(dt, shift, edges, end / meta.eye.w + 0.5 * edges);
  if (range.y == 0u) return sum;
  float k = max(ceil(span.x / dt - shift), 0.0);
  const float last = ceil(min(span.y, end + 0.5 * dt) / dt - shift);
  while (k < last && sum.transmittance * seen > kOpaque) {
    const float t = (k + shift) * dt;
    const vec3 voxel = ray.origin + ray.direction * t;
    const vec3 cell = clamp(floor(voxel / inner), vec3(0.0), vec3(cellsAxis() - 1u));
    const vec3 corner = cell * inner;
    const uint slot = positionOf(uvec3(cell)) - range.x;
    vec3 low = corner;
    vec3 high = corner + inner;
    bool near = false;
    if (slot < range.y) {
      // The box is the part of the cell in one block of texels.
      const vec3 block = floor((clamp(voxel - corner, 0.0, inner) + 1.0) / float(kSubBlock));
      near = (blockHolds(slot, uvec3(block)) & kBlockNear) != 0u;
      low = max(low, corner - 1.0 + block * float(kSubBlock));
      high = min(high, corner - 1.0 + (block + 1.0) * float(kSubBlock));
    }
    const float next = min(max(k + 1.0, ceil(crossBox(ray, low, high).y / dt - shift)), last);
    if (near) marchBox(ray, steps, slot, corner, next, seen, k, sum);
    if (near && k < next) break;  // opaque
    k = next;
  }
  sum.depth /= ray.perDepth;
  return sum;
}

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  const ivec2 size = ivec2(params.size.xy);
  if (any(greaterThanEqual(pixel, size))) return;
  const Ray ray = makeRay((vec2(pixel) + 0.5) / vec2(size));
  const float end = hasFlag(kFlagSceneDepth) ? imageLoad(sceneDepth, pixel).r * ray.perDepth : kFar;
  const float shift = params.size.w != 0u ? interleavedNoise(vec2(pixel)) : 0.5;
  Sum sum;
  if (pass.round == 0u) {
    sum = march(ray, end, shift, 1.0);
  } else {
    const Sum old = loadSum(pixel);
    const bool front = Rounds(meta.rounds.xy).items[pass.round].range.z != 0u;
    // Behind what is opaque nothing is seen.
    const Sum mine = march(ray, end, shift, front ? 1.0 : old.transmittance);
    sum = front ? inFront(mine, old) : inFront(old, mine);
  }
  if (pass.finish != 0u) {
    storePicture(pixel, sum);
  } else {
    storeSum(pixel, sum);
  }
}
