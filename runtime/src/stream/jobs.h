// Where streaming's work runs: threads of our own or the host's job system, and threads that do nothing but read, so
// that a slow disk stops no decompression.
#ifndef BILLOW_RUNTIME_STREAM_JOBS_H
#define BILLOW_RUNTIME_STREAM_JOBS_H

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "billow/runtime/stream.h"

namespace billow::runtime {

struct Job {
  void (*call)(void* context) = nullptr;
  void* context = nullptr;
};

// Threads that take jobs in order.
class WorkQueue {
 public:
  ~WorkQueue() { stop(); }
  void start(std::uint32_t threads);  // throws std::system_error
  void push(const Job& job);          // throws std::bad_alloc
  // Jobs that did not begin are forgotten; waits for those that did.
  void stop();

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool stopped_ = false;
  std::vector<std::thread> threads_;
};

// Jobs must not throw. Those that the host's system has not begun at stop() do nothing when it calls them later.
class Jobs {
 public:
  Jobs(std::uint32_t threads, std::uint32_t readThreads, const JobSystem& host);  // throws std::system_error
  ~Jobs() { stop(); }

  void run(const Job& job);   // throws std::bad_alloc, like read()
  void read(const Job& job);  // as run() where there are no threads for it
  void stop();

 private:
  // Outlives this where the host's system is slow to call.
  struct Gate {
    std::mutex mutex;
    std::condition_variable idle;
    bool closed = false;
    std::uint32_t running = 0;
  };
  struct Passage {
    std::shared_ptr<Gate> gate;
    Job job;
  };
  static void pass(void* passage);

  const bool ownThreads_, readThreads_;
  const JobSystem host_;
  std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  WorkQueue work_, reads_;
};

// For work that looks at everything there is to do: it runs once at a time, and again if somebody asked meanwhile.
class SingleFlight {
 public:
  // True where the caller must see to it that the work runs.
  bool ask() { return state_.exchange(kAsked) == kIdle; }
  // Before the work looks at what there is.
  void begin() { state_ = kRunning; }
  // Where the work cannot run after all.
  void drop() { state_ = kIdle; }
  // After it: true where it must run again.
  bool again() {
    int running = kRunning;
    return !state_.compare_exchange_strong(running, kIdle);
  }

 private:
  static constexpr int kIdle = 0, kRunning = 1, kAsked = 2;
  std::atomic<int> state_ = kIdle;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_JOBS_H
