// Writes the filtered value of one grid at each of a list of positions: what the march reads, for tests and tools.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "lookup.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer FloatArray { float items[]; };

layout(push_constant) uniform Lookup {
  uvec2 positions;  // vec3 pack index positions, tightly packed floats
  uvec2 values;
  uint count;
  uint grid;  // slot
}
lookup;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= lookup.count) return;
  WordArray at = WordArray(lookup.positions);
  const vec3 p = uintBitsToFloat(uvec3(at.items[i * 3u], at.items[i * 3u + 1u], at.items[i * 3u + 2u]));
  FloatArray(lookup.values).items[i] = sampleGrid(lookup.grid, p, kFilter);
}
