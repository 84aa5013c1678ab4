// Looks that fit a pack's volumes, measured beside everything else.
#ifndef BILLOW_RUNTIME_C_API_LOOK_FIT_H
#define BILLOW_RUNTIME_C_API_LOOK_FIT_H

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "billow/format/pack.h"
#include "billow/runtime/look.h"
#include "billow/runtime/stream.h"

namespace billow::c_api {

// By volume of the pack; none where it cannot be measured.
using Looks = std::vector<std::optional<runtime::Look>>;

// Opens the source once more, on a thread of its own, so that it depends on nobody's pack, and reads a frame of each
// volume. The destructor waits for it.
class LookFit {
 public:
  explicit LookFit(runtime::PackSource source);
  ~LookFit();
  LookFit(const LookFit&) = delete;
  LookFit& operator=(const LookFit&) = delete;

  // Null until all is measured.
  const Looks* looks() const { return done_ ? &looks_ : nullptr; }
  void wait() const { done_.wait(false); }

 private:
  void run() noexcept;

  runtime::PackSource source_;
  Looks looks_;
  std::atomic<bool> done_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_LOOK_FIT_H
