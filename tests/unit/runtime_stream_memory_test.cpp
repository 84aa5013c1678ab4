// The parts of the transport that hand out memory and work, each against a model of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <random>
#include <thread>
#include <vector>

#include "stream/counted_memory.h"
#include "stream/jobs.h"
#include "stream/range_allocator.h"
#include "stream/staging_ring.h"
#include "stream_host.h"

namespace billow::tests {
namespace {

using runtime::CountedMemory;
using runtime::Jobs;
using runtime::RangeAllocator;
using runtime::RingSpace;

// Bytes that are taken, one by one.
class ByteMap {
 public:
  explicit ByteMap(std::size_t size) : taken_(size, false) {}
  bool isFree(std::size_t offset, std::size_t bytes) const {
    return offset + bytes <= taken_.size() && std::find(at(offset), at(offset + bytes), true) == at(offset + bytes);
  }
  void set(std::size_t offset, std::size_t bytes, bool value) {
    for (std::size_t i = offset; i < offset + bytes; ++i) taken_[i] = value;
  }
  bool holds(std::size_t bytes, std::size_t alignment) const {
    for (std::size_t offset = 0; offset + bytes <= taken_.size(); offset += alignment) {
      if (isFree(offset, bytes)) return true;
    }
    return false;
  }

 private:
  std::vector<bool>::const_iterator at(std::size_t offset) const {
    return taken_.begin() + static_cast<std::ptrdiff_t>(offset);
  }
  std::vector<bool> taken_;
};

TEST(StreamMemory, RangesNeverOverlapAndFreeOnesAreFound) {
  constexpr std::size_t kSize = 4000;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    RangeAllocator ranges(kSize);
    ByteMap model(kSize);
    std::vector<std::pair<std::size_t, std::size_t>> live;
    std::size_t used = 0;
    for (int step = 0; step < 600; ++step) {
      if (random() % 5 < 3) {
        const std::size_t bytes = 1 + random() % (random() % 8 == 0 ? 1500 : 200);
        const std::size_t alignment = std::size_t{1} << random() % 8;
        const auto fit = ranges.fit(bytes, alignment);
        const auto offset = ranges.allocate(bytes, alignment);
        ASSERT_EQ(offset.has_value(), model.holds(bytes, alignment)) << bytes << " at " << alignment;
        ASSERT_EQ(offset.has_value(), fit.has_value());
        if (!offset) continue;
        ASSERT_EQ(*offset % alignment, 0u);
        ASSERT_TRUE(model.isFree(*offset, bytes));
        model.set(*offset, bytes, true);
        live.push_back({*offset, bytes});
        used += bytes;
      } else if (!live.empty()) {
        std::swap(live[random() % live.size()], live.back());
        const auto [offset, bytes] = live.back();
        live.pop_back();
        ranges.release(offset, bytes);
        model.set(offset, bytes, false);
        used -= bytes;
      }
      ASSERT_EQ(ranges.used(), used);
    }
    for (const auto& [offset, bytes] : live) ranges.release(offset, bytes);
    EXPECT_EQ(ranges.largest(), kSize) << "what is free did not become one again";
  }
}

TEST(StreamMemory, TheBestFitIsTaken) {
  RangeAllocator ranges(1000);
  const auto a = *ranges.allocate(300, 1), b = *ranges.allocate(10, 1), c = *ranges.allocate(100, 1);
  ASSERT_TRUE(ranges.allocate(10, 1));
  ranges.release(a, 300);
  ranges.release(c, 100);
  EXPECT_EQ(ranges.allocate(90, 1), c);
  EXPECT_EQ(ranges.allocate(200, 1), a);
  ranges.release(b, 10);
}

TEST(StreamMemory, PiecesOfTheRingNeverOverlap) {
  constexpr std::uint64_t kSize = 64 << 10;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    RingSpace ring(kSize);
    ByteMap model(kSize);
    struct Taken {
      RingSpace::Piece piece;
      std::uint64_t head;
    };
    std::vector<Taken> live;
    for (int step = 0; step < 1000; ++step) {
      const std::uint64_t unit = 4u << random() % 8;
      const std::uint64_t least = unit * (1 + random() % 16), most = least + random() % 40000;
      const auto piece = ring.take(least, most, unit);
      if (piece.bytes != 0) {
        ASSERT_GE(piece.bytes, least);
        ASSERT_LE(piece.bytes, most);
        ASSERT_EQ(piece.bytes % unit, 0u);
        ASSERT_TRUE(model.isFree(piece.offset, piece.bytes));
        model.set(piece.offset, piece.bytes, true);
        live.push_back({piece, ring.head()});
      } else {
        ASSERT_FALSE(live.empty()) << "an empty ring refuses " << least;
      }
      // The oldest go first.
      for (std::size_t count = random() % 3; count != 0 && !live.empty(); --count) {
        ring.release(live.front().head);
        model.set(live.front().piece.offset, live.front().piece.bytes, false);
        live.erase(live.begin());
      }
    }
    ring.release(ring.head());
    EXPECT_EQ(ring.take(kSize, kSize, 4).bytes, kSize) << "an empty ring is one run";
  }
}

// As the uploader goes about it: pieces into a batch, at most kBatches pending, executed some at a time or none.
TEST(StreamMemory, PiecesOfPendingBatchesAreNotGivenOut) {
  constexpr std::uint64_t kSize = 64 << 10;
  constexpr std::uint64_t kBatches = runtime::RingEnds::kBatches;
  std::uint32_t full = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    RingSpace ring(kSize);
    runtime::RingEnds ends;
    ByteMap model(kSize);
    std::vector<std::vector<RingSpace::Piece>> batches(1);  // by number - 1; the last is being recorded
    std::uint64_t executed = 0;
    for (int step = 0; step < 2000; ++step) {
      const std::uint64_t closed = batches.size() - 1;
      for (std::uint64_t count = random() % 2; count != 0 && executed < closed; --count) {
        for (const RingSpace::Piece& piece : batches[executed]) model.set(piece.offset, piece.bytes, false);
        ++executed;
      }
      ends.executed(executed, ring);
      full += closed - executed == kBatches;
      if (closed - executed == kBatches) continue;
      const auto piece = ring.take(256, 256 + random() % 12000, 4);
      if (piece.bytes != 0) {
        ASSERT_TRUE(model.isFree(piece.offset, piece.bytes)) << "the device still reads it";
        model.set(piece.offset, piece.bytes, true);
        batches.back().push_back(piece);
      }
      if (batches.back().empty() || random() % 3 == 0) continue;
      ends.close(closed + 1, ring);
      batches.emplace_back();
    }
  }
  EXPECT_GT(full, 100u);
}

TEST(StreamMemory, CountsWhatManyThreadsTakeAndRefusesTheRest) {
  constexpr std::uint64_t kBudget = 100'000;
  CountingAllocator counter;
  CountedMemory memory(counter.callbacks(), kBudget);
  std::atomic<int> refused = 0;
  std::vector<std::thread> threads;
  for (std::uint32_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      std::vector<std::pair<void*, std::size_t>> live;
      for (int step = 0; step < 2000; ++step) {
        const std::size_t bytes = 1 + random() % 30000;
        try {
          live.push_back({memory.allocate(bytes, 64), bytes});
        } catch (const std::bad_alloc&) {
          ++refused;
        }
        if (live.size() < 8 && random() % 2 == 0) continue;
        for (const auto& [at, size] : live) memory.deallocate(at, size, 64);
        live.clear();
      }
      for (const auto& [at, size] : live) memory.deallocate(at, size, 64);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(refused, 0);
  EXPECT_LE(memory.peak(), kBudget);
  EXPECT_LE(counter.stats().peak, memory.peak());
  EXPECT_EQ(memory.used(), 0u);
  EXPECT_EQ(counter.stats().bytes, 0u);
  counter.setFailures(1);
  EXPECT_THROW((void)memory.allocate(10, 8), std::bad_alloc);
  EXPECT_EQ(memory.used(), 0u) << "what the host refuses is not counted";
}

TEST(StreamMemory, JobsRunOnceAndNoneBeginsAfterStop) {
  struct State {
    std::atomic<int> count = 0;
  } state;
  const runtime::Job job{[](void* context) { ++static_cast<State*>(context)->count; }, &state};
  {
    Jobs jobs(2, 1, {});
    for (int i = 0; i < 100; ++i) i % 2 == 0 ? jobs.run(job) : jobs.read(job);
    while (state.count < 100) std::this_thread::yield();
    jobs.stop();
    jobs.run(job);
  }
  EXPECT_EQ(state.count, 100);
}

// A host whose system is late: what it calls after the end does nothing.
TEST(StreamMemory, JobsOfTheHostThatComeTooLateDoNothing) {
  struct Host {
    std::vector<std::pair<void (*)(void*), void*>> kept;
  } host;
  int count = 0;
  {
    Jobs jobs(0, 0,
              {.submit =
                   [](void* user, void (*call)(void*), void* context) {
                     static_cast<Host*>(user)->kept.push_back({call, context});
                   },
               .user = &host});
    jobs.run({[](void* context) { ++*static_cast<int*>(context); }, &count});
    jobs.read({[](void* context) { ++*static_cast<int*>(context); }, &count});
    ASSERT_EQ(host.kept.size(), 2u);
    host.kept[0].first(host.kept[0].second);
    EXPECT_EQ(count, 1);
  }
  host.kept[1].first(host.kept[1].second);
  EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace billow::tests
