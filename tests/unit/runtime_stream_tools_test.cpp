// The tools that the streamer is tested and measured with: a disk that were faster than it says would make its tables
// lies.
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cstring>
#include <future>
#include <map>
#include <vector>

#include "gpu_fixture.h"
#include "simulated_disk.h"
#include "stream_host.h"
#include "vulkan_faults.h"

namespace billow::tests {
namespace {

// When each of the reads, all asked for at 0, ends.
std::map<std::uint64_t, double> endsOf(DiskSchedule& schedule) {
  std::map<std::uint64_t, double> ends;
  while (const auto next = schedule.next()) {
    for (const std::uint64_t ticket : schedule.advance(*next)) ends[ticket] = *next;
  }
  return ends;
}

TEST(DiskSchedule, LatenciesOverlapAsFarAsTheQueueIsDeep) {
  const DiskModel model{"", 0, 0.01, 0, 4, false};
  DiskSchedule schedule(model, 1);
  for (std::uint64_t i = 0; i < 10; ++i) schedule.add(0, i, i * 100, 10);
  const auto ends = endsOf(schedule);
  ASSERT_EQ(ends.size(), 10u);
  for (const auto& [ticket, end] : ends) EXPECT_NEAR(end, 0.01 * static_cast<double>(ticket / 4 + 1), 1e-9) << ticket;
  EXPECT_TRUE(schedule.idle());
}

TEST(DiskSchedule, AllReadsTogetherGetTheBandwidth) {
  for (const std::uint32_t depth : {1u, 3u, 32u}) {
    DiskSchedule schedule({"", 1e6, 0, 0, depth, false}, 1);
    for (std::uint64_t i = 0; i < 50; ++i) schedule.add(0, i, 0, 20000);
    double last = 0;
    for (const auto& [ticket, end] : endsOf(schedule)) last = std::max(last, end);
    EXPECT_NEAR(last, 1.0, 1e-9) << depth;
  }
}

TEST(DiskSchedule, AHeadThatNeedNotMoveHasNoLatency) {
  DiskSchedule schedule({"", 0, 0.01, 0, 1, true}, 1);
  schedule.add(0, 0, 500, 100);
  schedule.add(0, 1, 600, 100);
  schedule.add(0, 2, 600, 100);
  const auto ends = endsOf(schedule);
  EXPECT_NEAR(ends.at(0), 0.01, 1e-9);
  EXPECT_NEAR(ends.at(1), 0.01, 1e-9);
  EXPECT_NEAR(ends.at(2), 0.02, 1e-9);
}

TEST(DiskSchedule, JitterHasItsMeanAndOnlyDelays) {
  DiskSchedule schedule({"", 0, 0.01, 0.005, 1u << 20, false}, 1);
  constexpr std::uint64_t kReads = 4000;
  for (std::uint64_t i = 0; i < kReads; ++i) schedule.add(0, i, 0, 1);
  double sum = 0, least = 1;
  for (const auto& [ticket, end] : endsOf(schedule)) {
    sum += end;
    least = std::min(least, end);
  }
  EXPECT_GE(least, 0.01);
  EXPECT_NEAR(sum / kReads, 0.015, 0.0005);
}

TEST(DiskSchedule, AReadThatComesWhenTheDiskIsIdleDoesNotEndEarlier) {
  DiskSchedule schedule({"", 1e6, 0.001, 0, 8, false}, 1);
  schedule.add(5, 7, 0, 1000);
  EXPECT_TRUE(schedule.advance(5.0019).empty());
  EXPECT_EQ(schedule.advance(5.0021), std::vector<std::uint64_t>{7});
}

struct Wait {
  std::promise<bool> done;
  static void call(void* context, bool success) { static_cast<Wait*>(context)->done.set_value(success); }
};

bool readNow(runtime::AsyncSource& file, std::uint64_t offset, std::span<std::byte> into) {
  Wait wait;
  file.read(offset, into, {Wait::call, &wait});
  return wait.done.get_future().get();
}

TEST(SimulatedDisk, GivesTheBytesNotBeforeItsLatencyAndNotFasterThanItsBandwidth) {
  SimulatedDisk disk({"", 4e6, 0.02, 0, 8, false});
  const std::vector<std::byte> bytes = randomBytes(100000, 3);
  const auto file = disk.file(bytes);
  EXPECT_EQ(file->size(), bytes.size());
  std::vector<std::byte> read(80000);
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(readNow(*file, 20000, read));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(40));
  EXPECT_TRUE(std::equal(read.begin(), read.end(), bytes.begin() + 20000));
  EXPECT_EQ(disk.stats().bytes, 80000u);
}

TEST(SimulatedDisk, FailsAndFlipsAsOftenAsItIsTold) {
  SimulatedDisk disk(kMemoryDisk);
  const std::vector<std::byte> bytes = randomBytes(256, 3);
  const auto file = disk.file(bytes);
  disk.setFaults({.failures = 0.25, .flips = 0.2});
  constexpr int kReads = 2000;
  int failed = 0, flipped = 0;
  for (int i = 0; i < kReads; ++i) {
    std::vector<std::byte> read(256);
    if (!readNow(*file, 0, read)) {
      ++failed;
      continue;
    }
    int bits = 0;
    for (std::size_t k = 0; k < read.size(); ++k) bits += std::popcount(static_cast<std::uint8_t>(read[k] ^ bytes[k]));
    EXPECT_LE(bits, 1);
    flipped += bits;
  }
  EXPECT_NEAR(failed, 500, 100);
  EXPECT_NEAR(flipped, 300, 80);
  EXPECT_EQ(disk.stats().failed, static_cast<std::uint64_t>(failed));
  EXPECT_EQ(disk.stats().flipped, static_cast<std::uint64_t>(flipped));
}

TEST(SimulatedDisk, AStallHoldsEveryReadUntilItEnds) {
  SimulatedDisk disk(kMemoryDisk);
  const auto file = disk.file(randomBytes(256, 3));
  disk.setFaults({.stalled = true});
  std::vector<std::byte> read(256);
  Wait wait;
  std::future<bool> done = wait.done.get_future();
  file->read(0, read, {Wait::call, &wait});
  EXPECT_EQ(done.wait_for(std::chrono::milliseconds(30)), std::future_status::timeout);
  disk.setFaults({});
  EXPECT_TRUE(done.get());
}

// A load reads its next page as soon as it has the one before.
TEST(SimulatedDisk, ReadsMayBeAskedForWhereOneEnds) {
  SimulatedDisk disk(kMemoryDisk);
  struct Chain {
    std::shared_ptr<runtime::AsyncSource> file;
    std::vector<std::byte> read = std::vector<std::byte>(16);
    int left = 100;
    std::promise<void> done;
    void next() {
      file->read(0, read,
                 {[](void* context, bool) {
                    auto& self = *static_cast<Chain*>(context);
                    if (--self.left > 0) return self.next();
                    self.file.reset();
                    self.done.set_value();
                  },
                  this});
    }
  } chain;
  chain.file = disk.file(randomBytes(16, 1));
  chain.next();
  chain.done.get_future().get();
  EXPECT_EQ(disk.stats().reads, 100u);
}

TEST(CountingAllocator, CountsAndNoticesWhatIsGivenBackWrongly) {
  CountingAllocator counting;
  const runtime::Allocator allocator = counting.callbacks();
  void* a = allocator.allocate(allocator.user, 1000, 64);
  void* b = allocator.allocate(allocator.user, 24, 8);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a) % 64, 0u);
  std::memset(a, 1, 1000);
  EXPECT_EQ(counting.stats().bytes, 1024u);
  allocator.release(allocator.user, a, 1000, 64);
  EXPECT_EQ(counting.stats().wrong, 0u);
  allocator.release(allocator.user, b, 23, 8);
  EXPECT_EQ(counting.stats().wrong, 1u);
  allocator.release(allocator.user, b, 24, 8);
  EXPECT_EQ(counting.stats().wrong, 2u);
  EXPECT_EQ(counting.stats().bytes, 0u);
  EXPECT_EQ(counting.stats().blocks, 0u);
  EXPECT_EQ(counting.stats().peak, 1024u);
  counting.setFailures(1);
  EXPECT_EQ(allocator.allocate(allocator.user, 8, 8), nullptr);
  EXPECT_EQ(counting.stats().failed, 1u);
}

TEST(HostJobs, RunsEachJobOnceAndNoneWhilePaused) {
  std::vector<std::atomic<int>> runs(500);
  {
    HostJobs host(3);
    const runtime::JobSystem jobs = host.callbacks();
    host.pause(true);
    for (auto& count : runs) {
      jobs.submit(
          jobs.user, [](void* context) { ++*static_cast<std::atomic<int>*>(context); }, &count);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_EQ(host.ended(), 0u);
    host.pause(false);
  }
  for (const auto& count : runs) EXPECT_EQ(count, 1);
}

class VulkanFaultsTest : public GpuTest {
 protected:
  void TearDown() override {
    VulkanFaults::get().setFaults({});
    GpuTest::TearDown();
    EXPECT_TRUE(VulkanFaults::get().stats().none());
  }
  std::unique_ptr<runtime::Renderer> makeWrapped() {
    return valueOf(runtime::Renderer::create(VulkanFaults::get().wrap(gpu().host()), {}), "the renderer");
  }
};

TEST_F(VulkanFaultsTest, CountsTheRenderersMemory) {
  const auto renderer = makeWrapped();
  const std::uint64_t before = VulkanFaults::get().stats().deviceBytes;
  const format::Pack pack = openPack(samplePack());
  const auto frame = upload(*renderer, pack);
  gpu().waitIdle();
  const auto stats = VulkanFaults::get().stats();
  EXPECT_EQ(stats.deviceBytes - before, frame->stats().allocatedBytes);
  EXPECT_EQ(stats.deviceBytes + stats.hostBytes, renderer->bytesInUse());
  EXPECT_GT(stats.submissions, 0u);
}

TEST_F(VulkanFaultsTest, AllocationsAndSubmissionsFailAsTold) {
  const auto renderer = makeWrapped();
  const format::Pack pack = openPack(samplePack());
  VulkanFaults::get().setFaults({.outOfMemory = 1});
  const auto full = renderer->upload(pack, 0, 0, {});
  ASSERT_FALSE(full.has_value());
  EXPECT_EQ(full.error().code, runtime::ErrorCode::vulkan);
  VulkanFaults::get().setFaults({.deviceLost = true});
  const auto lost = renderer->upload(pack, 0, 0, {});
  ASSERT_FALSE(lost.has_value());
  EXPECT_EQ(lost.error().code, runtime::ErrorCode::deviceLost);
  EXPECT_GT(VulkanFaults::get().stats().lost, 0u);
  VulkanFaults::get().setFaults({});
  const auto frame = renderer->upload(pack, 0, 0, {});
  EXPECT_TRUE(frame.has_value());
  gpu().waitIdle();
}

}  // namespace
}  // namespace billow::tests
