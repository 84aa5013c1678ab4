// Streaming: open packs, instances that play them, and what is drawn of each at a moment, within fixed budgets of
// memory.
//
//   auto streamer = billow::runtime::Streamer::create(*renderer, {.gpuBudget = 64u << 20, .cpuBudget = 32u << 20});
//   const auto asset = (*streamer)->open({.path = "fire.blw"});
//   const auto fire = (*streamer)->addInstance({.asset = *asset});
//   // each frame of the game
//   (*streamer)->update({.seconds = 1.0 / 60, .view = view, .pixelsHigh = 1080});
//   const Drawable drawable = (*streamer)->drawable(*fire);
//   // draw its layers, in a submission that waits on wait().semaphore for wait().value
//
// Reading, checking, decompressing and uploading happen on other threads. Nothing here waits for a disk, a lock that is
// held for long, or the device. What is not resident yet is drawn coarser, and if even that is missing the last moment
// that was drawn stays. Coarser is a level that the compiler stored (`--levels`); where there is none, means of 8^3
// voxels, in which fire all but goes out.
//
// Threads: one thread at a time calls a Streamer; callbacks come from any thread. No exception leaves its functions.
#ifndef BILLOW_RUNTIME_STREAM_H
#define BILLOW_RUNTIME_STREAM_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "billow/runtime/runtime.h"

namespace billow::runtime {

// Whether the checksum of a page is compared when it is read. Whatever the policy, every index and count in a page is
// checked, so that no page makes the CPU or the GPU read outside of its memory.
enum class Verify {
  always,
  once,  // the first time that this asset reads the page
  never,
};

// How a read ends. Called once, from any thread, even from inside of read().
struct ReadDone {
  void (*call)(void* context, bool success) = nullptr;
  void* context = nullptr;
};

// A host's own files. read() must not block; it may be called from several threads at once.
class AsyncSource {
 public:
  virtual ~AsyncSource() = default;
  virtual std::uint64_t size() const = 0;
  // Fills `into` with the bytes at `offset`, which lie within size(); `into` stays until `done` was called.
  virtual void read(std::uint64_t offset, std::span<std::byte> into, ReadDone done) = 0;
};

// The host's job system: calls job(context) once, on any thread but that which is inside of a Streamer's function.
// Jobs take about a millisecond and never wait for another job.
struct JobSystem {
  void (*submit)(void* user, void (*job)(void* context), void* context) = nullptr;
  void* user = nullptr;
};

// Memory for scratch, page bytes and bookkeeping of loads. Called from any thread. allocate() may return null: the load
// then fails with ErrorCode::memory, once.
struct Allocator {
  void* (*allocate)(void* user, std::size_t size, std::size_t alignment) = nullptr;  // null: the C++ heap
  void (*release)(void* user, void* memory, std::size_t size, std::size_t alignment) = nullptr;
  void* user = nullptr;
};

enum class LogLevel { debug, information, warning, error };

struct Log {
  void (*write)(void* user, LogLevel level, const char* line) = nullptr;  // null: nothing is logged; from any thread
  void* user = nullptr;
};

// Who submits uploads to HostDevice::uploadQueue. Vulkan wants a queue to be used by one thread at a time:
// Renderer::upload() submits to it too, so it is called on the thread of update(), and not at all beside `own`.
enum class Submission {
  inUpdate,  // update() does: the queue may be the one that the host draws with
  own,       // billow's threads do, as soon as there is something: the queue is billow's alone
};

struct StreamConfig {
  // Device memory of resident frames, within the Renderer's own budget too. Never exceeded.
  std::uint64_t gpuBudget = std::uint64_t{256} << 20;
  // The staging ring, bytes in flight from the disk, scratch memory, and tables of open packs. Never exceeded.
  std::uint64_t cpuBudget = std::uint64_t{64} << 20;
  std::uint64_t stagingBytes = std::uint64_t{8} << 20;  // the ring's size, at least 64 KiB
  // Of billow's that decompress; 0: `jobs` does all of it. One more thread plans: it sleeps but for some tens of
  // microseconds an update().
  std::uint32_t threads = 2;
  std::uint32_t readThreads = 1;  // of billow's that read files; 0: packs come from AsyncSources alone
  JobSystem jobs = {};
  Allocator allocator = {};
  Log log = {};
  // Commands recorded after an update() have been executed before the update() that is so many later: 1 where the host
  // waits for each frame, 2 or 3 as usual.
  std::uint32_t framesInFlight = 3;
  Verify verify = Verify::once;
  Submission submission = Submission::inUpdate;
  // How far ahead of what is drawn is loaded, real time, beyond the time that a load takes; 0 to 60.
  double prefetchSeconds = 0.25;
};

// Handles stay unequal after what they named is gone.
struct AssetId {
  std::uint32_t value = 0;  // 0: none
  bool operator==(const AssetId&) const = default;
};
struct InstanceId {
  std::uint32_t value = 0;
  bool operator==(const InstanceId&) const = default;
};

// One of them.
struct PackSource {
  std::string path = {};
  std::shared_ptr<AsyncSource> source = {};
};

enum class Loop { once, loop, pingPong };  // once: the first and last frames are held

enum class Interpolation {
  hold,    // the frame that began last
  blend,   // two frames, weighted
  advect,  // both carried along their velocity to the moment, then weighted; blend where a volume has no velocity
};

struct Playback {
  double speed = 1;  // volume seconds a real second; negative: backwards; 0: stands
  Loop loop = Loop::loop;
  Interpolation interpolation = Interpolation::blend;
};

struct InstanceInfo {
  AssetId asset = {};
  std::uint32_t volume = 0;              // one that is a level of another is drawn as coarse as that, or coarser
  std::optional<GridChoice> grids = {};  // of the volume; default: chooseGrids(). Velocities are those by role
  double time = 0;                       // seconds from the volume's first frame
  Playback playback = {};
  // As MetavoxelVolume has it; decides only how large the instance is in the picture.
  std::array<double, 12> objectToWorld{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  float priority = 1;  // multiplies its size in the picture, >= 0; 0: nothing is loaded for it
};

struct UpdateInfo {
  double seconds = 0;             // that passed since the last update(), >= 0
  std::optional<View> view = {};  // without one all instances are near
  std::uint32_t pixelsHigh = 1080;
};

// What is drawn of an instance until the next update().
struct Drawable {
  std::array<Layer, kMostLayers> layers = {};  // the first `count`; weights sum to 1
  std::uint32_t count = 0;                     // 0 only before anything of the volume was resident
  double time = 0;      // seconds of the volume that are shown, after looping; that of the last update() where not held
  bool held = false;    // nothing of the wanted moment was resident: the last one that was
  bool coarse = false;  // some of it coarser than the picture's size asks for
};

// In place of the width of a frame's voxels.
inline constexpr std::uint8_t kNotResident = 0xff;

// Why bricks of the wanted moments are not drawn in the detail that the picture asks for.
enum class Missing { queued, reading, decoding, uploading, gpuBudget, cpuBudget, failed };
inline constexpr std::uint32_t kMissingCount = 7;

struct StreamStats {
  std::uint64_t updates = 0;
  // Since the update() before.
  std::uint64_t bytesRead = 0, bytesDecompressed = 0, bytesUploaded = 0, bytesEvicted = 0;
  std::uint32_t framesLoaded = 0, framesEvicted = 0;
  std::uint32_t framesLate = 0;  // began, for an instance with priority, when nothing of their moment could be drawn
  // Now.
  std::uint64_t gpuBytes = 0;      // of resident and arriving frames
  std::uint64_t gpuAllocated = 0;  // device memory held, never above gpuBudget
  std::uint64_t cpuBytes = 0;      // never above cpuBudget
  std::uint64_t cpuPeak = 0, gpuPeak = 0;
  std::uint32_t framesResident = 0;
  std::uint32_t loadsQueued = 0, loadsReading = 0, loadsDecoding = 0, loadsUploading = 0;
  // Instances, of those with priority.
  std::uint32_t instances = 0, instancesHeld = 0, instancesCoarse = 0, instancesEmpty = 0;
  std::array<std::uint64_t, kMissingCount> missingBricks{};  // by Missing
};

struct StreamError {
  ErrorCode code = ErrorCode::pack;
  AssetId asset = {};
  std::uint32_t volume = format::kNone, frame = format::kNone;  // kNone: it is about no single one
  std::optional<std::uint32_t> page = {};
  std::string message = {};  // one line: what, where, why, and what still plays
};

// What the submission that draws must wait for, on the device. It has been submitted; mostly it has been reached too,
// but what was urgent is drawn in the update() that submits it.
struct UploadWait {
  VkSemaphore semaphore = VK_NULL_HANDLE;
  std::uint64_t value = 0;
};

class Streamer {
 public:
  static Result<std::unique_ptr<Streamer>> create(Renderer& renderer, const StreamConfig& config);
  // Waits for billow's own threads and for the host's reads in flight; no commands that draw frames may be pending.
  virtual ~Streamer() = default;

  // Reads and checks the pack's tables on the calling thread, which is for loading screens, or on another one:
  // openLater() returns at once, and state() tells after the update() that finds it open. An AsyncSource is always read
  // on another thread's behalf.
  virtual Result<AssetId> open(const PackSource& source) = 0;
  virtual Result<AssetId> openLater(const PackSource& source) = 0;
  enum class AssetState { opening, ready, failed, unknown };
  virtual AssetState state(AssetId asset) const = 0;
  // Null unless ready. Valid until the next update() after close() or a reload that finished.
  virtual const format::Pack* pack(AssetId asset) const = 0;
  // Opens `source` beside the asset; once it is open and what is drawn now is resident of it, it takes the asset's
  // place. Instances keep their time, and draw the grids of the same names. A source that fails, or of which what is
  // drawn has not come within 30 seconds, leaves all as it was, and an error. Instances without priority draw nothing
  // of it until they have some again. An asset that failed to open is opened from `source` as by openLater().
  virtual Result<void> reload(AssetId asset, const PackSource& source) = 0;
  // Its instances go too.
  virtual void close(AssetId asset) = 0;

  // Instances of one volume share what is resident of it, where they draw the same grids. The first that asks for
  // others, or for a level, has its tables made here: some microseconds a frame, and bytes of the CPU budget.
  virtual Result<InstanceId> addInstance(const InstanceInfo& info) = 0;
  virtual void removeInstance(InstanceId instance) = 0;
  // These leave all as it is where there is no such instance, or a number is not finite.
  virtual void setPlayback(InstanceId instance, const Playback& playback) = 0;
  virtual void setTransform(InstanceId instance, const std::array<double, 12>& objectToWorld) = 0;
  virtual void setPriority(InstanceId instance, float priority) = 0;
  virtual void seek(InstanceId instance, double time) = 0;

  // A smaller budget takes effect as soon as the frames in flight allow. With a CPU budget that is not more than
  // stagingBytes and the tables of open packs nothing is loaded.
  virtual void setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) = 0;

  // Advances every instance, takes in what has arrived, and says what to draw. Never waits.
  virtual void update(const UpdateInfo& info) = 0;
  virtual Drawable drawable(InstanceId instance) const = 0;
  virtual UploadWait wait() const = 0;
  // For each frame of the instance's volume, the finest that is resident of it: n where its voxels are 2^n of the
  // volume's wide, kNotResident where nothing is; also past the last frame, and where there is no such instance.
  virtual void residency(InstanceId instance, std::span<std::uint8_t> frames) const = 0;

  virtual StreamStats stats() const = 0;
  // Each error once, the oldest first. Until it is taken, a shortage of memory is told once for an asset.
  virtual std::optional<StreamError> takeError() = 0;

  // After the device was lost, or before the host replaces it: detach() gives back everything on it and forgets what
  // was resident; attach() goes on with a Renderer of the new device. Between them update() advances time alone. At
  // detach() no commands that draw frames may be pending, unless the device is lost. Packs that are being opened go on
  // after attach().
  virtual void detach() = 0;
  virtual Result<void> attach(Renderer& renderer) = 0;

 protected:
  static Device& deviceOf(Renderer& renderer);
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_H
