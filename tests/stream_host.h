// What a host lends to the streamer, for tests: memory that is counted and may run out, and jobs that run late and in
// any order.
#ifndef BILLOW_TESTS_STREAM_HOST_H
#define BILLOW_TESTS_STREAM_HOST_H

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <new>
#include <random>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "billow/runtime/stream.h"

namespace billow::tests {

// Counts what is held, and compares what is given back with what was taken. Outlives whoever was given callbacks().
class CountingAllocator {
 public:
  explicit CountingAllocator(std::uint32_t seed = 1) : random_(seed) {}

  runtime::Allocator callbacks() {
    return {.allocate = [](void* user, std::size_t size,
                           std::size_t alignment) { return self(user).allocate(size, alignment); },
            .release = [](void* user, void* memory, std::size_t size,
                          std::size_t alignment) { self(user).release(memory, size, alignment); },
            .user = this};
  }

  void setFailures(double share) {
    const std::lock_guard lock(mutex_);
    failures_ = share;
  }

  struct Stats {
    std::size_t bytes = 0, peak = 0;  // held now, and most at once since the last resetPeak()
    std::size_t blocks = 0;           // held now
    std::uint64_t allocations = 0;    // that succeeded
    std::uint64_t failed = 0;         // as setFailures() said
    std::uint64_t wrong = 0;          // releases of what is not held, or of another size or alignment
  };
  Stats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }
  void resetPeak() {
    const std::lock_guard lock(mutex_);
    stats_.peak = stats_.bytes;
  }

 private:
  struct Block {
    std::size_t size, alignment;
  };
  static CountingAllocator& self(void* user) { return *static_cast<CountingAllocator*>(user); }

  void* allocate(std::size_t size, std::size_t alignment) {
    const std::lock_guard lock(mutex_);
    if (static_cast<double>(random_() >> 8) / 16777216.0 < failures_) {
      ++stats_.failed;
      return nullptr;
    }
    void* memory = ::operator new(std::max<std::size_t>(size, 1), std::align_val_t(alignment), std::nothrow);
    if (memory == nullptr) return nullptr;
    held_[memory] = {size, alignment};
    stats_.bytes += size;
    stats_.peak = std::max(stats_.peak, stats_.bytes);
    ++stats_.blocks;
    ++stats_.allocations;
    return memory;
  }

  void release(void* memory, std::size_t size, std::size_t alignment) {
    if (memory == nullptr) return;
    const std::lock_guard lock(mutex_);
    const auto at = held_.find(memory);
    if (at == held_.end()) {
      ++stats_.wrong;
      return;
    }
    const Block block = at->second;
    if (block.size != size || block.alignment != alignment) ++stats_.wrong;
    held_.erase(at);
    stats_.bytes -= block.size;
    --stats_.blocks;
    ::operator delete(memory, std::align_val_t(block.alignment));
  }

  mutable std::mutex mutex_;
  std::mt19937 random_;
  double failures_ = 0;
  Stats stats_;
  std::unordered_map<void*, Block> held_;
};

// A job system with threads of its own: each time one of the jobs that wait, by chance. Destroyed after the streamer.
class HostJobs {
 public:
  explicit HostJobs(std::uint32_t threads, std::uint32_t seed = 1) : random_(seed) {
    for (std::uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  HostJobs(const HostJobs&) = delete;
  HostJobs& operator=(const HostJobs&) = delete;
  // Runs what is left.
  ~HostJobs() {
    {
      const std::lock_guard lock(mutex_);
      paused_ = false;
      stop_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  runtime::JobSystem callbacks() {
    return {.submit =
                [](void* user, void (*job)(void*), void* context) {
                  static_cast<HostJobs*>(user)->submit({job, context});
                },
            .user = this};
  }

  // No job begins while it is paused.
  void pause(bool paused) {
    {
      const std::lock_guard lock(mutex_);
      paused_ = paused;
    }
    changed_.notify_all();
  }

  std::uint64_t submitted() const {
    const std::lock_guard lock(mutex_);
    return submitted_;
  }
  // Of those submitted, all that have ended.
  std::uint64_t ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

 private:
  struct Job {
    void (*call)(void*);
    void* context;
  };

  void submit(Job job) {
    {
      const std::lock_guard lock(mutex_);
      jobs_.push_back(job);
      ++submitted_;
    }
    changed_.notify_one();
  }

  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return !paused_ && (stop_ || !jobs_.empty()); });
      if (jobs_.empty()) return;
      std::swap(jobs_[random_() % jobs_.size()], jobs_.back());
      const Job job = jobs_.back();
      jobs_.pop_back();
      lock.unlock();
      job.call(job.context);
      lock.lock();
      ++ended_;
    }
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::mt19937 random_;
  std::vector<Job> jobs_;
  std::uint64_t submitted_ = 0, ended_ = 0;
  bool paused_ = false, stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_STREAM_HOST_H
