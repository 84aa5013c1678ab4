// Uploads in flight: the command pool, the timeline semaphore, and staging memory until it is no longer read.
#ifndef BILLOW_RUNTIME_UPLOAD_H
#define BILLOW_RUNTIME_UPLOAD_H

#include <vector>

#include "frame.h"

namespace billow::runtime {

class Uploads {
 public:
  explicit Uploads(Device& device) : device_(device) {}
  Uploads(const Uploads&) = delete;
  Uploads& operator=(const Uploads&) = delete;
  ~Uploads();

  Result<void> create();
  // Gives back the staging memory and commands of complete uploads. Never waits.
  void collect();
  // Records and submits the copies from `objects.staging`, which it keeps until they are done.
  Result<void> submit(FrameObjects& objects);
  VkSemaphore semaphore() const { return semaphore_; }

 private:
  struct Pending {
    std::uint64_t value;
    VkCommandBuffer commands;
    Buffer staging;
  };
  Result<void> record(VkCommandBuffer commands, const FrameObjects& objects) const;
  Result<void> queue(VkCommandBuffer commands);  // signals submitted_ + 1

  Device& device_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkSemaphore semaphore_ = VK_NULL_HANDLE;
  std::uint64_t submitted_ = 0;
  std::vector<Pending> pending_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_UPLOAD_H
