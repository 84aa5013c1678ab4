#include "stream/cpu_share.h"

#include <algorithm>
#include <utility>

namespace billow::runtime {

bool CpuShare::fits(std::uint64_t bytes) const {
  return promised_ <= memory_.budget() && bytes <= memory_.budget() - promised_;
}

// With mutex_ held. The largest idle loaders go first.
bool CpuShare::makeRoom(std::uint64_t bytes) {
  while (!fits(bytes) && !idle_.empty()) {
    const auto largest = std::max_element(idle_.begin(), idle_.end(),
                                          [](const auto& a, const auto& b) { return a->scratch < b->scratch; });
    promised_ -= (*largest)->scratch;
    idle_.erase(largest);
  }
  return fits(bytes);
}

bool CpuShare::promise(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (!makeRoom(bytes)) return false;
  promised_ += bytes;
  return true;
}

void CpuShare::giveBack(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  promised_ -= bytes;
}

bool CpuShare::reserve(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (!makeRoom(bytes) || !memory_.reserve(bytes)) return false;
  promised_ += bytes;
  elsewhere_ += bytes;
  return true;
}

void CpuShare::release(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  memory_.release(bytes);
  promised_ -= bytes;
  elsewhere_ -= bytes;
}

void CpuShare::setBudget(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  memory_.setBudget(bytes);
  makeRoom(0);
}

bool CpuShare::couldFit(std::uint64_t bytes) const {
  const std::lock_guard lock(mutex_);
  return elsewhere_ <= memory_.budget() && bytes <= memory_.budget() - elsewhere_;
}

std::unique_ptr<PooledLoader> CpuShare::takeLoader(std::uint64_t scratch) {
  const std::lock_guard lock(mutex_);
  // The smallest that is large enough, else the largest, which grows.
  auto best = idle_.end();
  for (auto it = idle_.begin(); it != idle_.end(); ++it) {
    if (best == idle_.end()) {
      best = it;
      continue;
    }
    const std::uint64_t has = (*it)->scratch, bestHas = (*best)->scratch;
    if (bestHas < scratch ? has > bestHas : has >= scratch && has < bestHas) best = it;
  }
  std::unique_ptr<PooledLoader> loader;
  if (best == idle_.end()) {
    idle_.reserve(kMostIdle);
    loader = std::make_unique<PooledLoader>(&memory_);
  } else {
    loader = std::move(*best);
    idle_.erase(best);
    promised_ -= loader->scratch;
  }
  const std::uint64_t has = std::max(loader->scratch, scratch);
  promised_ += has - scratch;
  loader->scratch = has;
  return loader;
}

void CpuShare::returnLoader(std::unique_ptr<PooledLoader> loader) {
  const std::lock_guard lock(mutex_);
  if (idle_.size() < kMostIdle && fits(0)) {
    idle_.push_back(std::move(loader));  // there is room: takeLoader() saw to it
    return;
  }
  promised_ -= loader->scratch;
}

}  // namespace billow::runtime
