#include "stream/jobs.h"

#include <utility>

namespace billow::runtime {

void WorkQueue::start(std::uint32_t threads) {
  threads_.reserve(threads);
  for (std::uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

void WorkQueue::push(const Job& job) {
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return;
    jobs_.push_back(job);
  }
  changed_.notify_one();
}

void WorkQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    jobs_.clear();
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void WorkQueue::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stopped_ || !jobs_.empty(); });
    if (stopped_) return;
    const Job job = jobs_.front();
    jobs_.pop_front();
    lock.unlock();
    job.call(job.context);
    lock.lock();
  }
}

Jobs::Jobs(std::uint32_t threads, std::uint32_t readThreads, const JobSystem& host)
    : ownThreads_(threads != 0), readThreads_(readThreads != 0), host_(host) {
  work_.start(threads);
  reads_.start(readThreads);
}

void Jobs::run(const Job& job) {
  if (ownThreads_) return work_.push(job);
  auto passage = std::make_unique<Passage>(gate_, job);
  host_.submit(host_.user, &pass, passage.release());
}

void Jobs::read(const Job& job) {
  readThreads_ ? reads_.push(job) : run(job);
}

void Jobs::pass(void* passage) {
  const std::unique_ptr<Passage> owned(static_cast<Passage*>(passage));
  Gate& gate = *owned->gate;
  {
    const std::lock_guard lock(gate.mutex);
    if (gate.closed) return;
    ++gate.running;
  }
  owned->job.call(owned->job.context);
  const std::lock_guard lock(gate.mutex);
  --gate.running;
  gate.idle.notify_all();
}

void Jobs::stop() {
  reads_.stop();
  work_.stop();
  std::unique_lock lock(gate_->mutex);
  gate_->closed = true;
  gate_->idle.wait(lock, [&] { return gate_->running == 0; });
}

}  // namespace billow::runtime
