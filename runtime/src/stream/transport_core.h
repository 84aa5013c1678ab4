// The way of a load: starting -> reading -> decodable -> decoding -> waiting (for device memory) -> copying (through
// the ring) -> flying (until the device has executed the copies) -> arrived. Each step is one job that takes the first
// load which is ready for it, so loads are worked on in order, and no job waits: where something is missing the load
// stays, and whoever provides it asks for the job again.
#ifndef BILLOW_RUNTIME_STREAM_TRANSPORT_CORE_H
#define BILLOW_RUNTIME_STREAM_TRANSPORT_CORE_H

#include <map>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "stream/cpu_share.h"
#include "stream/gpu_heap.h"
#include "stream/jobs.h"
#include "stream/page_reads.h"
#include "stream/transport.h"
#include "stream/uploader.h"

namespace billow::runtime {

class TransportCore;

Error outOfMemory();

enum class Step { starting, reading, decodable, decoding, waiting, copying, flying, arrived, dying };

// While its step is one of work (reading, decoding, copying) one thread has it; else who holds the mutex.
struct Load {
  Load(TransportCore& transportCore, const LoadOrder& wanted, std::pmr::memory_resource* memory,
       ReadsInFlight& inFlight)
      : core(transportCore), order(wanted), reads(memory, inFlight) {}

  TransportCore& core;
  const LoadOrder order;
  std::uint64_t number = 0;  // by submission
  Step step = Step::starting;
  bool cancelled = false;

  LoadRequest request;
  std::vector<std::uint32_t> pages;
  PageReads reads;
  std::uint64_t readBytes = 0, scratchBytes = 0;  // promised
  std::uint64_t promised = 0;                     // what is left of both and its own
  std::unique_ptr<PooledLoader> loader;           // holds what `loaded` points to
  LoadedFrame loaded;
  std::uint64_t gpuBytes = 0;
  std::unique_ptr<ResidentFrame> frame;
  Upload upload;
  std::optional<Error> error;
};

class TransportCore final : public Transport {
 public:
  TransportCore(Device& device, const StreamConfig& config, const Wake& wake);
  ~TransportCore() override { stop(); }
  void stop() override;
  Result<void> create();

  Cost cost(const LoadOrder& order) const override;
  bool submit(const LoadOrder& order) override;
  void cancel(std::uint64_t ticket) override;
  std::optional<LoadStage> stage(std::uint64_t ticket) const override;
  void take(std::vector<Arrival>& arrivals) override;
  std::uint64_t wantedGpuBytes() const override { return wanted_; }
  bool mustLeave(const ResidentFrame& frame) const override;
  void update() override;
  bool admit(const ResidentFrame& frame) override;
  void retire(std::unique_ptr<ResidentFrame>&& frame) override;
  UploadWait wait() const override { return {uploader_.semaphore(), taken_}; }
  void setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) override;
  bool reserveCpu(std::uint64_t bytes) override { return share_.reserve(bytes); }
  void releaseCpu(std::uint64_t bytes) override;
  TransportStats stats() const override;
  void run(void (*job)(void* context), void* context) override { jobs_.run({job, context}); }
  void read(void (*job)(void* context), void* context) override { jobs_.read({job, context}); }

 private:
  struct Retired {
    std::uint64_t update;
    std::unique_ptr<ResidentFrame> frame;
  };
  struct Plan {
    LoadRequest request;
    std::vector<std::uint32_t> pages;
    std::uint64_t readBytes = 0, scratchBytes = 0, gpuBytes = 0;
    std::optional<Error> error;
    std::uint64_t cpuBytes() const { return readBytes + scratchBytes + sizeof(Load) + 256; }
  };

  Plan plan(const LoadOrder& order) const;
  Load* first(Step step);
  bool executed(const ResidentFrame& frame) const;
  void cover(std::uint64_t batch);  // by wait()
  void add(const LoadOrder& order, Plan& plan, std::optional<Error> error);

  // Jobs; `core` is this.
  static void startOne(void* core);
  static void decodeOne(void* core);
  static void pump(void* core);
  static void bury(void* core);
  static void readsDone(void* load);

  bool post(void (*job)(void*));
  void askPump();
  void decode(Load& load);
  void describe(Load& load, std::unique_ptr<HeapMemory> memory);
  Load* nextToCopy(std::uint64_t after);
  bool copyOne(Load& load);  // false where ring or memory have no room for it now
  void copied(Load& load);
  void countWanted();
  // Ends a load that this thread has: it arrives with the frame, or with an error, or goes where it was cancelled.
  void finish(Load& load, std::optional<Error> error);
  void land(Load& load);
  void submitBatches();
  void progress();
  void fail(const Error& error);
  std::optional<Error> failed() const;
  void wake() const;
  void submitLoop();

  Device& device_;
  const StreamConfig config_;
  const Wake wake_;
  CpuShare share_;
  ReadsInFlight readsInFlight_;
  mutable GpuHeap heap_;
  Uploader uploader_;

  mutable std::mutex mutex_;
  std::pmr::map<std::uint64_t, Load> loads_;  // by number
  std::unordered_map<std::uint64_t, Load*> tickets_;
  std::uint64_t submitted_ = 0;
  std::vector<Retired> retired_;
  std::vector<std::unique_ptr<ResidentFrame>> buried_;  // nothing reads them any more; some may still be written
  std::vector<std::unique_ptr<ResidentFrame>> kept_;    // of loads that failed with the device, until the end
  std::optional<Error> failure_;                        // the device's
  std::uint64_t updates_ = 0;
  bool diesLater_ = false;  // loads that end are still written
  bool refused_ = false;    // submit() gave false, and the planner waits for room

  std::atomic<bool> broken_ = false;  // failure_ is set
  SingleFlight pumping_;
  std::atomic<bool> ringBlocked_ = false;  // pumping ended for want of ring or command buffers
  std::atomic<std::uint64_t> wanted_ = 0, taken_ = 0, executed_ = 0;
  std::atomic<std::uint64_t> bytesRead_ = 0, bytesDecompressed_ = 0;

  std::mutex submitMutex_;
  std::condition_variable submitAsked_;
  bool stopping_ = false;
  std::thread submitter_;  // where Submission is own
  Jobs jobs_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_TRANSPORT_CORE_H
