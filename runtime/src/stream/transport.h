// From a page on disk to a frame on the device: reads, decompression, memory and uploads, each bounded. What to load
// and what to give up is the planner's business.
#ifndef BILLOW_RUNTIME_STREAM_TRANSPORT_H
#define BILLOW_RUNTIME_STREAM_TRANSPORT_H

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "billow/format/pack.h"
#include "billow/runtime/stream.h"
#include "frame.h"

namespace billow::runtime {

// An open pack and how its pages are read. Loads hold it until they end.
struct OpenPack {
  format::Pack pack;
  std::shared_ptr<AsyncSource> source;               // null: pack.source() is read on billow's threads
  std::vector<std::atomic<std::uint32_t>> verified;  // a bit a page, for Verify::once
};

struct LoadOrder {
  std::uint64_t ticket = 0;  // the planner's name for it
  std::shared_ptr<OpenPack> pack;
  std::uint32_t volume = 0, frame = 0;
  GridChoice grids = {};
  bool means = false;  // the frame of Node3 means in place of the frame
  // It arrives once its upload is recorded, for draws to wait on the device until it is executed; else when it has
  // been.
  bool urgent = false;
};

enum class LoadStage { reading, decoding, waitingForMemory, uploading };

struct Arrival {
  std::uint64_t ticket = 0;
  // Complete on the device, but for urgent loads: see admit(). Errors: ErrorCode::pack and memory are this frame's;
  // vulkan is the device's.
  Result<std::unique_ptr<ResidentFrame>> frame;
  std::optional<std::uint32_t> page = {};  // that the error is about
};

struct TransportStats {
  std::uint64_t bytesRead = 0, bytesDecompressed = 0, bytesUploaded = 0;  // since create()
  std::uint64_t gpuAllocated = 0, gpuUsed = 0, gpuPeak = 0, cpuBytes = 0, cpuPeak = 0;
};

// Called from any thread when something changed that the planner may act on: short, and no call into the Transport.
struct Wake {
  void (*call)(void* user) = nullptr;  // null: nobody wants to know
  void* user = nullptr;
};

// submit(), cancel(), stage(), take() and wanted() are called by the planner, one thread at a time; update(), admit(),
// retire() and wait() by the frame thread; all may run at the same time.
class Transport {
 public:
  static Result<std::unique_ptr<Transport>> create(Device& device, const StreamConfig& config, const Wake& wake);
  // As stop(). Frames must be gone before, save for those that were retired.
  virtual ~Transport() = default;
  // Nothing goes on: waits for own threads, jobs that the host's system has begun, reads in flight, and the uploads
  // that were submitted (some seconds at most). From then on frames may be destroyed.
  virtual void stop() = 0;

  // Most device bytes that the frame takes, alignment included, and most scratch on the CPU: from the tables alone.
  struct Cost {
    std::uint64_t gpu = 0, cpu = 0;
  };
  // Zero where the tables contradict themselves: the load will say how.
  virtual Cost cost(const LoadOrder& order) const = 0;

  // False where its scratch does not fit beside what is in flight now: ask again after a wake. What could not ever fit,
  // is out of range, or comes after a failure of the device, is taken and arrives as an error. Loads are worked on in
  // order of submission.
  virtual bool submit(const LoadOrder& order) = 0;
  // The load ends soon, without an arrival.
  virtual void cancel(std::uint64_t ticket) = 0;
  virtual std::optional<LoadStage> stage(std::uint64_t ticket) const = 0;
  virtual void take(std::vector<Arrival>& arrivals) = 0;
  // Device bytes that loads wait for because no block has room: the planner must evict, or cancel them.
  virtual std::uint64_t wantedGpuBytes() const = 0;
  // Whether the frame lies in memory that must be given back because the budget shrank: evict it, and load it anew if
  // it is needed.
  virtual bool mustLeave(const ResidentFrame& frame) const = 0;

  // On the frame thread, once an update(): counts it, frees what was retired framesInFlight updates ago, and submits
  // uploads where Submission is inUpdate. Never waits.
  virtual void update() = 0;
  // Whether the frame may be drawn: its upload has been submitted, and wait() covers it. If not, ask after the next
  // update().
  virtual bool admit(const ResidentFrame& frame) = 0;
  // The frame is not drawn from now on.
  virtual void retire(std::unique_ptr<ResidentFrame>&& frame) = 0;
  virtual UploadWait wait() const = 0;

  virtual void setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) = 0;
  // Counts bytes that others hold (tables of open packs) against the CPU budget; false where they do not fit.
  virtual bool reserveCpu(std::uint64_t bytes) = 0;
  virtual void releaseCpu(std::uint64_t bytes) = 0;
  virtual TransportStats stats() const = 0;
  // Runs job(context) on billow's threads or the host's; never where the Transport is destroyed before its turn. Throws
  // std::bad_alloc.
  virtual void run(void (*job)(void* context), void* context) = 0;
  // As run(), where files are read: such a job may wait for a disk.
  virtual void read(void (*job)(void* context), void* context) = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_TRANSPORT_H
