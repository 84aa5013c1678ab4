// Who has how much of the CPU budget: what loads in flight may need at most is set aside for them when they begin, so
// that none fails halfway. With it the loaders, which keep their scratch memory from load to load.
#ifndef BILLOW_RUNTIME_STREAM_CPU_SHARE_H
#define BILLOW_RUNTIME_STREAM_CPU_SHARE_H

#include <memory>
#include <mutex>
#include <vector>

#include "stream/counted_memory.h"
#include "stream/load_frame.h"

namespace billow::runtime {

struct PooledLoader {
  explicit PooledLoader(std::pmr::memory_resource* memory) : loader(memory) {}
  FrameLoader loader;
  std::uint64_t scratch = 0;  // bytes that it may hold
};

// Thread-safe.
class CpuShare {
 public:
  CpuShare(const Allocator& allocator, std::uint64_t budget) : memory_(allocator, budget) {}

  CountedMemory& memory() { return memory_; }
  const CountedMemory& memory() const { return memory_; }

  // Sets bytes aside; false where they do not fit, even without idle loaders.
  bool promise(std::uint64_t bytes);
  void giveBack(std::uint64_t bytes);
  // promise(), for bytes that lie elsewhere and are counted now.
  bool reserve(std::uint64_t bytes);
  void release(std::uint64_t bytes);
  void setBudget(std::uint64_t bytes);
  // Whether promise() could succeed if nothing were in flight.
  bool couldFit(std::uint64_t bytes) const;

  // A loader for a load that was promised `scratch` bytes for it; the promise may become larger, to loader->scratch,
  // which the budget holds since the loader had it. Throws std::bad_alloc.
  std::unique_ptr<PooledLoader> takeLoader(std::uint64_t scratch);
  // Its promise ends; it stays for the next load, unless there are enough.
  void returnLoader(std::unique_ptr<PooledLoader> loader);

 private:
  static constexpr std::size_t kMostIdle = 16;
  bool fits(std::uint64_t bytes) const;
  bool makeRoom(std::uint64_t bytes);

  CountedMemory memory_;
  mutable std::mutex mutex_;
  std::uint64_t promised_ = 0;  // all of it: loads, idle loaders, and what lies elsewhere
  std::uint64_t elsewhere_ = 0;
  std::vector<std::unique_ptr<PooledLoader>> idle_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_CPU_SHARE_H
