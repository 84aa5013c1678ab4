// The pack's binary layout, shared by C++ and GLSL (spec/format.md is the standard; this header follows it).
//
// Every struct is plain little-endian data made of 32- and 64-bit scalars. The structs above the line
// `#ifdef __cplusplus ... file only` are also read by shaders, so they hold 32-bit scalars only, whose C++, std430 and
// scalar layouts agree. Sizes are asserted where the structs are declared.
#ifndef BILLOW_FORMAT_LAYOUT_H
#define BILLOW_FORMAT_LAYOUT_H

#ifdef __cplusplus
#include <cstddef>
#include <cstdint>
#define BILLOW_U32 std::uint32_t
#define BILLOW_F32 float
#define BILLOW_CONST inline constexpr std::uint32_t
#define BILLOW_ASSERT_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)
namespace billow::format {
#else
#define BILLOW_U32 uint
#define BILLOW_F32 float
#define BILLOW_CONST const uint
#define BILLOW_ASSERT_SIZE(type, bytes)
#endif

// ---- Tree geometry: log2 of children per axis, and of the voxels a node spans per axis.
BILLOW_CONST kNode5Log2 = 5u;
BILLOW_CONST kNode4Log2 = 4u;
BILLOW_CONST kNode3Log2 = 3u;
BILLOW_CONST kNode5SpanLog2 = 12u;  // 4096 voxels
BILLOW_CONST kNode4SpanLog2 = 7u;   // 128 voxels
BILLOW_CONST kNode3SpanLog2 = 3u;   // 8 voxels
BILLOW_CONST kIndexSpan = 4096u;    // voxels per axis that one grid may span in a frame
BILLOW_CONST kBrickVoxels = 512u;

// ---- Node3.brick = encoding << kEncodingShift | unit. On disk `unit` is a global index of 32-byte brick units.
// A brick's texels are integers; indices of N bits lie one after another in the order of voxel indices.
BILLOW_CONST kEncodingShift = 27u;
BILLOW_CONST kBrickUnitMask = 0x07ffffffu;
BILLOW_CONST kBrickUnitBytes = 32u;
BILLOW_CONST kEncodingConstant = 0u;    // no brick: every active voxel is `lo`
BILLOW_CONST kEncodingBc7Z = 1u;        // 8x8x2 RGBA texels, four z values a texel; 128 bytes
BILLOW_CONST kEncodingBc7Y = 2u;        // the same with y and z exchanged
BILLOW_CONST kEncodingBc7X = 3u;        // the same with x and z exchanged
BILLOW_CONST kEncodingUniform1 = 4u;    // an index of 1 bit a voxel, which is the texel; 64 bytes
BILLOW_CONST kEncodingUniform8 = 11u;   // those between have 2 to 7 bits; 64 bytes a bit
BILLOW_CONST kEncodingUniform16 = 12u;  // 16 bits; 1024 bytes
BILLOW_CONST kEncodingLocal2 = 13u;  // two ends a cell of 4x4x2 voxels, then indices of 2 bits between them; 160 bytes
BILLOW_CONST kEncodingLocal6 = 17u;  // those between have 3 to 5 bits; 32 bytes and 64 a bit
BILLOW_CONST kEncodingCoarse = 18u;  // 4x4x4 bytes, linear between them; 64 bytes
BILLOW_CONST kEncodingCount = 19u;

// ---- Node3.mask: a global index of 64-byte masks, or one of these.
BILLOW_CONST kMaskAll = 0xffffffffu;    // every voxel is active
BILLOW_CONST kMaskTexel = 0xfffffffeu;  // uniform and local only: a voxel is active exactly where its index is not 0
BILLOW_CONST kMaskIndexLimit = 0x80000000u;

// ---- Node4.flags and Node5.flags
// Only in a node without children: all of its voxels are active and hold `tile`. Else voxels under absent children are
// inactive and `tile` is the background.
BILLOW_CONST kNodeTileActive = 1u;

BILLOW_CONST kNone = 0xffffffffu;

// A brick's header: 8x8x8 voxels. An active voxel's value is lo + scale * texel, in single precision, product rounded
// before the sum, texel an integer from 0 to the encoding's largest (brick.h); an inactive voxel's is the grid frame's
// background.
// Voxel (x, y, z) is bit i = x * 64 + y * 8 + z of its mask: bit i & 31 of word i >> 5.
struct Node3 {
  BILLOW_U32 brick;
  BILLOW_U32 mask;
  BILLOW_F32 lo;
  BILLOW_F32 scale;
  BILLOW_F32 mean;  // of all 512 reconstructed values
};
BILLOW_ASSERT_SIZE(Node3, 20);

struct Mask3 {
  BILLOW_U32 words[16];
};
BILLOW_ASSERT_SIZE(Mask3, 64);

// 16^3 children of 8^3 voxels. Child (x, y, z) is bit x * 256 + y * 16 + z of `mask`. The children present are, in bit
// order, children[childBegin ...]: global Node3 indices.
struct Node4 {
  BILLOW_U32 childBegin;
  BILLOW_U32 flags;
  BILLOW_F32 tile;
  BILLOW_F32 min;  // of every value below as reconstructed, tiles and inactive voxels included
  BILLOW_F32 max;
  BILLOW_F32 mean;
  BILLOW_U32 mask[128];
};
BILLOW_ASSERT_SIZE(Node4, 536);

// 32^3 children of 128^3 voxels; bit x * 1024 + y * 32 + z. Children are global Node4 indices.
struct Node5 {
  BILLOW_U32 childBegin;
  BILLOW_U32 flags;
  BILLOW_F32 tile;
  BILLOW_F32 min;
  BILLOW_F32 max;
  BILLOW_F32 mean;
  BILLOW_U32 mask[1024];
};
BILLOW_ASSERT_SIZE(Node5, 4120);

#ifdef __cplusplus  // file only

// ---- Container
inline constexpr std::uint8_t kMagic[8] = {0x8a, 'B', 'L', 'W', 0x0d, 0x0a, 0x1a, 0x0a};
inline constexpr std::uint16_t kVersionMajor = 1;
inline constexpr std::uint16_t kVersionMinor = 0;
inline constexpr std::uint64_t kSectionAlignment = 64;
inline constexpr std::uint32_t kMaxSections = 64;

struct FileHeader {
  std::uint8_t magic[8];
  std::uint16_t versionMajor;
  std::uint16_t versionMinor;
  std::uint32_t sectionCount;
  std::uint64_t fileSize;
  std::uint64_t contentsOffset;    // 64
  std::uint64_t contentsChecksum;  // XXH3-64 of sectionCount SectionEntry
  std::uint64_t reserved[2];       // 0
  std::uint64_t headerChecksum;    // XXH3-64 of the 56 bytes before
};
BILLOW_ASSERT_SIZE(FileHeader, 64);

constexpr std::uint32_t fourcc(char a, char b, char c, char d) {
  return static_cast<std::uint32_t>(static_cast<unsigned char>(a)) |
         static_cast<std::uint32_t>(static_cast<unsigned char>(b)) << 8 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(c)) << 16 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(d)) << 24;
}
inline constexpr std::uint32_t kSectionStrings = fourcc('S', 'T', 'R', 'S');     // UTF-8 text, names point into it
inline constexpr std::uint32_t kSectionVolumes = fourcc('V', 'O', 'L', 'S');     // VolumeRecord[]
inline constexpr std::uint32_t kSectionGrids = fourcc('G', 'R', 'D', 'S');       // GridRecord[]
inline constexpr std::uint32_t kSectionFrames = fourcc('F', 'R', 'M', 'S');      // FrameRecord[]
inline constexpr std::uint32_t kSectionGridFrames = fourcc('G', 'F', 'R', 'M');  // GridFrame[]
inline constexpr std::uint32_t kSectionPageLists = fourcc('P', 'L', 'S', 'T');   // u32[]: page numbers
inline constexpr std::uint32_t kSectionPageTable = fourcc('P', 'D', 'I', 'R');   // PageRecord[]
inline constexpr std::uint32_t kSectionPages = fourcc('P', 'A', 'G', 'E');       // the pages, one after another
inline constexpr std::uint32_t kSectionInfo = fourcc('I', 'N', 'F', 'O');        // optional: JSON, provenance
// Optional: which volumes are coarser levels of others.
inline constexpr std::uint32_t kSectionLevels = fourcc('L', 'E', 'V', 'L');       // LevelRecord[]
inline constexpr std::uint32_t kSectionLevelErrors = fourcc('L', 'E', 'R', 'R');  // LevelError[]
// Optional: effects (effect.h).
inline constexpr std::uint32_t kSectionEffects = fourcc('E', 'F', 'C', 'T');      // EffectRecord[]
inline constexpr std::uint32_t kSectionEmitters = fourcc('E', 'M', 'I', 'T');     // EmitterRecord[]
inline constexpr std::uint32_t kSectionSpans = fourcc('S', 'P', 'W', 'N');        // SpawnSpan[]
inline constexpr std::uint32_t kSectionMaterials = fourcc('M', 'T', 'R', 'L');    // ParticleMaterial[]
inline constexpr std::uint32_t kSectionCurves = fourcc('C', 'U', 'R', 'V');       // CurveRow[]
inline constexpr std::uint32_t kSectionRamps = fourcc('R', 'A', 'M', 'P');        // RampTable[]
inline constexpr std::uint32_t kSectionCubes = fourcc('C', 'U', 'B', 'E');        // CubeMap[]
inline constexpr std::uint32_t kSectionGiven = fourcc('G', 'I', 'V', 'N');        // GivenParticle[]
inline constexpr std::uint32_t kSectionTracks = fourcc('T', 'R', 'C', 'K');       // TrackRecord[]
inline constexpr std::uint32_t kSectionTrackFrames = fourcc('T', 'R', 'F', 'R');  // TrackFrame[]
inline constexpr std::uint32_t kSectionTrackBytes = fourcc('T', 'R', 'P', 'T');   // point clouds, one after another
inline constexpr std::uint32_t kSectionSurfaces = fourcc('S', 'U', 'R', 'F');     // SurfacePoint[]

inline constexpr std::uint32_t kSectionRequired = 1;  // SectionEntry.flags: a reader that does not know it must refuse

struct SectionEntry {
  std::uint32_t type;
  std::uint32_t flags;
  std::uint64_t offset;  // from the start of the file; a multiple of 64
  std::uint64_t size;
  std::uint64_t checksum;  // XXH3-64 of the section's bytes
};
BILLOW_ASSERT_SIZE(SectionEntry, 32);

struct StringRef {  // UTF-8, not terminated
  std::uint32_t offset;
  std::uint32_t size;
};
BILLOW_ASSERT_SIZE(StringRef, 8);

// Look defaults of a volume. `set` says which are given, one bit a field in declaration order (bit 0: extinctionScale);
// the others are 0 and the reader's own defaults hold.
struct LookRecord {
  std::uint32_t set;
  float extinctionScale;   // extinction per world unit = grid value * this
  float albedo[3];         // single-scattering albedo, each in [0, 1]
  float anisotropy;        // Henyey-Greenstein g in (-1, 1)
  float emissionScale;     // radiance factor of emission, >= 0
  float temperatureScale;  // kelvin = temperatureOffset + temperatureScale * grid value
  float temperatureOffset;
  float ambient[3];  // constant in-scattered radiance
  std::uint32_t reserved[4];
};
BILLOW_ASSERT_SIZE(LookRecord, 64);

// One named volume: a sequence of frames, each with the same grids. Its grid frames are
// gridFrames[firstGridFrame + frame * gridCount + grid].
struct VolumeRecord {
  StringRef name;
  std::uint32_t firstGrid;
  std::uint32_t gridCount;
  std::uint32_t firstFrame;
  std::uint32_t frameCount;
  std::uint32_t firstGridFrame;
  float framesPerSecond;
  LookRecord look;
};
BILLOW_ASSERT_SIZE(VolumeRecord, 96);

enum class Role : std::uint32_t {
  none = 0,
  extinction = 1,
  temperature = 2,
  flames = 3,
  velocityX = 4,
  velocityY = 5,
  velocityZ = 6,
  colorR = 7,
  colorG = 8,
  colorB = 9,
  fuel = 10,
};
inline constexpr std::uint32_t kRoleCount = 11;

enum class SourceType : std::uint32_t {  // what the source stored; every grid of a pack holds floats
  float32 = 0,
  float16 = 1,
  float64 = 2,
  int32 = 3,
  int64 = 4,
  boolean = 5,
  mask = 6,
  vec3f = 7,
  vec3d = 8,
  vec3i = 9,
};
inline constexpr std::uint32_t kSourceTypeCount = 10;

struct GridRecord {
  StringRef name;  // of a vec3 grid's component: "velocity.x"
  std::uint32_t role;
  std::uint32_t sourceType;
  std::uint32_t component;  // 0, 1, 2 of a vec3 grid; kNone for a scalar grid
  std::uint32_t volume;
  std::uint32_t reserved[2];
};
BILLOW_ASSERT_SIZE(GridRecord, 32);

inline constexpr std::uint32_t kFrameHeld = 1;   // FrameRecord.flags: missing in the source, repeats the frame before
inline constexpr std::uint32_t kFrameBlank = 2;  // missing in the source, holds nothing

struct FrameRecord {
  std::int32_t number;  // as the source counts; strictly increasing within a volume
  std::uint32_t flags;
  double time;  // seconds from the volume's first frame
};
BILLOW_ASSERT_SIZE(FrameRecord, 16);

inline constexpr std::uint32_t kGridPresent = 1;  // GridFrame.flags: the source frame has this grid

enum class BrickClass : std::uint32_t { bc7 = 0, uniform = 1, local = 2, coarse = 3 };
inline constexpr std::uint32_t kBrickClassCount = 4;

// One grid in one frame: the frame's constants and root.
struct GridFrame {
  std::uint32_t flags;
  std::uint32_t node5;        // global index; kNone where no voxel is active
  std::int32_t origin[3];     // source index of pack voxel (0, 0, 0); multiples of 8
  std::int32_t activeMin[3];  // inclusive box of active voxels and tiles in pack index space [0, 4095];
  std::int32_t activeMax[3];  //   min > max where nothing is active
  float background;           // value of everything outside and inactive
  float valueMin;             // of all reconstructed values, background included
  float valueMax;
  float sourceMin;  // of the source's active values and background: the PSNR's range
  float sourceMax;
  float maxError;  // largest |reconstructed - source| over active voxels
  std::uint32_t reserved;
  double squaredError;          // sum over active voxels
  double indexToWorld[12];      // 3x4, row-major: world = M * (pack index, 1); voxel centres are at integers
  std::uint64_t activeVoxels;   // tiles included
  std::uint32_t pageListBegin;  // pages that hold everything this grid frame needs
  std::uint32_t pageListCount;
  std::uint32_t node4Count;  // distinct, reachable from node5
  std::uint32_t node3Count;
  std::uint32_t maskCount;
  std::uint32_t childCount;  // children of the Node5 and of each distinct Node4, summed
  std::uint32_t tileCount;   // distinct values of active tiles, by their bits; the background is not counted
  std::uint32_t brickCount[kBrickClassCount];  // distinct values of Node3.brick, by class
  std::uint32_t brickUnits[kBrickClassCount];  // units of the same
  std::uint32_t reserved2;
};
BILLOW_ASSERT_SIZE(GridFrame, 248);

// ---- Detail levels: a volume that holds another one's frames and grids with voxels 2^log2 as long. Its voxel c covers
// the full volume's voxels 2^log2 c to 2^log2 (c + 1) - 1 of source index space, and is their mean.
inline constexpr std::uint32_t kMaxLevelLog2 = 4;

struct LevelRecord {
  std::uint32_t volume;      // the full one
  std::uint32_t level;       // the volume that holds the coarser trees
  std::uint32_t log2;        // 1 to kMaxLevelLog2
  std::uint32_t firstError;  // that of the level's frame f and grid g is errors[firstError + f * gridCount + g]
};
BILLOW_ASSERT_SIZE(LevelRecord, 16);

// What a level, trilinear between its voxels, differs by from the full volume's source at the centres of all voxels,
// active or not. One a grid frame of a level.
struct LevelError {
  double squaredError;  // sum over voxels
  float maxError;
  std::uint32_t reserved;
};
BILLOW_ASSERT_SIZE(LevelError, 16);

// ---- Pages. A page holds a run of each of six global arrays, one after the other in this order, no gaps:
enum class Stream : std::uint32_t { unit = 0, mask = 1, node5 = 2, node4 = 3, node3 = 4, child = 5 };
inline constexpr std::uint32_t kStreamCount = 6;
inline constexpr std::uint32_t kStreamItemBytes[kStreamCount] = {kBrickUnitBytes, 64, 4120, 536, 20, 4};
// Items that an array can have: its indices are 32 bits wide, those of units 27 (beside the encoding), of masks 31.
inline constexpr std::uint64_t kStreamLimit[kStreamCount] = {
    std::uint64_t{kBrickUnitMask} + 1, kMaskIndexLimit, kNone, kNone, kNone, kNone};
inline constexpr std::uint32_t kMaxPageBytes = 1u << 20;  // raw; a reader may refuse more

struct StreamRange {  // [first, first + count) of the stream's global array
  std::uint32_t first;
  std::uint32_t count;
};
BILLOW_ASSERT_SIZE(StreamRange, 8);

enum class Codec : std::uint32_t { raw = 0, zstd = 1, model = 2 };

struct PageRecord {
  std::uint64_t offset;    // from the start of the PAGE section
  std::uint64_t checksum;  // XXH3-64 of the stored bytes
  std::uint32_t storedSize;
  std::uint32_t rawSize;
  std::uint32_t codec;
  std::uint32_t rawChecksum;  // low half of the XXH3-64 of the content
  StreamRange streams[kStreamCount];
};
BILLOW_ASSERT_SIZE(PageRecord, 80);

}  // namespace billow::format
#endif

#endif  // BILLOW_FORMAT_LAYOUT_H
