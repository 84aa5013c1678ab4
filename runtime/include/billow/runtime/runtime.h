// The runtime that a game links: it uploads frames of a pack and records passes that draw them.
//
//   auto renderer = billow::runtime::Renderer::create(host, {.gpuBudget = 256u << 20});
//   auto frame = (*renderer)->upload(pack, volume, frameIndex, {});
//   // wait on (*renderer)->uploadSemaphore() for (*frame)->uploadValue() in the submission that draws, then
//   (*renderer)->record(commandBuffer, {.frame = frame->get(), .view = view, ...});
//
// The host owns instance, device, queues, images, command buffers and the frame loop. billow enables nothing and waits
// for nothing; it submits uploads to the queue that the host lends, and only inside of upload(). No exception leaves
// a Renderer's functions. A Renderer and its frames are used from one thread at a time.
#ifndef BILLOW_RUNTIME_RUNTIME_H
#define BILLOW_RUNTIME_RUNTIME_H

#include <vulkan/vulkan_core.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "billow/format/gpu_size.h"
#include "billow/format/pack.h"

namespace billow::runtime {

struct Device;  // the runtime's own

enum class ErrorCode {
  pack,         // the pack breaks a rule or cannot be read
  budget,       // the frame does not fit into the budget; nothing was allocated
  unsupported,  // the device lacks something that billow needs
  vulkan,       // a Vulkan call failed
  deviceLost,   // a Vulkan call failed, and all others will: the device is lost
  argument,     // an argument is outside of what its comment allows
  memory,       // the system's memory, not the GPU's, or another of its resources ran out
};

struct Error {
  ErrorCode code;
  std::string message;                      // one line
  std::optional<format::Issue> issue = {};  // where code is pack
};

template <class T>
using Result = tl::expected<T, Error>;

// Features that the host enabled when it created the device. billow cannot ask for what is enabled, and needs all.
struct EnabledFeatures {
  bool bufferDeviceAddress = true;
  bool timelineSemaphore = true;
  bool synchronization2 = true;
};

// What the host lends. It must outlive the Renderer. The device needs Vulkan 1.3. Where the instance has
// VK_EXT_debug_utils enabled, objects get names and passes labels that begin with "billow".
struct HostDevice {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physicalDevice = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  PFN_vkGetInstanceProcAddr getInstanceProcAddr = nullptr;
  VkQueue uploadQueue = VK_NULL_HANDLE;  // transfer, graphics or compute; the host guards it during upload()
  std::uint32_t uploadFamily = 0;
  std::uint32_t drawFamily = 0;                    // of the queues that run recorded commands
  bool textureCompressionBc = false;               // you checked and enabled it
  VkPipelineCache pipelineCache = VK_NULL_HANDLE;  // optional: pipelines are looked up in it and added to it
  EnabledFeatures features = {};
  // Optional: passed with every object that billow makes and destroys; called from billow's threads too, so they must
  // be thread-safe.
  const VkAllocationCallbacks* allocationCallbacks = nullptr;
};

// What becomes of BC7 bricks. Automatic: they stay blocks where the device samples such 3D images fast and the frame
// has enough of them to fill one, else they are decoded to uniform bricks of 8 bits, as on software devices. native:
// blocks wherever the device samples them.
enum class BlockUse { automatic, native, decoded };

struct Config {
  std::uint64_t gpuBudget = std::uint64_t{1} << 30;  // bytes of all memory that billow allocates, staging included
  std::uint32_t recordsInFlight = 3;  // record() and recordLookup() calls whose commands may be pending at once
  BlockUse blocks = BlockUse::automatic;
};

enum class Index : std::uint32_t { flat = 0, tree = 1, dense = 2, automatic = 3 };
enum class Filter : std::uint32_t { nearest = 0, trilinear = 1, none = 2 };  // none: shadows only
enum class ColorFormat { half, single };                                     // RGBA16F, RGBA32F

// The three grids that a picture needs, and those that Layer::advect needs. kNone where the volume has none.
struct GridChoice {
  std::uint32_t extinction = format::kNone;  // numbers within the volume
  std::uint32_t temperature = format::kNone;
  std::uint32_t flames = format::kNone;
  std::uint32_t velocityX = format::kNone;  // of what the matter is carried along, in the volume's own world
  std::uint32_t velocityY = format::kNone;
  std::uint32_t velocityZ = format::kNone;
  bool operator==(const GridChoice&) const = default;
};

// By role; where no grid has a role, the first grid is extinction. No velocity: it costs as much memory as the rest.
GridChoice chooseGrids(const format::Pack& pack, const format::VolumeRecord& volume);

// The choice with what velocity grids the volume has, by role.
GridChoice withVelocity(const format::Pack& pack, const format::VolumeRecord& volume, GridChoice choice);

struct UploadOptions {
  std::optional<GridChoice> grids = {};  // default: chooseGrids()
  Index index = Index::automatic;        // automatic: what format::gpuBytes chooses; dense is for measurements
  bool means = false;                    // in place of the grids, their means of 8^3 voxels each, with a flat index
};

// Device bytes of a frame.
struct FrameStats {
  std::uint64_t indexBytes = 0;
  std::uint64_t recordBytes = 0;
  std::uint64_t maskBytes = 0;
  std::uint64_t brickBytes = 0;      // of the slots in use
  std::uint64_t allocatedBytes = 0;  // what Vulkan was asked for, alignment and unused slots included
  std::uint32_t bc7Bricks = 0;       // distinct, in the atlas
  std::uint32_t bufferBricks = 0;    // distinct, in the buffer: all others
  std::uint64_t payload() const { return indexBytes + recordBytes + maskBytes + brickBytes; }
};

// One frame of one volume, resident. Destroy it when no pending commands use it, before its Renderer.
class Frame {
 public:
  virtual ~Frame() = default;
  virtual const FrameStats& stats() const = 0;
  // uploadSemaphore() reaches this value when the upload is complete. 0 of a Streamer's frames, which are complete:
  // wait for what Streamer::wait() says.
  virtual std::uint64_t uploadValue() const = 0;
  // Whether there is nothing to draw: no grid, those of velocity aside, has an active voxel.
  virtual bool empty() const = 0;
};

inline constexpr std::uint32_t kMostLayers = 4;  // of a volume in one draw: two frames, each of two levels

// A volume between two of its frames, or between two levels of detail, is drawn as several layers: their extinctions
// and emissions add, each times its weight, so that layers whose weights sum to 1 are a cross-fade. To show moment t
// between frames at t0 and t1: one of weight 1 - s carried by t - t0 and one of weight s carried by t - t1, where
// s = (t - t0) / (t1 - t0).
struct Layer {
  const Frame* frame = nullptr;
  float weight = 1;  // of its extinction and emission, in [0, 1]; 0: it is not there
  // Seconds that the frame is carried along its velocity grids (a step back from each place, with the velocity of the
  // way's middle): positive forward in time, negative back; finite. 0, or where the frame has no velocity grid: as it
  // is. Where a velocity grid has no voxel, its background says how fast.
  float advect = 0;
};

// A pinhole camera in world space, all finite. `right`, `up` and `forward` are orthonormal.
struct View {
  std::array<double, 3> eye{0, 0, 0};
  std::array<float, 3> right{1, 0, 0};
  std::array<float, 3> up{0, 1, 0};
  std::array<float, 3> forward{0, 0, -1};
  float tanHalfHeight = 0.4f;  // tangent of half the vertical field of view, > 0
};

// Looks from `eye` at `target`; fieldOfView in degrees, vertical, in (0, 180). `upward` must not be parallel to the
// direction of view; if it is, another axis is taken.
View lookAt(const std::array<double, 3>& eye, const std::array<double, 3>& target, const std::array<double, 3>& upward,
            float fieldOfView);

struct Sun {
  std::array<float, 3> direction{0, 0, 1};   // to the sun, world space, any length but 0
  std::array<float, 3> irradiance{8, 8, 8};  // at normal incidence, linear RGB, >= 0
};

// How grid values become light. Fields as format::LookRecord has them.
struct Look {
  float extinctionScale = 1;
  std::array<float, 3> albedo{0.9f, 0.9f, 0.9f};    // in [0, 1]
  float anisotropy = 0.5f;                          // in (-1, 1)
  float emissionScale = 1;                          // 0: no emission
  float temperatureScale = 1000;                    // kelvin a grid value
  float temperatureOffset = 300;                    // kelvin
  float referenceKelvin = 1600;                     // black body of radiance emissionScale, > 0
  std::array<float, 3> ambient{0.3f, 0.35f, 0.4f};  // finite
  std::uint32_t scatteringOrders = 1;               // 1: single scattering; more imitate multiple scattering; 1 to 8
  // Smoke derived from temperature (or flames) where there is no extinction grid: shares of heatMax at which smoke
  // begins and is full, and what is left of it at heatMax.
  float heatMax = 1;  // largest temperature (or flames) value, > 0
  float smokeBegin = 0.02f;
  float smokeFull = 0.3f;
  float smokeInFire = 0.25f;
};

inline constexpr float kLeastStep = 0.05f;  // voxels; shorter ones would keep a device busy for seconds

struct Quality {
  Filter filter = Filter::trilinear;
  Filter shadows = Filter::trilinear;
  float step = 1;                  // voxels, >= kLeastStep; never less than a pixel's width
  float shadowStep = 2;            // voxels, >= kLeastStep
  std::uint32_t shadowSteps = 64;  // at most, a sample; longer ways take longer steps
  bool jitter = false;             // displace each pixel's steps by a fixed pattern: noise in place of bands
};

struct Background {
  std::array<float, 3> bottom{0, 0, 0};  // linear radiance, finite
  std::array<float, 3> top{0, 0, 0};
  float opacity = 0;  // in [0, 1]; 0: premultiplied result, its alpha is the volume's; 1: the background fills it
};

struct DrawInfo {
  const Frame* frame = nullptr;        // null where there are layers
  std::span<const Layer> layers = {};  // in place of the frame: at most kMostLayers; drawn as they are, not carried
  View view = {};
  Sun sun = {};
  Look look = {};
  Quality quality = {};
  Background background = {};
  std::uint32_t width = 0, height = 0;  // of both images
  ColorFormat colorFormat = ColorFormat::half;
  VkImageView color = VK_NULL_HANDLE;  // storage image, premultiplied linear RGBA
  VkImageView depth = VK_NULL_HANDLE;  // storage image R32F: distance along `forward`, opacity-weighted; infinity
                                       // where nothing is
};

// Reads of single values, as the march makes them: a tool for tests.
struct LookupInfo {
  const Frame* frame = nullptr;
  std::uint32_t slot = 0;           // 0 extinction, 1 temperature, 2 flames, 3 4 5 velocity x y z
  Filter filter = Filter::nearest;  // not none
  VkDeviceAddress positions = 0;    // count times three floats, pack index space
  VkDeviceAddress values = 0;       // count floats are written
  std::uint32_t count = 0;          // 1 to 4 194 240
};

class Renderer {
 public:
  static Result<std::unique_ptr<Renderer>> create(const HostDevice& host, const Config& config);
  // No commands that were recorded may be pending, and every upload must be complete.
  virtual ~Renderer() = default;

  // Reads, checks and decompresses what frame number `frame` (an index into the volume's frames) needs, and submits one
  // transfer. The pack is not trusted and is not kept.
  virtual Result<std::unique_ptr<Frame>> upload(const format::Pack& pack, std::uint32_t volume, std::uint32_t frame,
                                                const UploadOptions& options) = 0;
  virtual VkSemaphore uploadSemaphore() const = 0;

  // Builds every pipeline that record() will ask for with frames of this volume, uploaded with these options and drawn
  // alone, as they are, with the filters of `quality` in this colour format. Reads no page; call it while loading, for
  // it may take seconds.
  virtual Result<void> prepare(const format::Pack& pack, std::uint32_t volume, const UploadOptions& options,
                               const Quality& quality, ColorFormat colorFormat) = 0;

  // Records one dispatch that writes every pixel of both images. Where a combination of grids, index, filters, colour
  // format, number of layers and whether they are carried was not prepared, its pipeline is built here when it is first
  // met. barriers: both images must be in VK_IMAGE_LAYOUT_GENERAL and free of pending access; afterwards they were
  // written by the compute shader stage. The submission must wait for the uploadValue() of each frame.
  virtual Result<void> record(VkCommandBuffer commands, const DrawInfo& draw) = 0;

  // barriers: as record(), for the two buffers.
  virtual Result<void> recordLookup(VkCommandBuffer commands, const LookupInfo& lookup) = 0;

  // All memory that billow holds now, in bytes. Staging memory is given back at the next upload() after its completion.
  virtual std::uint64_t bytesInUse() const = 0;

 private:
  friend class Metavoxels;  // metavoxel.h
  friend class Compositor;  // composite.h
  friend class Streamer;    // stream.h
  friend Device& deviceOf(Renderer& renderer);
  virtual Device& device() = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_RUNTIME_H
