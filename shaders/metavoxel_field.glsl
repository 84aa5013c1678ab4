// The light field: how matter lights matter. Its voxels are coarse, a whole number of them an axis of a cell, and cover
// the whole space, so that it knows no metavoxel and no pool.
//
// What shines into it (light given off per voxel edge, and extinction) is a pyramid of ever coarser levels, all in one
// image. Each level's texel takes 1, 3, 3, 1 of those below it along each axis, which keeps where the light comes from.
#ifndef BILLOW_METAVOXEL_FIELD
#define BILLOW_METAVOXEL_FIELD

#include "metavoxel.glsl"

layout(set = 1, binding = 10) uniform sampler3D pyramid;
layout(set = 1, binding = 12) uniform sampler3D fieldLight;
layout(constant_id = 8) const bool kField = true;  // there is one

// What a voxel of the field holds on average, per voxel edge of the space.
struct FieldMatter {
  vec3 light;  // radiance that is emitted, and scattered once from the sun, the same in all directions
  float extinction;
  vec3 scattering;
};

uint fieldEdge() { return meta.field.x; }
uint fieldPerCell() { return meta.field.y; }
uint matterNumber(uint position, uvec3 at) {
  return ((position * fieldPerCell() + at.z) * fieldPerCell() + at.y) * fieldPerCell() + at.x;
}

FieldMatter loadMatter(uint number) {
  const uvec4 words = Quads(meta.fieldMatter.xy).items[number];
  const vec2 blueAndExtinction = unpackHalf2x16(words.y);
  return FieldMatter(vec3(unpackHalf2x16(words.x), blueAndExtinction.x), blueAndExtinction.y,
                     vec3(unpackHalf2x16(words.z), unpackHalf2x16(words.w).x));
}
void storeMatter(uint number, FieldMatter matter) {
  Quads(meta.fieldMatter.xy).items[number] =
      uvec4(packHalf2x16(matter.light.rg), packHalf2x16(vec2(matter.light.b, matter.extinction)),
            packHalf2x16(matter.scattering.rg), packHalf2x16(vec2(matter.scattering.b, 0.0)));
}

// A level of the pyramid between its texels; `at` counts them, and outside of the space nothing is.
vec4 readLevel(uint level, vec3 at) {
  const ivec4 place = meta.levels[level];
  const vec3 texel = vec3(place.xyz) + clamp(at, vec3(-0.5), vec3(float(place.w) + 0.5));
  return textureLod(pyramid, texel / vec3(textureSize(pyramid, 0)), 0.0);
}

// Radiance that arrives at a voxel from the matter around it, the mean over all directions.
vec3 surroundingsAt(vec3 voxel) {
  if (!kField || !hasFlag(kFlagField)) return vec3(0.0);
  const float scale = 1.0 / float(cellsAxis() * innerVoxels());
  return textureLod(fieldLight, voxel * scale, 0.0).rgb * meta.fieldScale.y;
}

#endif
