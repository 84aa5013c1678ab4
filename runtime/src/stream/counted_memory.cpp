#include "stream/counted_memory.h"

#include <new>

namespace billow::runtime {

bool CountedMemory::reserve(std::uint64_t bytes) {
  std::uint64_t used = used_;
  do {
    const std::uint64_t budget = budget_;
    if (used > budget || bytes > budget - used) return false;
  } while (!used_.compare_exchange_weak(used, used + bytes));
  std::uint64_t peak = peak_;
  while (peak < used + bytes && !peak_.compare_exchange_weak(peak, used + bytes)) {
  }
  return true;
}

void* CountedMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (!reserve(bytes)) throw std::bad_alloc();
  void* const memory = allocator_.allocate != nullptr
                           ? allocator_.allocate(allocator_.user, bytes, alignment)
                           : ::operator new(bytes, std::align_val_t(alignment), std::nothrow);
  if (memory != nullptr) return memory;
  release(bytes);
  throw std::bad_alloc();
}

void CountedMemory::do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) {
  if (allocator_.allocate != nullptr) {
    allocator_.release(allocator_.user, memory, bytes, alignment);
  } else {
    ::operator delete(memory, std::align_val_t(alignment));
  }
  release(bytes);
}

}  // namespace billow::runtime
