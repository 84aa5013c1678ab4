// What the host writes and the metavoxel passes read. Shared by C++ and GLSL, like interface.h.
//
// Space: voxels of one size in a frame whose z axis runs along the light; `voxel` counts them from the space's corner,
// whole numbers plus a half at their centres. A cell is the place of a metavoxel: `inner` voxels an edge. A metavoxel
// holds its cell's voxels and a border of one: `edge` texels an edge. Occupied cells are numbered by position, the
// order in which they are drawn.
#ifndef BILLOW_SHADERS_METAVOXEL_INTERFACE_H
#define BILLOW_SHADERS_METAVOXEL_INTERFACE_H

#include "interface.h"

#ifdef __cplusplus
namespace billow::runtime::gpu {
#endif

BILLOW_GPU_CONST kPlanes = 5u;              // of the frustum: near, left, right, lower, upper
BILLOW_GPU_CONST kSubBlock = 8u;            // texels an edge of what one workgroup of fill writes
BILLOW_GPU_CONST kBlockMatter = 1u;         // of a block of texels: some have extinction or emission
BILLOW_GPU_CONST kBlockEmission = 2u;       // some have emission; else none of the block's is written
BILLOW_GPU_CONST kBlockNear = 4u;           // matter within it or in a texel beside it
BILLOW_GPU_CONST kBlockStale = 8u;          // texels may be other than 0, from what the slot held before
BILLOW_GPU_CONST kAfterVolumes = 1u << 31;  // of a work item: passes of volumes come before
BILLOW_GPU_CONST kWorkGroups = 256u;        // along x of a dispatch with a workgroup a work item
BILLOW_GPU_CONST kVolumeBit = 24u;  // of a cell's word: below it particles are counted, from it on volumes flagged
BILLOW_GPU_CONST kUseErosion = 1u;  // of materials, all together: what none uses is left out of the code that fills
BILLOW_GPU_CONST kUseRamps = 2u;
BILLOW_GPU_CONST kUseCurves = 4u;
BILLOW_GPU_CONST kMaxVolumes = 8u;
BILLOW_GPU_CONST kBinRow = 32768u;       // particles that are binned side by side: devices may not dispatch 65536
BILLOW_GPU_CONST kCubeLayers = 6u;       // of a cube map: faces, each with a border of one texel
BILLOW_GPU_CONST kCubeFaceTexels = 66u;  // an edge, border included
BILLOW_GPU_CONST kFieldVoxel = 8u;       // voxels an edge of the light field's, at most where there is room for them
BILLOW_GPU_CONST kFieldLevels = 8u;      // of its pyramid, at most

BILLOW_GPU_CONST kFlagCull = 1u;        // cells that neither the eye sees nor light passes on its way to what it sees
BILLOW_GPU_CONST kFlagReciprocal = 2u;  // 1 / (1 + d) in place of exp(-d)
BILLOW_GPU_CONST kFlagSceneDepth = 4u;  // rays end at the scene
BILLOW_GPU_CONST kFlagKeep = 16u;       // metavoxels stay filled, and of those only
BILLOW_GPU_CONST kFlagChanged = 32u;    // the changed ones are filled anew
BILLOW_GPU_CONST kFlagNever = 64u;      // none
BILLOW_GPU_CONST kFlagField = 256u;     // matter lights matter
BILLOW_GPU_CONST kParticleWords = 24u;

// One thing to draw: the metavoxels at positions first to first + count - 1.
struct MetavoxelRound {
  uvec4 range;    // first, count, 1: in front of all that were drawn before, 0: behind; 1: slots are kept
  uvec4 blocks;   // indirect dispatch, a workgroup a metavoxel; 0
  uvec4 volumes;  // of passes with a workgroup a block of a metavoxel in which a volume is; number of those blocks
  uvec4 fill;     // the same for blocks that particles reach, or from which they are gone
  uvec4 columns;  // of passes with a thread a column of texels, 0
  uvec4 march;    // of the picture's workgroups, 0
};
BILLOW_GPU_SIZE(MetavoxelRound, 96);

// A place in the pool that keeps what it was filled with.
struct MetavoxelSlot {
  uvec4 owner;    // cell + 1, or 0; the last draw that has drawn it; hash of the space it was filled in, or 0; 0
  uvec4 content;  // hash of what filled it, 0, 0
};
BILLOW_GPU_SIZE(MetavoxelSlot, 32);

struct MetavoxelCounters {
  uvec4 wanted;  // x: occupied cells, y: list entries (more than fit are left out), z: cells drawn, w: and filled
  uvec4 boxMin;  // largest of ~cell over drawn cells
  uvec4 boxMax;  // largest of cell + 1; w: number of the draw
  uvec4 reset;   // indirect dispatch of the next frame's clearing; w: 1 where everything is cleared
  uvec4 rank;    // indirect dispatch, a thread an occupied cell; w: cells in front of which later rounds are drawn
  uvec4 check;   // indirect dispatch, a workgroup an occupied cell, where slots are kept; 0
  uvec4 spare;   // slots that this draw may give away: those without an owner, those with one; given ones; 0
};
BILLOW_GPU_SIZE(MetavoxelCounters, 112);

// Candidates of one span in one run of an effect's emitter, as the effect lies in the world. A candidate's slot is its
// number here plus a random one in [0, 1). Of given particles (GivenParticle), numbers.z is that of the first
// candidate in the run, and times.x its age, to which times.y adds what is lost to rounding.
struct SpawnJob {
  uvec4 numbers;  // of its first particle in the draw; emitter; the first candidate's among all runs; emitter's hash
  vec4 times;     // age of one born at slot 0, seconds a slot; its birth as a share of the duration, the same a slot
  vec4 moments;   // seconds since the track's frame before and until that after; samples of a position row a second; 0
  uvec4 points;   // first point and count of the track's frame before, and of that after
  vec4 turn;      // quaternion, effect to world
  vec4 origin;    // of the emitter's position, world - centre; w: scale
};
BILLOW_GPU_SIZE(SpawnJob, 96);

struct MetavoxelParams {
  vec4 toVoxel[3];       // rows: voxel = dot(row.xyz, world - centre) + row.w
  vec4 toWorld[3];       // world step of a voxel along each axis of the space; w: middle of the space, in voxels
  vec4 eye;              // world - centre; w: voxel edge in world units
  vec4 planes[kPlanes];  // inside where dot(plane.xyz, voxel) + plane.w >= 0
  vec4 tint;       // extinction of red, green and blue light on its way from the sun, as multiples of the extinction;
                   // w: depth of a layer in the image of cube maps
  vec4 texel;      // of the pool, in texture coordinates; 0
  uvec4 space;     // cells an axis, edge, inner, flags
  uvec4 pool;      // log2 of slots along x and along y, slots, most occupied cells
  uvec4 limits;    // particles, list entries, volumes, rounds
  uvec4 picture;   // workgroups of the march along x, along y; number of the draw; bits of a cell's number an axis
  uvec4 cells;     // addresses (low, high): words; positions + 1, 0 where nothing is drawn
  uvec4 items;     // addresses: occupied cells in the order of their finding; cells by position
  uvec4 lists;     // addresses: first and count of the list at each position; cursors into them
  uvec4 entries;   // addresses: particle numbers of all lists; particles
  uvec4 texels;    // addresses: emission of each texel of the pool (RGB9E5); optical depth of columns by position
  uvec4 tables;    // addresses: materials; curves
  uvec4 ramps;     // addresses: ramps; counters
  uvec4 rounds;    // addresses: rounds; what the pool's blocks of texels hold
  uvec4 work;      // addresses: work items of volumes; of particles (metavoxel_work.glsl)
  uvec4 emitters;  // addresses: emitters; points of tracks
  uvec4 spawn;     // address of jobs; their number; candidates, the last of the particles
  uvec4 surfaces;  // addresses: points of meshes; given particles
  uvec4 radii;     // address of radii, one a point of a track; 1 where there are any, else all are 1
  uvec4 kept;      // addresses: a cell's last slot + 1; slots
  uvec4 spare;     // addresses: slots to give away; slots to fill
  uvec4 matter;    // address: albedo of each texel (RGB9E5) where they are kept; hash of the space; 1: weighted blend
  vec4 mapStep;    // the scene's shadow map: its texel is x * xy + y * zw, and
  vec4 mapAt;      // + xy; z: its value where no surface is; w: samples of it along a voxel's edge
  vec4 mapZ;       // voxel z = dot(xyz, (value, voxel x, voxel y)) + w
  // Two a volume: hash of all that its matter depends on.
  uvec4 contents[kMaxVolumes / 2u];
  uvec4 field;        // light field: its voxels along an axis of the space, of a cell; levels of its pyramid; 0
  vec4 fieldScale;    // edge of its voxels in those of the space; share of its light that counts; 0, 0
  uvec4 fieldMatter;  // address: what its voxels hold, by position; 0, 0
  ivec4 levels[kFieldLevels];  // of the pyramid: first texel in its image, edge
};
BILLOW_GPU_SIZE(MetavoxelParams, 52 * 16);

#ifdef __cplusplus
}  // namespace billow::runtime::gpu
#endif

#endif  // BILLOW_SHADERS_METAVOXEL_INTERFACE_H
