// Work shared among threads whose results are used in the order of the work.
#ifndef BILLOW_FORMAT_SRC_PARALLEL_H
#define BILLOW_FORMAT_SRC_PARALLEL_H

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace billow::format {

template <class T>
class OrderedWork {
 public:
  OrderedWork(std::size_t count, unsigned threads, std::function<T(std::size_t)> work, std::function<bool(T)> use)
      : count_(count),
        work_(std::move(work)),
        use_(std::move(use)),
        threads_(std::max(threads, 1u)),
        waiting_(4 * threads_) {}

  void runAll() {
    std::vector<std::thread> others;
    const std::size_t most = std::min(threads_, count_);
    others.reserve(most);  // nothing may throw between the first thread's start and the joins
    try {
      for (std::size_t i = 1; i < most; ++i) others.emplace_back([this] { run(); });
    } catch (const std::system_error&) {
      // The system has no more threads to give: those that started do the work.
    }
    run();
    for (std::thread& thread : others) thread.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return ended_ || next_ == count_ || next_ < used_ + waiting_.size(); });
      if (ended_ || next_ == count_) return;
      const std::size_t index = next_++;
      lock.unlock();
      std::optional<T> result;
      std::exception_ptr failure;
      try {
        result = work_(index);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      finish(index, std::move(result), failure);
      changed_.notify_all();
    }
  }

  // With the mutex held.
  void finish(std::size_t index, std::optional<T> result, const std::exception_ptr& failure) {
    if (failure) return fail(failure);
    waiting_[index % waiting_.size()] = std::move(result);
    try {
      while (!ended_ && waiting_[used_ % waiting_.size()]) {
        ended_ = !use_(*std::exchange(waiting_[used_ % waiting_.size()], std::nullopt));
        ++used_;
      }
    } catch (...) {
      fail(std::current_exception());
    }
  }

  void fail(const std::exception_ptr& failure) {
    if (!failure_) failure_ = failure;
    ended_ = true;
  }

  const std::size_t count_;
  const std::function<T(std::size_t)> work_;
  const std::function<bool(T)> use_;
  const std::size_t threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::optional<T>> waiting_;  // by index, modulo its size
  std::size_t next_ = 0;
  std::size_t used_ = 0;
  bool ended_ = false;
  std::exception_ptr failure_;
};

// Calls work(i) for each i < count on up to `threads` threads (this one among them), and use(result) for each result by
// ascending i, never two at once; ends early when use() returns false. At most four results a thread wait for their
// turn. Rethrows what work() or use() threw.
template <class T, class Work, class Use>
void workInOrder(std::size_t count, unsigned threads, const Work& work, const Use& use) {
  OrderedWork<T>(count, threads, work, use).runAll();
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_PARALLEL_H
