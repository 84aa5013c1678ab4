// Looks that fit a pack's volumes, measured beside everything else.
#ifndef BILLOW_RUNTIME_C_API_LOOK_FIT_H
#define BILLOW_RUNTIME_C_API_LOOK_FIT_H

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "billow/format/pack.h"
#include "billow/runtime/look.h"
#include "billow/runtime/stream.h"

namespace billow::c_api {

// By volume of the pack; none where it cannot be measured.
using Looks = std::vector<std::optional<runtime::Look>>;

// Opens the source once more, so that it depends on nobody's pack, and reads a frame of each volume.
class LookFit {
 public:
  explicit LookFit(runtime::PackSource source) : source_(std::move(source)) {}

  void run() noexcept;
  // Null until all is measured; then of any thread.
  const Looks* looks() const { return done_ ? &looks_ : nullptr; }
  // run() ends after the volume at which it is, or at once. Any thread.
  void abandon() { stop_ = true; }

 private:
  runtime::PackSource source_;
  Looks looks_;
  std::atomic<bool> done_ = false;
  std::atomic<bool> stop_ = false;
};

// Runs fits one after the other on a thread of its own, which the first one starts. The destructor waits for the one
// that runs.
class LookFitter {
 public:
  LookFitter() = default;
  ~LookFitter();
  LookFitter(const LookFitter&) = delete;
  LookFitter& operator=(const LookFitter&) = delete;

  // Throws std::system_error where there is no thread.
  void add(std::shared_ptr<LookFit> fit);

 private:
  void run() noexcept;

  std::mutex mutex_;
  std::condition_variable more_;
  std::deque<std::shared_ptr<LookFit>> waiting_;
  std::shared_ptr<LookFit> running_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_LOOK_FIT_H
