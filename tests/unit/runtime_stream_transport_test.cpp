// Frames on their way from a pack to the device: they read as frames that Renderer::upload() made, whatever the ring,
// the threads and the budgets, and no budget is ever exceeded.
#include <gtest/gtest.h>

#include "stream_fixture.h"

namespace billow::tests {
namespace {

using runtime::Arrival;
using runtime::BlockUse;
using runtime::ErrorCode;
using runtime::StreamConfig;
using runtime::Submission;

class StreamTransport : public StreamTest {};

std::vector<std::uint32_t> firstFrames(std::uint32_t count) {
  std::vector<std::uint32_t> numbers(count);
  for (std::uint32_t i = 0; i < count; ++i) numbers[i] = i;
  return numbers;
}

TEST_F(StreamTransport, FramesReadAsThoseOfTheRenderer) {
  const auto pack = openStream(streamPack(6, 400, 3));
  HostJobs host(2);
  for (const BlockUse blocks : {BlockUse::native, BlockUse::decoded}) {
    const auto renderer = makeRenderer({.blocks = blocks});
    for (const int variant : {0, 1, 2}) {
      StreamConfig config = smallConfig();
      // A ring that is smaller than a frame: some 160 KiB.
      if (variant == 0) config.stagingBytes = 64u << 10;
      if (variant == 1) config.submission = Submission::own;
      if (variant == 2) {
        config.threads = config.readThreads = 0;
        config.jobs = host.callbacks();
      }
      const auto transport = makeTransport(*renderer, config);
      auto frames = loadAll(*transport, pack, firstFrames(6));
      ASSERT_EQ(frames.size(), 6u);
      for (const auto& [number, frame] : frames) {
        ASSERT_NE(frame, nullptr);
        EXPECT_EQ(frame->uploadValue(), 0u);
        expectSame(*renderer, *pack, static_cast<std::uint32_t>(number), *frame);
      }
      const auto stats = transport->stats();
      EXPECT_LE(stats.cpuPeak, config.cpuBudget);
      EXPECT_LE(stats.gpuPeak, config.gpuBudget);
      EXPECT_GT(stats.bytesUploaded, 5u * 64 << 10);
      EXPECT_GT(transport->wait().value, 0u);
      frames.clear();
    }
  }
}

TEST_F(StreamTransport, CostIsNeverLessThanWhatALoadTakes) {
  const auto pack = openStream(streamPack(3, 300, 1));
  const auto renderer = makeRenderer({.blocks = BlockUse::native});
  const auto transport = makeTransport(*renderer, smallConfig());
  Frames frames;
  for (std::uint32_t number : {0u, 1u, 2u}) {
    const auto cost = transport->cost(orderOf(pack, number, 1));
    const auto before = transport->stats().gpuUsed;
    auto arrival = loadOne(*transport, orderOf(pack, number, 1));
    ASSERT_TRUE(arrival.frame);
    EXPECT_LE(transport->stats().gpuUsed - before, cost.gpu);
    EXPECT_GE(cost.gpu, (*arrival.frame)->stats().payload());
    frames[number] = std::move(*arrival.frame);
  }
}

TEST_F(StreamTransport, WhatIsRetiredIsUsedAgainAfterTheFramesInFlight) {
  const auto pack = openStream(streamPack(2, 300));
  const auto renderer = makeRenderer();
  StreamConfig config = smallConfig();
  config.framesInFlight = 3;
  const auto transport = makeTransport(*renderer, config);
  auto arrival = loadOne(*transport, orderOf(pack, 0, 1));
  ASSERT_TRUE(arrival.frame);
  const std::uint64_t used = transport->stats().gpuUsed;
  ASSERT_GT(used, 0u);
  transport->retire(std::move(*arrival.frame));
  for (int i = 0; i < 2; ++i) transport->update();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(transport->stats().gpuUsed, used);
  transport->update();
  waitFor([&] { return transport->stats().gpuUsed == 0; });
}

TEST_F(StreamTransport, LoadsWaitForRoomAndTellHowMuch) {
  const auto pack = openStream(streamPack(8, 400));
  const auto renderer = makeRenderer();
  StreamConfig config = smallConfig();
  config.framesInFlight = 1;
  const std::uint64_t one = makeTransport(*renderer, config)->cost(orderOf(pack, 0, 1)).gpu;
  config.gpuBudget = (2 * one + 200'000) >> 16 << 16;  // two frames and no third
  const auto transport = makeTransport(*renderer, config);
  auto frames = loadAll(*transport, pack, {0, 1});
  std::vector<Arrival> arrivals;
  ASSERT_TRUE(transport->submit(orderOf(pack, 2, 2)));
  waitFor([&] {
    transport->update();
    return transport->wantedGpuBytes() != 0;
  });
  EXPECT_EQ(transport->stage(2), runtime::LoadStage::waitingForMemory);
  EXPECT_LE(transport->wantedGpuBytes(), transport->cost(orderOf(pack, 2, 2)).gpu);
  transport->take(arrivals);
  EXPECT_TRUE(arrivals.empty());
  transport->retire(std::move(frames[0]));
  waitFor([&] {
    transport->update();
    transport->take(arrivals);
    return !arrivals.empty();
  });
  EXPECT_EQ(transport->wantedGpuBytes(), 0u);
  ASSERT_TRUE(arrivals[0].frame);
  expectSame(*renderer, *pack, 2, **arrivals[0].frame);
  EXPECT_LE(transport->stats().gpuPeak, config.gpuBudget);
  // What could never fit is refused.
  config.gpuBudget = 64u << 10;
  frames.clear();
  arrivals.clear();
  const auto tiny = makeTransport(*renderer, config);
  const auto refused = loadOne(*tiny, orderOf(pack, 0, 1));
  ASSERT_FALSE(refused.frame);
  EXPECT_EQ(refused.frame.error().code, ErrorCode::budget);
  config.cpuBudget = 300u << 10;
  const auto narrow = makeTransport(*renderer, config);
  auto second = loadOne(*narrow, orderOf(pack, 0, 1));
  ASSERT_FALSE(second.frame);
  EXPECT_EQ(second.frame.error().code, ErrorCode::memory);
}

// However large the budget is, no block is larger than the device allocates at once.
TEST_F(StreamTransport, BlocksAreNoLargerThanAnAllocationMayBe) {
  const auto pack = openStream(streamPack(8, 400));
  const auto renderer = makeRenderer();
  StreamConfig config = smallConfig();
  const std::uint64_t one = makeTransport(*renderer, config)->cost(orderOf(pack, 0, 1)).gpu;
  const std::uint64_t most = (one + one / 2) >> 16 << 16;
  runtime::deviceOf(*renderer).mostAllocation = most;
  config.gpuBudget = 16 * one;
  const auto transport = makeTransport(*renderer, config);
  std::uint64_t before = 0;
  std::vector<std::unique_ptr<runtime::ResidentFrame>> frames;
  for (std::uint32_t i = 0; i < 6; ++i) {
    auto arrival = loadOne(*transport, orderOf(pack, i, i + 1));
    ASSERT_TRUE(arrival.frame) << arrival.frame.error().message;
    const std::uint64_t now = transport->stats().gpuAllocated;
    EXPECT_LE(now - before, most);
    before = now;
    frames.push_back(std::move(*arrival.frame));
  }
  EXPECT_GT(before, 3 * most);
  runtime::deviceOf(*renderer).mostAllocation = 64u << 10;
  const auto refused = loadOne(*transport, orderOf(pack, 6, 7));
  ASSERT_FALSE(refused.frame);
  EXPECT_EQ(refused.frame.error().code, ErrorCode::budget) << "it would wait for ever";
}

// Everything at random: loads, cancels, evictions, budgets. The budgets hold, what arrives is right, and at the end
// nothing is left.
TEST_F(StreamTransport, RandomLoadsKeepToTheBudgetsAndLeaveNothing) {
  const auto pack = openStream(streamPack(10, 300, 4));
  const auto renderer = makeRenderer({.blocks = BlockUse::native});
  // The staging memory of the last upload() stays until the next one.
  const auto settledBytes = [&] {
    const auto frame = upload(*renderer, pack->pack);
    gpu().waitIdle();
    return renderer->bytesInUse();
  };
  (void)settledBytes();
  const std::uint64_t before = settledBytes();
  HostJobs host(2);
  CountingAllocator counter;
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    StreamConfig config = smallConfig();
    config.stagingBytes = 128u << 10;
    config.framesInFlight = 1 + seed % 3;
    if (seed % 2 == 1) config.submission = Submission::own;
    if (seed == 2) {
      config.threads = config.readThreads = 0;
      config.jobs = host.callbacks();
    }
    config.allocator = counter.callbacks();
    counter.resetPeak();
    const std::uint64_t one = makeTransport(*renderer, config)->cost(orderOf(pack, 0, 1)).gpu;
    const std::uint64_t most = 6 * one;
    config.gpuBudget = most;
    {
      const auto transport = makeTransport(*renderer, config);
      Frames frames;
      std::map<std::uint64_t, std::uint32_t> loading;
      std::uint64_t ticket = 0;
      std::vector<Arrival> arrivals;
      int arrived = 0;
      // On a slow machine it takes more steps until much has arrived.
      for (int step = 0; step < 600 || (arrived <= 20 && step < 60'000); ++step) {
        const auto number = static_cast<std::uint32_t>(random() % 10);
        if (loading.size() < 6 && transport->submit(orderOf(pack, number, ++ticket))) loading[ticket] = number;
        if (random() % 4 == 0 && !loading.empty()) {
          const auto victim = std::next(loading.begin(), random() % static_cast<long>(loading.size()));
          transport->cancel(victim->first);
          EXPECT_FALSE(transport->stage(victim->first));
          loading.erase(victim);
        }
        transport->update();
        transport->take(arrivals);
        for (Arrival& arrival : arrivals) {
          ASSERT_EQ(loading.count(arrival.ticket), 1u) << "it was cancelled";
          ASSERT_TRUE(arrival.frame) << arrival.frame.error().message;
          // Where the queue is billow's alone, nobody else may submit to it.
          const bool shared = config.submission == Submission::inUpdate;
          if (++arrived % 16 == 0 && shared) expectSame(*renderer, *pack, loading[arrival.ticket], **arrival.frame);
          frames[arrival.ticket] = std::move(*arrival.frame);
          loading.erase(arrival.ticket);
        }
        arrivals.clear();
        while (!frames.empty() && (transport->wantedGpuBytes() != 0 || frames.size() > 5)) {
          transport->retire(std::move(frames.begin()->second));
          frames.erase(frames.begin());
        }
        for (auto it = frames.begin(); it != frames.end();) {
          if (it->second->empty() || !transport->mustLeave(*it->second)) {
            ++it;
            continue;
          }
          transport->retire(std::move(it->second));
          it = frames.erase(it);
        }
        if (random() % 50 == 0) transport->setBudget(most / (1 + random() % 2), config.cpuBudget);
        EXPECT_LE(transport->stats().gpuAllocated, most);
        EXPECT_LE(transport->stats().cpuBytes, config.cpuBudget);
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 500));
      }
      EXPECT_GT(arrived, 20);
      EXPECT_LE(transport->stats().gpuPeak, most);
      EXPECT_LE(transport->stats().cpuPeak, config.cpuBudget);
      EXPECT_LE(counter.stats().peak, config.cpuBudget);
      frames.clear();
    }
    EXPECT_EQ(counter.stats().bytes, 0u);
    EXPECT_EQ(counter.stats().wrong, 0u);
    EXPECT_EQ(settledBytes(), before);
  }
}

TEST_F(StreamTransport, ASmallerBudgetIsReachedOnceFramesThatMustLeaveHaveLeft) {
  const auto pack = openStream(streamPack(8, 300));
  const auto renderer = makeRenderer();
  StreamConfig config = smallConfig();
  config.gpuBudget = 128u << 20;  // blocks of 8 MiB
  config.framesInFlight = 1;
  const auto transport = makeTransport(*renderer, config);
  auto frames = loadAll(*transport, pack, firstFrames(8));
  transport->setBudget(1u << 20, config.cpuBudget);
  waitFor([&] {
    for (auto& [number, frame] : frames) {
      if (frame != nullptr && transport->mustLeave(*frame)) transport->retire(std::move(frame));
    }
    transport->update();
    return transport->stats().gpuAllocated <= 1u << 20;
  });
}

}  // namespace
}  // namespace billow::tests
