// What the host writes and the shaders read: the parameters of every pass. Shared by C++ and GLSL; all members are
// four-component vectors, whose C++ and std140 layouts agree.
#ifndef BILLOW_SHADERS_INTERFACE_H
#define BILLOW_SHADERS_INTERFACE_H

#ifdef __cplusplus
#include <cstdint>
namespace billow::runtime::gpu {
struct vec4 {
  float x, y, z, w;
};
struct ivec4 {
  std::int32_t x, y, z, w;
};
struct uvec4 {
  std::uint32_t x, y, z, w;
};
#define BILLOW_GPU_CONST inline constexpr std::uint32_t
#define BILLOW_GPU_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)
#else
#define BILLOW_GPU_CONST const uint
#define BILLOW_GPU_SIZE(type, bytes)
#endif

// Which grids of a volume a frame has, one slot each; also the bits of the specialization constant kGrids.
BILLOW_GPU_CONST kExtinctionSlot = 0u;
BILLOW_GPU_CONST kTemperatureSlot = 1u;
BILLOW_GPU_CONST kFlamesSlot = 2u;
BILLOW_GPU_CONST kMatterSlots = 3u;    // those above: what light meets
BILLOW_GPU_CONST kVelocityXSlot = 3u;  // and y and z; in kGrids only where matter is carried along them
BILLOW_GPU_CONST kGridSlots = 6u;

// How a grid's cells of 8^3 voxels are found. `mixed` asks each grid.
BILLOW_GPU_CONST kIndexFlat = 0u;
BILLOW_GPU_CONST kIndexTree = 1u;
BILLOW_GPU_CONST kIndexDense = 2u;
BILLOW_GPU_CONST kIndexMixed = 3u;

BILLOW_GPU_CONST kFilterNearest = 0u;
BILLOW_GPU_CONST kFilterTrilinear = 1u;
BILLOW_GPU_CONST kFilterNone = 2u;  // of shadows: no shadow march

// Flat table: a record number, or kSkip with the distance (in cells, maximum norm, at least 1) to the nearest cell that
// is not skippable. A skippable cell holds nothing, nor do the cells that a trilinear tap from inside it can reach.
BILLOW_GPU_CONST kSkip = 0x80000000u;

// Tree: Node5 is 1024 mask words and 512 words of 16-bit ranks; a Node4 is the first of its children in the child list,
// the record of its absent children, 128 mask words and 64 words of ranks.
BILLOW_GPU_CONST kTreeNode5Words = 1536u;
BILLOW_GPU_CONST kTreeNode4Words = 194u;

// One grid on the GPU. Record numbers count from 1; 0 is the background, which has no record.
struct GridParams {
  uvec4 tableAndRecords;  // addresses (low, high): flat table or Node5 words; records
  uvec4 masksAndNode4;    // addresses: 64-byte masks; Node4 words
  uvec4 children;         // address of the child lists, 0, 0
  ivec4 cellMin;          // first cell of the active box, pack index space / 8; w: index kind
  ivec4 cellDim;          // cells of the active box; w: record of an absent Node4
  vec4 boxMin;            // support of the active voxels under trilinear filtering, pack index space; w: background
  vec4 boxMax;            // w: 1 when absent cells are skippable (the background is 0)
  vec4 toIndex[3];        // rows: pack index = dot(row.xyz, world - eye) + row.w
};
BILLOW_GPU_SIZE(GridParams, 160);

struct MarchParams {
  vec4 right;     // world, to the right edge at distance 1; w: radians a pixel spans at the centre
  vec4 up;        // world, to the upper edge at distance 1; w: background opacity
  vec4 forward;   // world, unit; w: march step in voxels
  vec4 sun;       // unit vector to the sun; w: Henyey-Greenstein g
  vec4 sunLight;  // irradiance at normal incidence, linear RGB; w: scattering orders to imitate, at least 1
  vec4 ambient;   // in-scattered radiance; w: extinction per world unit and grid value
  vec4 albedo;    // w: shadow step in voxels
  vec4 emission;  // radiance per world unit and unit of emission, kelvin a grid value, kelvin at 0, reference kelvin
  vec4 smoke;     // derived smoke: 1 / largest value, rise begin, rise end, share that is left in the hottest part
  vec4 background[2];  // linear RGB at the picture's bottom and top
  uvec4 size;          // width, height, shadow steps at most, jitter (0 or 1)
  uvec4 bricks;        // log2 of the BC7 atlas's slots along x | along y << 8; 0; address of the slots of 32 bytes
  vec4 flow[3];        // rows: by how much a velocity has carried matter, in voxels of the space of metavoxels, or else
                       // world units; w: at most
  GridParams grids[6];
};
BILLOW_GPU_SIZE(MarchParams, 16 * 16 + 6 * 160);

BILLOW_GPU_CONST kLayerCount = 4u;

// One of several layers that the direct march draws at once, behind the MarchParams that all share.
struct LayerParams {
  vec4 share;    // x: weight of its extinction and emission
  uvec4 bricks;  // as MarchParams has them
  GridParams grids[3];
};
BILLOW_GPU_SIZE(LayerParams, 2 * 16 + 3 * 160);

#ifdef __cplusplus
}  // namespace billow::runtime::gpu
#endif

#endif  // BILLOW_SHADERS_INTERFACE_H
