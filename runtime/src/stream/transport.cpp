#include <algorithm>
#include <string>

#include "checks.h"
#include "stream/load_plan.h"
#include "stream/transport_core.h"

namespace billow::runtime {
namespace {

constexpr std::uint64_t kLeastStaging = std::uint64_t{64} << 10;

Result<void> checkConfig(const StreamConfig& config) {
  if (config.stagingBytes < kLeastStaging) {
    return failure(ErrorCode::argument, "StreamConfig: stagingBytes is less than 64 KiB");
  }
  if (config.threads == 0 && config.jobs.submit == nullptr) {
    return failure(ErrorCode::argument, "StreamConfig: threads is 0, and jobs has no submit");
  }
  if ((config.allocator.allocate == nullptr) != (config.allocator.release == nullptr)) {
    return failure(ErrorCode::argument, "StreamConfig: allocator has one of allocate and release alone");
  }
  if (config.framesInFlight == 0) return failure(ErrorCode::argument, "StreamConfig: framesInFlight is 0");
  return {};
}

bool inRange(const LoadOrder& order) {
  const format::Pack& pack = order.pack->pack;
  if (order.volume >= pack.volumes().size()) return false;
  const format::VolumeRecord& volume = pack.volumes()[order.volume];
  if (order.frame >= volume.frameCount) return false;
  const auto numbers = gridsBySlot(order.grids);
  return std::all_of(numbers.begin(), numbers.end(),
                     [&](std::uint32_t grid) { return grid == format::kNone || grid < volume.gridCount; });
}

LoadStage stageOf(Step step) {
  switch (step) {
    case Step::starting:
    case Step::reading:
      return LoadStage::reading;
    case Step::decodable:
    case Step::decoding:
      return LoadStage::decoding;
    case Step::waiting:
      return LoadStage::waitingForMemory;
    default:
      return LoadStage::uploading;
  }
}

}  // namespace

Result<std::unique_ptr<Transport>> Transport::create(Device& device, const StreamConfig& config, const Wake& wake) {
  if (auto fine = checkConfig(config); !fine) return tl::unexpected(fine.error());
  return guarded<std::unique_ptr<Transport>>([&]() -> Result<std::unique_ptr<Transport>> {
    auto core = std::make_unique<TransportCore>(device, config, wake);
    if (auto made = core->create(); !made) return tl::unexpected(made.error());
    return std::unique_ptr<Transport>(std::move(core));
  });
}

TransportCore::Plan TransportCore::plan(const LoadOrder& order) const {
  Plan plan;
  if (!inRange(order)) {
    plan.error = Error{.code = ErrorCode::argument, .message = "the pack has no such volume, frame or grid"};
    return plan;
  }
  plan.request = {.pack = &order.pack->pack,
                  .volume = order.volume,
                  .frame = order.frame,
                  .grids = order.grids,
                  .means = order.means,
                  .bc7 = device_.bc7,
                  .maxImageExtent3D = device_.maxImageExtent3D,
                  .verify = config_.verify,
                  .verified = order.pack->verified};
  plan.pages = pagesOf(plan.request);
  std::vector<StoredPage> stored;
  for (const std::uint32_t number : plan.pages) stored.push_back({.number = number, .bytes = {}});
  const auto load = planLoad(plan.request, stored);
  if (!load) {
    plan.error = load.error();
    return plan;
  }
  plan.readBytes = PageReads::bytesFor(order.pack->pack, plan.pages);
  plan.scratchBytes = load->scratch + format::PageUnpacker::workBytes();
  const auto gpu = heap_.need(load->bufferBytes, load->shape);
  if (!gpu) {
    plan.error = gpu.error();
  } else {
    plan.gpuBytes = *gpu;
  }
  return plan;
}

Transport::Cost TransportCore::cost(const LoadOrder& order) const {
  const auto planned = guarded<Plan>([&]() -> Result<Plan> { return plan(order); });
  if (!planned || planned->error) return {};
  return {.gpu = planned->gpuBytes, .cpu = planned->cpuBytes()};
}

bool TransportCore::submit(const LoadOrder& order) {
  try {
    Plan planned = plan(order);
    std::optional<Error> error = planned.error;
    if (!error) error = failed();
    if (!error && !share_.couldFit(planned.cpuBytes())) {
      error = Error{.code = ErrorCode::memory,
                    .message = "the frame takes " + std::to_string(planned.cpuBytes()) +
                               " bytes to load, which cpuBudget does not hold beside the staging ring and tables"};
    }
    if (!error && !share_.promise(planned.cpuBytes())) {
      const std::lock_guard lock(mutex_);
      refused_ = true;
      return false;
    }
    add(order, planned, std::move(error));
    return true;
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock(mutex_);
    refused_ = true;
    return false;
  }
}

void TransportCore::add(const LoadOrder& order, Plan& planned, std::optional<Error> error) {
  const bool starts = !error;
  Load* load = nullptr;
  try {
    const std::lock_guard lock(mutex_);
    const std::uint64_t number = submitted_ + 1;
    load = &loads_
                .emplace(std::piecewise_construct, std::forward_as_tuple(number),
                         std::forward_as_tuple(*this, order, &share_.memory(), readsInFlight_))
                .first->second;
    load->number = number;
    load->request = planned.request;
    load->pages = std::move(planned.pages);
    load->readBytes = planned.readBytes;
    load->scratchBytes = planned.scratchBytes;
    load->step = starts ? Step::starting : Step::arrived;
    load->error = std::move(error);
    try {
      tickets_[order.ticket] = load;
    } catch (const std::bad_alloc&) {
      loads_.erase(number);
      throw;
    }
    load->promised = starts ? planned.cpuBytes() : 0;
    submitted_ = number;
  } catch (const std::bad_alloc&) {
    if (starts) share_.giveBack(planned.cpuBytes());
    throw;
  }
  if (!starts) return wake();
  if (post(&startOne)) return;
  {
    // Another load's job may have taken it.
    const std::lock_guard lock(mutex_);
    const auto found = loads_.find(submitted_);
    if (found == loads_.end() || found->second.step != Step::starting) return;
    load->step = Step::reading;
  }
  finish(*load, outOfMemory());
}

void TransportCore::cancel(std::uint64_t ticket) {
  bool askBury = false, ask = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = tickets_.find(ticket);
    if (found == tickets_.end()) return;
    Load& load = *found->second;
    tickets_.erase(found);
    load.cancelled = true;
    load.reads.abandon();
    ask = load.step == Step::waiting || load.step == Step::copying;
    askBury = load.step == Step::arrived;
    if (askBury) load.step = Step::dying;
  }
  if (ask) askPump();
  if (askBury) post(&bury);
}

std::optional<LoadStage> TransportCore::stage(std::uint64_t ticket) const {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(ticket);
  return found == tickets_.end() ? std::nullopt : std::optional(stageOf(found->second->step));
}

void TransportCore::take(std::vector<Arrival>& arrivals) {
  progress();
  decltype(loads_) gone(loads_.get_allocator());  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  for (auto it = loads_.begin(); it != loads_.end();) {
    Load& load = it->second;
    if (load.step != Step::arrived) {
      ++it;
      continue;
    }
    Arrival& arrival = arrivals.emplace_back(Arrival{.ticket = load.order.ticket, .frame = nullptr});
    // It had arrived before its upload could not be submitted.
    if (!load.error && failure_ && load.upload.batch > uploader_.submitted()) load.error = failure_;
    if (load.error) {
      if (load.error->issue) arrival.page = load.error->issue->place.page;
      arrival.frame = tl::unexpected(std::move(*load.error));
      if (load.frame != nullptr) kept_.push_back(std::move(load.frame));
    } else {
      if (load.upload.batch <= executed_) cover(load.upload.batch);
      arrival.frame = std::move(load.frame);
    }
    tickets_.erase(load.order.ticket);
    gone.insert(loads_.extract(it++));
  }
}

bool TransportCore::mustLeave(const ResidentFrame& frame) const {
  return frame.memory_ != nullptr && heap_.leaving(static_cast<const HeapMemory&>(*frame.memory_));
}

bool TransportCore::admit(const ResidentFrame& frame) {
  if (frame.memory_ == nullptr) return true;
  const std::uint64_t batch = static_cast<const HeapMemory&>(*frame.memory_).batch;
  if (batch > uploader_.submitted()) return false;
  cover(batch);
  return true;
}

// Two threads raise it.
void TransportCore::cover(std::uint64_t batch) {
  std::uint64_t taken = taken_;
  while (taken < batch && !taken_.compare_exchange_weak(taken, batch)) {
  }
}

void TransportCore::retire(std::unique_ptr<ResidentFrame>&& frame) {
  const std::lock_guard lock(mutex_);
  // Where the place cannot be had the caller still has the frame.
  retired_.push_back({updates_, nullptr});
  retired_.back().frame = std::move(frame);
}

void TransportCore::update() {
  bool any = false;
  {
    const std::lock_guard lock(mutex_);
    ++updates_;
    buried_.reserve(buried_.size() + retired_.size());
    std::erase_if(retired_, [&](Retired& retired) {
      if (retired.update + config_.framesInFlight > updates_) return false;
      buried_.push_back(std::move(retired.frame));
      return true;
    });
    any = !buried_.empty() || diesLater_;
  }
  if (config_.submission == Submission::inUpdate) submitBatches();
  progress();
  if (any) post(&bury);
}

void TransportCore::setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) {
  heap_.setBudget(gpuBytes);
  share_.setBudget(cpuBytes);
  askPump();
  wake();
}

void TransportCore::releaseCpu(std::uint64_t bytes) {
  share_.release(bytes);
  wake();
}

TransportStats TransportCore::stats() const {
  return {.bytesRead = bytesRead_,
          .bytesDecompressed = bytesDecompressed_,
          .bytesUploaded = uploader_.bytesUploaded(),
          .gpuAllocated = heap_.allocated(),
          .gpuUsed = heap_.used(),
          .gpuPeak = heap_.peak(),
          .cpuBytes = share_.memory().used(),
          .cpuPeak = share_.memory().peak()};
}

}  // namespace billow::runtime
