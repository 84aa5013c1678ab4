// Work items: what a workgroup of the fill passes writes, a block of texels of one metavoxel. The first word is the slot
// above the block's place in it, three bits an axis, and kAfterVolumes at the top; the second the cell's number; for particles follow the first and
// the count of the metavoxel's list.
#ifndef BILLOW_METAVOXEL_WORK
#define BILLOW_METAVOXEL_WORK

#include "metavoxel.glsl"

uint workWord(uint slot, uvec3 block) { return slot << 9 | block.z << 6 | block.y << 3 | block.x; }

// Rows of kWorkGroups workgroups in which so many items fit.
uint workRows(uint items) { return (items + kWorkGroups - 1u) / kWorkGroups; }

// The item of this workgroup; there may be none.
uint workItem() { return gl_WorkGroupID.y * kWorkGroups + gl_WorkGroupID.x; }

#endif
