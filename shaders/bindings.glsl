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

layout(set = 0, binding = 0, std140) uniform ParamsBlock { MarchParams params; };
layout(set = 0, binding = 1) uniform texture3D atlasBc7;

bool hasGrid(uint slot) { return (kGrids >> slot & 1u) != 0u; }

#endif
