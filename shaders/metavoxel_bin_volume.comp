// A layer of a volume into cells, a workgroup a cell of the layer's box: whether any brick or tile lies in it, or so
// near that it may be carried into it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "metavoxel_touch.glsl"
#include "metavoxel_volume.glsl"

layout(local_size_x = 64) in;

void main() {
  const uvec3 cell = gl_WorkGroupID + pass.box.xyz;
  if (!cellWanted(cell)) return;
  vec3 low, high;
  grownCell(cell, low, high);
  if (!volumeHas(low - farthest(), high + farthest()) || gl_LocalInvocationIndex != 0u) return;
  const uint number = cellNumber(cell);
  noteCell(number, atomicOr(Words(meta.cells.xy).items[number], 1u << (kVolumeBit + pass.volume)));
}
