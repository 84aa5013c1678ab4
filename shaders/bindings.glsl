// Bindings and specialization constants that every pass has.
#ifndef BILLOW_BINDINGS
#define BILLOW_BINDINGS

#include "billow/format/layout.h"
#include "interface.h"

layout(constant_id = 0) const uint kIndexKind = 3;  // kIndexMixed
layout(constant_id = 1) const uint kFilter = 1;     // kFilterTrilinear
layout(constant_id = 2) const uint kShadow = 1;     // kFilterTrilinear, kFilterNearest or kFilterNone
layout(constant_id = 3) const uint kGrids = 1;      // bit of each slot in use

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer QuadArray { uvec4 items[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer PairArray { uvec2 items[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer WordArray { uint items[]; };

// Where several layers are drawn at once, `layerNow` is the one whose grids and bricks are read.
layout(set = 0, binding = 1) uniform texture3D atlasBc7;
#ifdef BILLOW_LAYERS
layout(constant_id = 4) const uint kLayers = 2;
layout(set = 0, binding = 0, std140) uniform ParamsBlock {
  MarchParams params;
  LayerParams layers[kLayerCount];
};
layout(set = 0, binding = 4) uniform texture3D atlasOfSecond;
layout(set = 0, binding = 5) uniform texture3D atlasOfThird;
layout(set = 0, binding = 6) uniform texture3D atlasOfFourth;
uint layerNow = 0u;
#define BILLOW_GRID(g) layers[layerNow].grids[g]
#define BILLOW_BRICKS layers[layerNow].bricks
#else
layout(set = 0, binding = 0, std140) uniform ParamsBlock { MarchParams params; };
#define BILLOW_GRID(g) params.grids[g]
#define BILLOW_BRICKS params.bricks
#endif

bool hasGrid(uint slot) { return (kGrids >> slot & 1u) != 0u; }

#endif
