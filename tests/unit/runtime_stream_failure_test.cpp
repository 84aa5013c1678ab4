// Slow, failing and reordering hosts, damaged pages, a device that refuses, and ends in the middle of it all: every
// load ends once, by arriving or by an error that says why.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <set>
#include <string_view>

#include "stream_fixture.h"

namespace billow::tests {
namespace {

using runtime::Arrival;
using runtime::ErrorCode;
using runtime::StreamConfig;
using runtime::Submission;

class StreamFailure : public StreamTest {
 protected:
  // With all of these loads' ends, by ticket.
  static std::map<std::uint64_t, Arrival> loadEach(runtime::Transport& transport,
                                                   const std::vector<runtime::LoadOrder>& orders) {
    std::map<std::uint64_t, Arrival> ends;
    std::vector<Arrival> arrivals;
    std::size_t next = 0;
    waitFor([&] {
      while (next < orders.size() && transport.submit(orders[next])) ++next;
      transport.update();
      transport.take(arrivals);
      for (Arrival& arrival : arrivals) {
        EXPECT_EQ(ends.count(arrival.ticket), 0u) << "it ended twice";
        ends.emplace(arrival.ticket, std::move(arrival));
      }
      arrivals.clear();
      return ends.size() == orders.size();
    });
    return ends;
  }
};

TEST_F(StreamFailure, HostsMayAnswerAtOnceOrLateAndInAnyOrder) {
  const auto bytes = streamPack(6, 400, 2);
  const auto renderer = makeRenderer();
  for (const bool late : {false, true}) {
    const auto source = std::make_shared<TestSource>(bytes);
    std::optional<SlowDisk> disk;
    if (late) disk.emplace(*source, 5);
    StreamConfig config = smallConfig();
    config.readThreads = 0;
    const auto pack = openStream(bytes, source);
    const auto transport = makeTransport(*renderer, config);
    auto frames = loadAll(*transport, pack, {0, 1, 2, 3, 4, 5});
    for (const auto& [number, frame] : frames) {
      expectSame(*renderer, *pack, static_cast<std::uint32_t>(number), *frame);
    }
    EXPECT_GT(source->reads, 4);
    EXPECT_EQ(source->outside, 0);
    EXPECT_GE(transport->stats().bytesRead, pack->pack.pages()[0].storedSize);
  }
}

// One page of the disk cannot be read: exactly the frames that need it fail, and they name it.
TEST_F(StreamFailure, APageThatCannotBeReadIsNamed) {
  const auto bytes = streamPack(6, 900);
  const auto source = std::make_shared<TestSource>(bytes);
  const auto pack = openStream(bytes, source);
  ASSERT_GT(pack->pack.pages().size(), 6u);
  const auto renderer = makeRenderer();
  const auto transport = makeTransport(*renderer, smallConfig());
  for (std::uint32_t bad = 0; bad < pack->pack.pages().size(); ++bad) {
    const std::uint64_t at = *format::placeOfPage(pack->pack, bad).offset;
    source->answer = [&](const TestSource::Read& read) {
      if (at >= read.offset && at < read.offset + read.into.size()) return read.done.call(read.done.context, false);
      source->succeed(read);
    };
    std::vector<runtime::LoadOrder> orders;
    for (std::uint32_t frame = 0; frame < 6; ++frame) orders.push_back(orderOf(pack, frame, frame));
    int failed = 0;
    for (auto& [ticket, arrival] : loadEach(*transport, orders)) {
      const auto& volume = pack->pack.volumes()[0];
      bool needs = false;
      for (std::uint32_t grid = 0; grid < 2; ++grid) {
        for (const std::uint32_t page :
             pack->pack.pagesOf(pack->pack.gridFrame(volume, static_cast<std::uint32_t>(ticket), grid))) {
          needs = needs || page == bad;
        }
      }
      ASSERT_EQ(arrival.frame.has_value(), !needs) << "frame " << ticket << " page " << bad;
      if (!needs) {
        transport->retire(std::move(*arrival.frame));
        continue;
      }
      ++failed;
      EXPECT_EQ(arrival.frame.error().code, ErrorCode::pack);
      EXPECT_EQ(arrival.page, bad) << arrival.frame.error().message;
    }
    EXPECT_GE(failed, 1);
    for (int i = 0; i < 4; ++i) transport->update();
  }
}

TEST_F(StreamFailure, ADamagedPageIsNamedAndWhatFitsNowhereIsRefused) {
  auto bytes = streamPack(2, 400);
  const auto whole = openStream(bytes);
  const std::uint32_t page = whole->pack.pagesOf(whole->pack.gridFrame(whole->pack.volumes()[0], 1, 0))[0];
  bytes[*format::placeOfPage(whole->pack, page).offset + 30] ^= std::byte{4};
  const auto pack = openStream(bytes);
  const auto renderer = makeRenderer();
  const auto transport = makeTransport(*renderer, smallConfig());
  const auto arrival = loadOne(*transport, orderOf(pack, 1, 1));
  ASSERT_FALSE(arrival.frame);
  EXPECT_EQ(arrival.frame.error().code, ErrorCode::pack);
  EXPECT_EQ(arrival.page, page) << arrival.frame.error().message;
  auto order = orderOf(pack, 0, 2);
  order.frame = 2;
  const auto outside = loadOne(*transport, order);
  ASSERT_FALSE(outside.frame);
  EXPECT_EQ(outside.frame.error().code, ErrorCode::argument);
  EXPECT_EQ(transport->cost(order).gpu, 0u);
}

// Ended at a random moment, with reads in flight, on every kind of threads. What is checked is that it ends, that the
// host's reads were all answered by then, and that nothing reads freed memory (under the sanitizers).
TEST_F(StreamFailure, EndsAtAnyMoment) {
  const auto bytes = streamPack(8, 300);
  const auto renderer = makeRenderer();
  HostJobs host(2);
  for (std::uint32_t seed = 0; seed < 24; ++seed) {
    std::mt19937 random(seed);
    StreamConfig config = smallConfig();
    config.stagingBytes = 64u << 10;
    if (seed % 3 == 0) config.submission = Submission::own;
    if (seed % 3 == 1) {
      config.threads = config.readThreads = 0;
      config.jobs = host.callbacks();
    }
    const auto source = seed % 2 == 0 ? std::make_shared<TestSource>(bytes) : nullptr;
    std::optional<SlowDisk> disk;
    if (source != nullptr) disk.emplace(*source, seed);
    const auto pack = openStream(bytes, source);
    auto transport = makeTransport(*renderer, config);
    std::vector<Arrival> arrivals;
    const std::uint32_t steps = static_cast<std::uint32_t>(random() % 30);
    for (std::uint32_t i = 0; i < 8; ++i) (void)transport->submit(orderOf(pack, i, i));
    for (std::uint32_t step = 0; step < steps; ++step) {
      transport->update();
      if (random() % 3 == 0) transport->cancel(random() % 8);
      transport->take(arrivals);
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 400));
    }
    arrivals.clear();
    transport.reset();
    gpu().waitIdle();
  }
}

// Calls that pass through on their way to the device.
struct Spied {
  PFN_vkGetInstanceProcAddr instanceProc = nullptr;
  PFN_vkGetDeviceProcAddr deviceProc = nullptr;
  PFN_vkQueueSubmit2 submit = nullptr;
  PFN_vkAllocateMemory allocate = nullptr;
  PFN_vkSetDebugUtilsObjectNameEXT name = nullptr;
  PFN_vkCmdBeginDebugUtilsLabelEXT beginLabel = nullptr;
  PFN_vkCmdEndDebugUtilsLabelEXT endLabel = nullptr;
  std::atomic<int> submitsLeft = 1 << 30;
  std::atomic<std::uint64_t> largestAllocation = ~std::uint64_t{0};  // larger ones are refused
  std::atomic<int> labels = 0, open = 0;
  std::mutex mutex;
  std::set<std::string> names;
};
Spied* spied = nullptr;

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo2* infos, VkFence fence) {
  return --spied->submitsLeft < 0 ? VK_ERROR_DEVICE_LOST : spied->submit(queue, count, infos, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkMemoryAllocateInfo* info,
                                        const VkAllocationCallbacks* callbacks, VkDeviceMemory* memory) {
  if (info->allocationSize > spied->largestAllocation) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  return spied->allocate(device, info, callbacks, memory);
}

VKAPI_ATTR VkResult VKAPI_CALL setName(VkDevice device, const VkDebugUtilsObjectNameInfoEXT* info) {
  {
    const std::lock_guard lock(spied->mutex);
    spied->names.insert(info->pObjectName);
  }
  return spied->name(device, info);
}

VKAPI_ATTR void VKAPI_CALL beginLabel(VkCommandBuffer commands, const VkDebugUtilsLabelEXT* label) {
  EXPECT_TRUE(std::string_view(label->pLabelName).starts_with("billow"));
  ++spied->labels;
  ++spied->open;
  spied->beginLabel(commands, label);
}

VKAPI_ATTR void VKAPI_CALL endLabel(VkCommandBuffer commands) {
  --spied->open;
  spied->endLabel(commands);
}

template <class Function>
PFN_vkVoidFunction swap(PFN_vkVoidFunction real, Function& kept, Function own) {
  kept = reinterpret_cast<Function>(real);
  return real == nullptr ? nullptr : reinterpret_cast<PFN_vkVoidFunction>(own);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL deviceProc(VkDevice device, const char* name) {
  const std::string_view wanted = name;
  const PFN_vkVoidFunction real = spied->deviceProc(device, name);
  if (wanted == "vkQueueSubmit2") return swap(real, spied->submit, &submit);
  if (wanted == "vkAllocateMemory") return swap(real, spied->allocate, &allocate);
  return real;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instanceProc(VkInstance instance, const char* name) {
  const std::string_view wanted = name;
  const PFN_vkVoidFunction real = spied->instanceProc(instance, name);
  if (wanted == "vkGetDeviceProcAddr") return swap(real, spied->deviceProc, &deviceProc);
  if (wanted == "vkSetDebugUtilsObjectNameEXT") return swap(real, spied->name, &setName);
  if (wanted == "vkCmdBeginDebugUtilsLabelEXT") return swap(real, spied->beginLabel, &beginLabel);
  if (wanted == "vkCmdEndDebugUtilsLabelEXT") return swap(real, spied->endLabel, &endLabel);
  return real;
}

class StreamDevice : public StreamTest {
 protected:
  runtime::HostDevice spiedHost() {
    runtime::HostDevice host = gpu().host();
    spied = &spy_;
    spy_.instanceProc = host.getInstanceProcAddr;
    host.getInstanceProcAddr = &instanceProc;
    return host;
  }
  Spied spy_;
};

TEST_F(StreamDevice, ALostDeviceEndsEveryLoadOnce) {
  const auto pack = openStream(streamPack(8, 300));
  for (const Submission submission : {Submission::inUpdate, Submission::own}) {
    for (const int after : {0, 1, 3}) {
      const auto renderer = valueOf(runtime::Renderer::create(spiedHost(), {}), "the renderer");
      StreamConfig config = smallConfig();
      config.stagingBytes = 64u << 10;
      config.submission = submission;
      auto transport = makeTransport(*renderer, config);
      spy_.submitsLeft = after;
      std::set<std::uint64_t> ended;
      std::vector<Arrival> arrivals;
      int failed = 0;
      std::uint64_t next = 0;
      waitFor([&] {
        while (next < 8 && transport->submit(orderOf(pack, static_cast<std::uint32_t>(next), next))) ++next;
        transport->update();
        transport->take(arrivals);
        for (Arrival& arrival : arrivals) {
          EXPECT_TRUE(ended.insert(arrival.ticket).second);
          if (arrival.frame) continue;
          ++failed;
          EXPECT_TRUE(isVulkan(arrival.frame.error().code)) << arrival.frame.error().message;
        }
        arrivals.clear();
        return ended.size() == 8;
      });
      EXPECT_GE(failed, 1);
      arrivals.clear();
      // Later ones end at once.
      const auto late = loadOne(*transport, orderOf(pack, 0, 99));
      ASSERT_FALSE(late.frame);
      EXPECT_TRUE(isVulkan(late.frame.error().code));
      transport.reset();
      gpu().waitIdle();
    }
  }
}

TEST_F(StreamDevice, WithoutMemoryForMoreBlocksLoadsWaitForThoseThereAre) {
  const auto pack = openStream(streamPack(4, 300));
  const auto renderer = valueOf(runtime::Renderer::create(spiedHost(), {}), "the renderer");
  StreamConfig config = smallConfig();
  config.framesInFlight = 1;
  const std::uint64_t one = makeTransport(*renderer, config)->cost(orderOf(pack, 0, 1)).gpu;
  config.gpuBudget = 64u << 20;  // blocks of 4 MiB
  const auto transport = makeTransport(*renderer, config);
  spy_.largestAllocation = 0;
  const auto none = loadOne(*transport, orderOf(pack, 0, 1));
  ASSERT_FALSE(none.frame);
  EXPECT_EQ(none.frame.error().code, ErrorCode::memory);
  spy_.largestAllocation = ~std::uint64_t{0};
  Frames frames;
  std::uint64_t ticket = 10;
  const auto fill = [&] { frames[ticket] = std::move(*loadOne(*transport, orderOf(pack, ticket % 4, ticket)).frame); };
  fill();
  spy_.largestAllocation = 0;
  for (std::uint64_t i = 1; i < (4u << 20) / one; ++i, ++ticket) fill();
  ASSERT_TRUE(transport->submit(orderOf(pack, 0, 500)));
  ASSERT_TRUE(transport->submit(orderOf(pack, 0, 501)));
  waitFor([&] {
    transport->update();
    return transport->wantedGpuBytes() != 0;
  });
  for (auto& [number, frame] : frames) transport->retire(std::move(frame));
  std::vector<Arrival> arrivals;
  waitFor([&] {
    transport->update();
    transport->take(arrivals);
    return arrivals.size() == 2;
  });
  for (const Arrival& arrival : arrivals) EXPECT_TRUE(arrival.frame);
}

TEST_F(StreamDevice, ObjectsHaveNamesAndCommandsLabels) {
  const auto pack = openStream(streamPack(2, 300));
  const auto renderer =
      valueOf(runtime::Renderer::create(spiedHost(), {.blocks = runtime::BlockUse::native}), "the renderer");
  const auto transport = makeTransport(*renderer, smallConfig());
  auto frames = loadAll(*transport, pack, {0, 1});
  EXPECT_GT(spy_.labels, 1);
  const int before = spy_.labels;
  ASSERT_TRUE(gpu().render(*renderer, {.frame = frames[0].get(), .width = 4, .height = 4}));
  EXPECT_GT(spy_.labels, before);
  EXPECT_EQ(spy_.open, 0) << "a label was not closed";
  const auto metavoxels = runtime::Metavoxels::create(
      *renderer, {.edge = 8, .metavoxels = 4, .memoryBudget = 64u << 20, .maxMetavoxels = 64});
  ASSERT_TRUE(metavoxels) << metavoxels.error().message;
  for (const char* name :
       {"billow frames", "billow frame atlas", "billow staging ring", "billow uploads", "billow march",
        "billow march parameters", "billow metavoxel pool", "billow metavoxel arrays", "billow shadow"}) {
    EXPECT_EQ(spy_.names.count(name), 1u) << name;
  }
}

// What the host's callbacks gave, by place.
struct HostMemory {
  std::mutex mutex;
  std::map<void*, std::size_t> live;
  std::uint64_t calls = 0;

  VkAllocationCallbacks callbacks() {
    VkAllocationCallbacks made{};
    made.pUserData = this;
    made.pfnAllocation = [](void* user, std::size_t size, std::size_t alignment, VkSystemAllocationScope) -> void* {
      return static_cast<HostMemory*>(user)->allocate(size, alignment);
    };
    made.pfnFree = [](void* user, void* memory) { static_cast<HostMemory*>(user)->free(memory); };
    made.pfnReallocation = [](void* user, void* old, std::size_t size, std::size_t alignment,
                              VkSystemAllocationScope) -> void* {
      auto& self = *static_cast<HostMemory*>(user);
      void* const memory = size != 0 ? self.allocate(size, alignment) : nullptr;
      if (old != nullptr && memory != nullptr) std::memcpy(memory, old, std::min(size, self.sizeOf(old)));
      self.free(old);
      return memory;
    };
    return made;
  }
  void* allocate(std::size_t size, std::size_t alignment) {
    void* const memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    const std::lock_guard lock(mutex);
    ++calls;
    live[memory] = size;
    return memory;
  }
  std::size_t sizeOf(void* memory) {
    const std::lock_guard lock(mutex);
    return live[memory];
  }
  void free(void* memory) {
    if (memory == nullptr) return;
    {
      const std::lock_guard lock(mutex);
      EXPECT_EQ(live.erase(memory), 1u) << "it is not the callbacks'";
    }
    std::free(memory);
  }
};

TEST_F(StreamDevice, TheHostsCallbacksAllocateAndFreeEverything) {
  const auto pack = openStream(streamPack(3, 300));
  HostMemory memory;
  const VkAllocationCallbacks callbacks = memory.callbacks();
  runtime::HostDevice host = gpu().host();
  host.allocationCallbacks = &callbacks;
  {
    const auto renderer =
        valueOf(runtime::Renderer::create(host, {.blocks = runtime::BlockUse::native}), "the renderer");
    const auto transport = makeTransport(*renderer, smallConfig());
    auto frames = loadAll(*transport, pack, {0, 1, 2});
    expectSame(*renderer, *pack, 1, *frames[1]);
  }
  EXPECT_GT(memory.calls, 0u);
  EXPECT_TRUE(memory.live.empty());
}

TEST_F(StreamDevice, EachFeatureThatIsNotEnabledIsNamed) {
  runtime::HostDevice host = gpu().host();
  host.features = {.bufferDeviceAddress = false, .timelineSemaphore = true, .synchronization2 = false};
  const auto renderer = runtime::Renderer::create(host, {});
  ASSERT_FALSE(renderer);
  EXPECT_EQ(renderer.error().code, ErrorCode::unsupported);
  const std::string& message = renderer.error().message;
  EXPECT_NE(message.find("bufferDeviceAddress"), std::string::npos) << message;
  EXPECT_NE(message.find("synchronization2"), std::string::npos) << message;
  EXPECT_EQ(message.find("timelineSemaphore"), std::string::npos) << message;
}

}  // namespace
}  // namespace billow::tests
