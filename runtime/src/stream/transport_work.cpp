#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "billow/format/rule.h"
#include "checks.h"
#include "stream/transport_core.h"

namespace billow::runtime {
namespace {

Error readError(const format::Pack& pack, std::uint32_t page) {
  const format::Place place = format::placeOfPage(pack, page);
  const format::Issue issue = format::makeIssue(
      format::Rule::cannotRead, place, std::to_string(pack.pages()[page].storedSize) + " bytes cannot be read.");
  return {.code = ErrorCode::pack, .message = toString(issue), .issue = issue};
}

}  // namespace

Error outOfMemory() {
  return {.code = ErrorCode::memory, .message = "out of memory while a frame was loaded"};
}

TransportCore::TransportCore(Device& device, const StreamConfig& config, const Wake& wake)
    : device_(device),
      config_(config),
      wake_(wake),
      share_(config.allocator, config.cpuBudget),
      heap_(device, config.gpuBudget),
      uploader_(device, {[](void* core) {
                           auto& self = *static_cast<TransportCore*>(core);
                           const std::lock_guard lock(self.submitMutex_);
                           self.submitAsked_.notify_one();
                         },
                         this}),
      loads_(&share_.memory()),
      jobs_(config.threads, config.readThreads, config.jobs) {}

Result<void> TransportCore::create() {
  if (!share_.reserve(config_.stagingBytes)) {
    return failure(ErrorCode::budget, "StreamConfig: cpuBudget is less than stagingBytes");
  }
  if (auto made = heap_.create(); !made) return made;
  if (auto made = uploader_.create(config_.stagingBytes); !made) return made;
  if (config_.submission == Submission::own) submitter_ = std::thread([this] { submitLoop(); });
  return {};
}

void TransportCore::stop() {
  {
    const std::lock_guard lock(submitMutex_);
    if (std::exchange(stopping_, true)) return;
    submitAsked_.notify_all();
  }
  if (submitter_.joinable()) submitter_.join();
  {
    const std::lock_guard lock(mutex_);
    for (auto& [number, load] : loads_) load.reads.abandon();
  }
  jobs_.stop();
  readsInFlight_.waitForNone();
  uploader_.finish();
}

void TransportCore::wake() const {
  if (wake_.call != nullptr) wake_.call(wake_.user);
}

bool TransportCore::post(void (*job)(void*)) {
  try {
    jobs_.run({job, this});
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void TransportCore::askPump() {
  if (pumping_.ask() && !post(&pump)) pumping_.drop();
}

Load* TransportCore::first(Step step) {
  for (auto& [number, load] : loads_) {
    if (load.step == step) return &load;
  }
  return nullptr;
}

std::optional<Error> TransportCore::failed() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void TransportCore::startOne(void* context) {
  auto& core = *static_cast<TransportCore*>(context);
  Load* load = nullptr;
  bool cancelled = false;
  {
    const std::lock_guard lock(core.mutex_);
    load = core.first(Step::starting);
    if (load == nullptr) return;
    load->step = Step::reading;
    cancelled = load->cancelled;
  }
  if (cancelled) return core.finish(*load, std::nullopt);
  if (const auto error = core.failed()) return core.finish(*load, error);
  try {
    load->reads.start(core.jobs_, *load->order.pack, load->pages, {&readsDone, load});
  } catch (const std::bad_alloc&) {
    core.finish(*load, outOfMemory());
  }
}

void TransportCore::readsDone(void* context) {
  Load& load = *static_cast<Load*>(context);
  TransportCore& core = load.core;
  core.bytesRead_ += load.reads.bytesRead();
  if (const auto page = load.reads.failed()) {
    return core.finish(load, readError(load.order.pack->pack, *page));
  }
  {
    const std::lock_guard lock(core.mutex_);
    load.step = Step::decodable;
  }
  if (core.post(&decodeOne)) return;
  {
    // Another load's job may have taken it.
    const std::lock_guard lock(core.mutex_);
    if (load.step != Step::decodable) return;
    load.step = Step::decoding;
  }
  core.finish(load, outOfMemory());
}

void TransportCore::decodeOne(void* context) {
  auto& core = *static_cast<TransportCore*>(context);
  Load* load = nullptr;
  bool cancelled = false;
  {
    const std::lock_guard lock(core.mutex_);
    load = core.first(Step::decodable);
    if (load == nullptr) return;
    load->step = Step::decoding;
    cancelled = load->cancelled;
  }
  if (cancelled) return core.finish(*load, std::nullopt);
  if (const auto error = core.failed()) return core.finish(*load, error);
  try {
    core.decode(*load);
  } catch (const std::bad_alloc&) {
    core.finish(*load, outOfMemory());
  }
}

void TransportCore::decode(Load& load) {
  load.loader = share_.takeLoader(load.scratchBytes);
  load.promised -= load.scratchBytes;
  auto loaded = load.loader->loader.load(load.request, load.reads.pages());
  if (!loaded) return finish(load, loaded.error());
  for (const std::uint32_t page : load.pages) bytesDecompressed_ += load.request.pack->pages()[page].rawSize;
  load.loaded = std::move(*loaded);
  load.reads.clear();
  share_.giveBack(load.readBytes);
  load.promised -= load.readBytes;
  load.upload = {.buffer = load.loaded.buffer, .atlas = load.loaded.atlas, .shape = load.loaded.shape};
  const auto need = heap_.need(load.loaded.buffer.size(), load.loaded.shape);
  if (!need) {
    if (isVulkan(need.error().code)) fail(need.error());
    return finish(load, need.error());
  }
  load.gpuBytes = *need;
  load.frame = std::make_unique<ResidentFrame>();
  {
    const std::lock_guard lock(mutex_);
    load.step = Step::waiting;
  }
  askPump();
  wake();
}

// Gives a decoded frame its memory.
void TransportCore::describe(Load& load, std::unique_ptr<HeapMemory> memory) {
  ResidentFrame& frame = *load.frame;
  load.upload.target = memory.get();
  frame.number_ = ++device_.frames;
  frame.stats_ = load.loaded.stats;
  frame.stats_.allocatedBytes = memory->bytes();
  frame.shape_ = load.loaded.shape;
  frame.bricks_ = memory->buffer.block != nullptr ? memory->address() : 0;
  frame.atlas_ = memory->view != VK_NULL_HANDLE ? memory->view : uploader_.emptyAtlas();
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (load.loaded.grids[slot].present) {
      frame.grids_[slot] = residentGrid(load.loaded.grids[slot], frame.bricks_);
    }
  }
  frame.memory_ = std::move(memory);
}

// What is half copied goes first: it has memory already. Then those that wait for some, behind number `after`.
Load* TransportCore::nextToCopy(std::uint64_t after) {
  const std::lock_guard lock(mutex_);
  if (Load* load = first(Step::copying)) return load;
  for (auto it = loads_.upper_bound(after); it != loads_.end(); ++it) {
    if (it->second.step == Step::waiting) return &it->second;
  }
  return nullptr;
}

void TransportCore::pump(void* context) {
  auto& core = *static_cast<TransportCore*>(context);
  core.pumping_.begin();
  core.ringBlocked_ = false;
  std::uint64_t noRoom = 0;
  try {
    while (Load* load = core.nextToCopy(noRoom)) {
      const std::uint64_t number = load->number;
      if (core.copyOne(*load)) continue;
      if (core.ringBlocked_) break;
      noRoom = number;  // one behind it may be small enough
    }
  } catch (const std::bad_alloc&) {
    // The load stays where it is, and is tried again when anything else has moved.
  }
  if (auto closed = core.uploader_.close(); !closed) core.fail(closed.error());
  core.progress();
  core.countWanted();
  if (core.pumping_.again() && !core.post(&pump)) core.pumping_.drop();
}

bool TransportCore::copyOne(Load& load) {
  bool cancelled = false;
  {
    const std::lock_guard lock(mutex_);
    cancelled = load.cancelled;
  }
  if (const auto error = failed()) {
    finish(load, error);
    return true;
  }
  if (cancelled) {
    // What is recorded is executed, so its memory stays until then.
    load.upload.begun ? copied(load) : finish(load, std::nullopt);
    return true;
  }
  if (load.upload.target == nullptr) {
    auto memory = guarded<std::unique_ptr<HeapMemory>>(
        [&] { return heap_.allocate(load.loaded.buffer.size(), load.loaded.shape); });
    if (!memory) {
      if (isVulkan(memory.error().code)) fail(memory.error());
      finish(load, memory.error());
      return true;
    }
    if (*memory == nullptr) return false;
    describe(load, std::move(*memory));
    const std::lock_guard lock(mutex_);
    load.step = Step::copying;
  }
  if (auto done = uploader_.copy(load.upload); !done) {
    if (isVulkan(done.error().code)) fail(done.error());
    finish(load, done.error());
    return true;
  }
  ringBlocked_ = !load.upload.copied;
  if (load.upload.copied) copied(load);
  return !ringBlocked_;
}

// All of it is recorded; the CPU's copy is not needed any more.
void TransportCore::copied(Load& load) {
  share_.returnLoader(std::move(load.loader));
  bool refused = false;
  {
    const std::lock_guard lock(mutex_);
    load.step = Step::flying;
    if (failure_) land(load);  // meanwhile
    refused = std::exchange(refused_, false);
  }
  if (refused) wake();
}

void TransportCore::countWanted() {
  std::uint64_t wanted = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, load] : loads_) {
      if (load.step == Step::waiting) wanted += load.gpuBytes;
    }
  }
  // Those behind a load that waits for the ring do not lack memory.
  if (ringBlocked_) wanted = 0;
  if (wanted_.exchange(wanted) != wanted) wake();
}

void TransportCore::finish(Load& load, std::optional<Error> error) {
  load.reads.clear();
  // After a failure of the device nothing that it may still write to is given back before the end.
  if (error && !load.upload.begun) load.frame.reset();
  if (load.loader != nullptr) share_.returnLoader(std::move(load.loader));
  share_.giveBack(std::exchange(load.promised, 0));
  bool gone = false;
  {
    const std::lock_guard lock(mutex_);
    gone = load.cancelled;
    load.error = std::move(error);
    load.step = gone ? Step::dying : Step::arrived;
  }
  if (gone) post(&bury);
  wake();
}

void TransportCore::bury(void* context) {
  auto& core = *static_cast<TransportCore*>(context);
  std::vector<std::unique_ptr<ResidentFrame>> frames;
  decltype(core.loads_) gone(core.loads_.get_allocator());  // destroyed without the lock
  {
    const std::lock_guard lock(core.mutex_);
    const auto written = [&](const auto& frame) { return !core.executed(*frame); };
    const auto done = std::stable_partition(core.buried_.begin(), core.buried_.end(), written);
    try {
      frames.reserve(static_cast<std::size_t>(core.buried_.end() - done) + core.loads_.size());
    } catch (const std::bad_alloc&) {
      core.diesLater_ = true;
      return;
    }
    std::move(done, core.buried_.end(), std::back_inserter(frames));
    core.buried_.erase(done, core.buried_.end());
    core.diesLater_ = false;
    for (auto it = core.loads_.begin(); it != core.loads_.end();) {
      const bool dying = it->second.step == Step::dying;
      // It had arrived before the device was done with it.
      const bool later = dying && it->second.frame != nullptr && !core.failure_ && written(it->second.frame);
      core.diesLater_ = core.diesLater_ || later;
      if (!dying || later) {
        ++it;
        continue;
      }
      if (it->second.frame != nullptr) (core.failure_ ? core.kept_ : frames).push_back(std::move(it->second.frame));
      gone.insert(core.loads_.extract(it++));
    }
  }
  frames.clear();
  gone.clear();
  core.askPump();
  core.wake();
}

void TransportCore::submitBatches() {
  if (!uploader_.wantsSubmit() || broken_) return;
  if (auto done = uploader_.submit(); !done) fail(done.error());
}

// Ends a load that was flying, with mutex_ held.
void TransportCore::land(Load& load) {
  share_.giveBack(std::exchange(load.promised, 0));
  load.error = failure_;
  load.step = load.cancelled ? Step::dying : Step::arrived;
  static_cast<HeapMemory&>(*load.frame->memory_).batch = load.upload.batch;
}

bool TransportCore::executed(const ResidentFrame& frame) const {
  return frame.memory_ == nullptr || static_cast<const HeapMemory&>(*frame.memory_).batch <= executed_;
}

// Takes in what the device has executed, and what is urgent as soon as it is recorded.
void TransportCore::progress() {
  if (broken_) return;
  const auto done = uploader_.completed();
  if (!done) return fail(done.error());
  executed_ = *done;
  bool any = false, dead = false;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [number, load] : loads_) {
      if (load.step != Step::flying) continue;
      const bool soon = load.order.urgent && !load.cancelled;
      if (load.upload.batch > (soon ? uploader_.closed() : *done)) continue;
      any = true;
      dead = dead || load.cancelled;
      land(load);
    }
  }
  if (ringBlocked_ && uploader_.seen() != *done) askPump();
  if (dead) post(&bury);
  if (any) wake();
}

void TransportCore::fail(const Error& error) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_) return;
    failure_ = error;
    broken_ = true;
    for (auto& [number, load] : loads_) {
      if (load.step == Step::flying) land(load);
    }
  }
  askPump();
  wake();
}

void TransportCore::submitLoop() {
  std::unique_lock lock(submitMutex_);
  constexpr std::chrono::microseconds kPoll(300);
  while (!stopping_) {
    const bool busy = executed_ < uploader_.submitted() || ringBlocked_;
    const auto asked = [&] { return stopping_ || (uploader_.wantsSubmit() && !broken_); };
    if (busy && !broken_) {
      submitAsked_.wait_for(lock, kPoll, asked);
    } else {
      submitAsked_.wait(lock, asked);
    }
    if (stopping_) return;
    lock.unlock();
    submitBatches();
    progress();
    lock.lock();
  }
}

}  // namespace billow::runtime
