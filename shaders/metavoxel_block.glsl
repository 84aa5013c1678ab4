// What a workgroup of the fill passes writes: a block of kSubBlock^3 texels of one metavoxel of the round.
#ifndef BILLOW_METAVOXEL_BLOCK
#define BILLOW_METAVOXEL_BLOCK

#include "metavoxel_pool.glsl"

struct Block {
  uint slot;
  uint position;
  uint number;  // of the cell
  uvec3 cell;
  uvec3 texel;  // the block's first
};

Block blockOf() {
  const uint blocks = (edgeTexels() + kSubBlock - 1u) / kSubBlock;
  const uint i = gl_WorkGroupID.x;
  Block block;
  block.slot = gl_WorkGroupID.y;
  block.position = Rounds(meta.rounds.xy).items[pass.round].range.x + block.slot;
  block.number = cellAt(block.position);
  block.cell = cellOf(block.number);
  block.texel = uvec3(i % blocks, i / blocks % blocks, i / (blocks * blocks)) * kSubBlock;
  return block;
}

#endif
