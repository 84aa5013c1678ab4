// What the voxels of the light field hold: means over the round's metavoxels, once their columns are summed. A workgroup
// a column of the field's voxels; where a voxel lies in two of the field's, each takes its part.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "metavoxel_caster.glsl"
#include "metavoxel_column.glsl"
#include "metavoxel_field.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float kSphere = 12.5663706;  // 4 pi
const uint kThreads = 64u;

shared vec4 lightAndExtinction[kThreads];
shared vec3 scattering[kThreads];
shared FieldMatter totals[kFieldVoxel];  // a cell is at most 62 voxels wide

void addTo(inout FieldMatter sum, FieldMatter matter, float share) {
  sum.light += matter.light * share;
  sum.extinction += matter.extinction * share;
  sum.scattering += matter.scattering * share;
}

// Adds all threads' sums to a total, always in the same order.
void addToTotal(uint number, FieldMatter sum) {
  const uint thread = gl_LocalInvocationIndex;
  lightAndExtinction[thread] = vec4(sum.light, sum.extinction);
  scattering[thread] = sum.scattering;
  barrier();
  for (uint count = kThreads / 2u; count > 0u; count /= 2u) {
    if (thread < count) {
      lightAndExtinction[thread] += lightAndExtinction[thread + count];
      scattering[thread] += scattering[thread + count];
    }
    barrier();
  }
  if (thread != 0u) return;
  addTo(totals[number], FieldMatter(lightAndExtinction[0].rgb, lightAndExtinction[0].a, scattering[0]), 1.0);
}

// Of one voxel; `depth` is that of the sunlight that reaches it, and then that of what leaves it.
FieldMatter matterOf(Column column, uint z, inout float depth) {
  const uvec3 texel = uvec3(column.texel, z + 1u);
  const Texel found = loadTexel(column.slot, texel, blockHolds(column.slot, texel / kSubBlock));
  const float through = lightDepth(found.extinction);
  const float share = sunnyShare(texelVoxel(column.cell, texel).z) / kSphere;
  const vec3 sun = params.sunLight.rgb * share * exp(-(depth + 0.5 * through) * meta.tint.rgb);
  depth += through;
  const vec3 scattered = found.albedo * found.extinction;
  return FieldMatter(found.emission + scattered * sun, found.extinction, scattered);
}

// How much of voxel v lies in the field's voxel from `low` to `high`.
float shareIn(float v, float low, float high) { return max(min(v + 1.0, high) - max(v, low), 0.0); }

// The column of voxels of one thread, all along the light; `area` is the share of it in the field's voxels.
void addColumn(Column column, float area, float edge) {
  float depth = 0.0;
  if (area > 0.0) {
    depth = depthAbove(column.cell, column.texel);
    findCasters(texelVoxel(column.cell, uvec3(column.texel, 0u)).xy);
  }
  FieldMatter sum = FieldMatter(vec3(0.0), 0.0, vec3(0.0));
  uint number = 0u;
  for (uint z = 0u; z < innerVoxels(); ++z) {
    FieldMatter matter = FieldMatter(vec3(0.0), 0.0, vec3(0.0));
    if (area > 0.0) matter = matterOf(column, z, depth);
    const float end = float(number + 1u) * edge;
    addTo(sum, matter, area * shareIn(float(z), end - edge, end));
    if (float(z + 1u) < end - 1e-3) continue;
    addToTotal(number++, sum);
    sum = FieldMatter(vec3(0.0), 0.0, vec3(0.0));
    addTo(sum, matter, area * shareIn(float(z), end, end + edge));
  }
}

void main() {
  const uint perCell = fieldPerCell();
  const uvec2 at = gl_WorkGroupID.xy;
  if (any(greaterThanEqual(at, uvec2(perCell)))) return;
  const float edge = meta.fieldScale.x;
  const vec2 low = vec2(at) * edge;
  const uvec2 first = uvec2(low + 1e-3);
  const uvec2 end = min(uvec2(ceil(low + edge - 1e-3)), uvec2(innerVoxels()));
  Column column = columnOf();
  const uint thread = gl_LocalInvocationIndex;
  if (thread < perCell) totals[thread] = FieldMatter(vec3(0.0), 0.0, vec3(0.0));
  for (uint y = first.y; y < end.y; y += 8u) {
    for (uint x = first.x; x < end.x; x += 8u) {
      const uvec2 voxel = uvec2(x, y) + gl_LocalInvocationID.xy;
      column.texel = voxel + 1u;
      const bool inside = all(lessThan(voxel, end));
      const float area = shareIn(float(voxel.x), low.x, low.x + edge) * shareIn(float(voxel.y), low.y, low.y + edge);
      addColumn(column, inside ? area : 0.0, edge);
    }
  }
  barrier();
  if (thread >= perCell) return;
  FieldMatter mean = FieldMatter(vec3(0.0), 0.0, vec3(0.0));
  addTo(mean, totals[thread], 1.0 / (edge * edge * edge));
  mean.light = min(mean.light, vec3(kLargestHalf));
  mean.extinction = min(mean.extinction, kLargestHalf);
  mean.scattering = min(mean.scattering, vec3(kLargestHalf));
  storeMatter(matterNumber(column.position, uvec3(at, thread)), mean);
}
