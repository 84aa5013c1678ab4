// Metavoxels: VDB volumes and procedural particles in one light-aligned space, where they shadow and occlude each
// other.
//
//   auto metavoxels = billow::runtime::Metavoxels::create(*renderer, {.tables = &pack.effects()});
//   (*metavoxels)->record(commandBuffer, {.view = view, .volumes = volumes, .effects = effects, ...});
//
// The space is a cube of metavoxels whose z axis runs along the sunlight. A metavoxel is a cube of voxels with a border
// of one, so that filtering has no seam; only those in which something is exist. Each draw bins what it is given, fills
// the metavoxels, propagates light through them column by column, and marches them. Where the pool of metavoxels is too
// small for all, they are drawn in rounds, in an order that light and eye both allow, with the same picture.
#ifndef BILLOW_RUNTIME_METAVOXEL_H
#define BILLOW_RUNTIME_METAVOXEL_H

#include <limits>
#include <span>

#include "billow/format/effect.h"
#include "billow/runtime/runtime.h"

namespace billow::runtime {

struct MetavoxelConfig {
  std::uint32_t edge = 32;        // texels along a metavoxel's edge, its border of one included; 4 to 64
  std::uint32_t metavoxels = 32;  // along each axis of the space, 1 to 128; metavoxels * (edge - 2) <= 4096
  // Bytes of all memory that this object allocates, within the Renderer's budget too. What is left after the lists is
  // the pool: 12 bytes a texel. Too little for a 256th of maxMetavoxels is an error.
  std::uint64_t memoryBudget = std::uint64_t{512} << 20;
  std::uint32_t maxMetavoxels = 4096;  // occupied ones of a draw, 1 to 65535; further ones are left out
  // Of a draw, 0 to 1 048 576: those of the host and all that its effects may have alive (format::candidatesAt(): as
  // many as if all lived for the emitter's greatest lifetime, and up to two more a span). More are an error.
  std::uint32_t maxParticles = 16384;
  std::uint32_t maxListEntries = 1u << 20;  // particles in metavoxels' lists, all together; further ones are left out
  std::uint32_t maxVolumes = 4;             // of a draw, each with up to kMostLayers layers, 0 to 8
  // Voxels along each axis of the space's light field, which Scattering::surroundings needs: `metavoxels` to 160, or 0,
  // none. They span 8 of the space's voxels or fewer where there is room for so many, else more. Each takes 22 bytes,
  // and 16 more for each of its voxels that an occupied metavoxel may have.
  std::uint32_t lightField = 0;
  std::uint32_t recordsInFlight = 3;  // record() calls whose commands may be pending at once, at least 1
  bool keepFilled = false;  // metavoxels stay filled from draw to draw, for MetavoxelDraw::refill: 4 bytes more a texel
  // Effects, and materials, curves, ramps, maps and tracks of the particles; kept to the format's rules (those of an
  // open pack are). Read by create() alone. Without them there are no particles.
  const format::EffectTables* tables = nullptr;
};

struct MetavoxelVolume {
  const Frame* frame = nullptr;        // of the Renderer; null where there are layers
  std::span<const Layer> layers = {};  // in place of the frame: at most kMostLayers
  // World units a second that a velocity grid's 1 stands for, finite. What carries matter further than
  // kFarthestCarried voxels of the space along one of its axes carries it as far as that.
  float velocityScale = 1;
  // Row-major 3x4, from the volume's own world to the scene's; invertible. Extinction and emission stay per unit of the
  // scene's world.
  std::array<double, 12> objectToWorld{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  Look look = {};  // its anisotropy, ambient and scatteringOrders are not used: see Scattering
};

inline constexpr float kFarthestCarried = 128;

// An effect of the tables, evaluated on the GPU: what format::particlesAt() gives, in single precision.
struct MetavoxelEffect {
  std::uint32_t effect = 0;  // number in the tables
  double time = 0;           // seconds since its begin, finite; outside of [0, format::kMaxEffectTime] it is not there
  // Row-major 3x4, from the effect's own world to the scene's: a format::similarityOf(). Its particles look like
  // format::transformed(): larger, they are thinner by as much.
  std::array<double, 12> objectToWorld{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
};

// How all matter of the space scatters: what shares a voxel shares this.
struct Scattering {
  float anisotropy = 0.5f;                          // in (-1, 1)
  std::array<float, 3> ambient{0.3f, 0.35f, 0.4f};  // finite
  std::uint32_t orders = 1;                         // as Look::scatteringOrders, 1 to 8
  // With a light field, matter lights matter: what it emits, and what it scatters of the sun, reaches other matter,
  // dimmed by what lies between, and is scattered alike in all directions. How much of it counts, in [0, 1]; 0 costs
  // nothing. What lies further than 64 voxels outside of the view does not count where `cull` is set. `orders` above 1
  // imitate the same for sunlight: both together count it twice.
  float surroundings = 1;
  std::uint32_t bounces = 2;  // how often that light is scattered, 1 to 8
};

// What is left of sunlight behind a voxel of optical depth d: exp(-d), or 1 / (1 + d).
enum class Attenuation { exponential, reciprocal };

// Of the diffuse colours that meet in a voxel: the largest of each channel, or their mean weighted by extinction.
enum class Blend { maximum, weighted };

// Which of a draw's metavoxels are filled; all are lit. A host that fills every n-th draw asks for never in between.
// Metavoxels stay filled while the space lies where it lay and the pool has room for all of a draw at once, even those
// that a moving eye has lost sight of; else all are filled.
enum class Refill {
  always,
  changed,  // those that were filled from other particles, volumes, looks, places or blends, as the GPU finds
  never,    // those that are new in the pool; what else has changed is not seen
};

// Where the scene's opaque surfaces begin on the light's way: a shadow map of the sun, of any resolution and place.
// Voxels behind them get no sun; outside of the map nothing is shadowed. A map finer than the voxels is averaged over
// each of them, and a coarser one is read between its texels: where four of them lie within a slope of 45 degrees as
// one surface, else as an edge between two.
struct SceneShadow {
  VkImageView view = VK_NULL_HANDLE;  // optional sampled 2D image, R32F or depth, readable by the compute shader stage
  VkImageLayout layout = VK_IMAGE_LAYOUT_GENERAL;
  // Row-major 3x4, from the world to the map: texel x and y (whole numbers and a half at their centres), which must not
  // change along the light, and what a surface there has written, which must.
  std::array<double, 12> worldToMap{};
  float empty = std::numeric_limits<float>::infinity();  // of texels without a surface; what is not finite is one too
};

inline constexpr std::uint32_t kMetavoxelTimestamps = 6;

struct MetavoxelDraw {
  View view = {};
  Sun sun = {};
  Scattering scattering = {};
  Attenuation attenuation = Attenuation::exponential;
  // What red, green and blue sunlight lose, as multiples of the extinction, >= 0; {1, 1, 1} is white light.
  std::array<float, 3> lightExtinction{1, 1, 1};
  // Middle of the space. It is moved by up to half a voxel an axis, so that the centres of voxels lie at whole
  // multiples of voxelSize along the space's axes from `anchor`: a space that follows a camera does not swim, and where
  // the sun stands on an axis of the world, which is then the space's too, the voxels of a volume that is anchored at
  // one of them are the space's.
  std::array<double, 3> center{0, 0, 0};
  std::array<double, 3> anchor{0, 0, 0};
  // World units, > 0. Fire, whose emission changes steeply from voxel to voxel, looks best at half its voxels' size.
  float voxelSize = 0.1f;
  std::span<const MetavoxelVolume> volumes = {};
  std::span<const format::Particle> particles = {};  // those of radius 0 are not there
  std::span<const MetavoxelEffect> effects = {};     // their particles come behind those of the host
  float step = 1;       // of the march, in voxels along the direction of view, >= kLeastStep
  bool jitter = false;  // displace each pixel's steps by a fixed pattern: noise in place of bands
  Blend blend = Blend::maximum;
  Refill refill = Refill::always;  // always, where MetavoxelConfig::keepFilled is not set
  bool cull = true;                // leave out what neither the eye sees nor light passes on its way to what it may see
  Background background = {};
  std::uint32_t width = 0, height = 0;  // of all images
  ColorFormat colorFormat = ColorFormat::half;
  VkImageView color = VK_NULL_HANDLE;  // as DrawInfo has them
  VkImageView depth = VK_NULL_HANDLE;
  VkImageView sceneDepth = VK_NULL_HANDLE;  // optional storage image R32F: distance of the scene along `forward`
  SceneShadow sceneShadow = {};
  // Optional: kMetavoxelTimestamps queries of a timestamp pool, reset by the host, from firstTimestamp on: begin,
  // effects evaluated and binned, first round filled, lit and marched, end. A light field counts
  // as light.
  VkQueryPool timestamps = VK_NULL_HANDLE;
  std::uint32_t firstTimestamp = 0;
};

// Of the last draw whose commands have been executed; all 0 before.
struct MetavoxelStats {
  std::uint32_t draw = 0;         // counts from 1
  std::uint32_t occupied = 0;     // metavoxels in which something is, whether or not they were drawn
  std::uint32_t drawn = 0;        // at most maxMetavoxels
  std::uint32_t filled = 0;       // of those drawn
  std::uint32_t listEntries = 0;  // particles in lists, whether or not there was room
};

// The shadow that the space casts on the scene. With MetavoxelDraw::sceneShadow it ends at the scene's surfaces, so
// that a surface that casts gets the light that has reached it; at a silhouette within a voxel's column it is the mean
// of both.
struct MetavoxelShadow {
  VkImage image = VK_NULL_HANDLE;
  VkImageView view = VK_NULL_HANDLE;  // R32F in VK_IMAGE_LAYOUT_GENERAL: optical depth of the space up to the scene's
                                      // first surface, a texel a column of voxels; written anew by each draw
  std::uint32_t size = 0;             // texels along both edges
  // Of the draw recorded last, a row each for x and y: texel = dot(row, (world, 1)), whole numbers and a half at their
  // centres.
  std::array<std::array<double, 4>, 2> toTexel{};
};

// The particles of the draw recorded last, as its passes read them.
struct MetavoxelParticles {
  VkBuffer buffer = VK_NULL_HANDLE;  // usable as a storage buffer and to copy from; written anew by each draw
  VkDeviceSize offset = 0;           // of format::Particle's, those of the host first; of radius 0: not there
  std::uint32_t count = 0;
  std::array<double, 3> center{0, 0, 0};  // to which their centres are relative
};

// One space. Used from one thread at a time, destroyed before its Renderer and when no commands that use it are
// pending.
class Metavoxels {
 public:
  static Result<std::unique_ptr<Metavoxels>> create(Renderer& renderer, const MetavoxelConfig& config);
  virtual ~Metavoxels() = default;

  // Records all passes of a draw, for a queue that takes compute and transfers. A combination of grids and index that
  // is met for the first time builds its pipelines here. barriers: images as Renderer::record() has them, sceneDepth
  // readable in VK_IMAGE_LAYOUT_GENERAL; afterwards they were read and written by the compute shader stage. Draws of
  // one object follow each other on one queue. The submission must wait for the uploadValue() of each volume's frame.
  virtual Result<void> record(VkCommandBuffer commands, const MetavoxelDraw& draw) = 0;

  virtual MetavoxelStats stats() const = 0;
  virtual MetavoxelShadow shadow() const = 0;
  virtual MetavoxelParticles particles() const = 0;
  virtual std::uint32_t poolSlots() const = 0;       // metavoxels that are resident at once
  virtual std::uint64_t bytesAllocated() const = 0;  // never above memoryBudget
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_H
