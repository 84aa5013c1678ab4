// What fails in billow.h, at once and later, and whose a host's file then is.
#include <atomic>
#include <cstring>
#include <mutex>

#include "capi_fixture.h"

namespace billow::tests {
namespace {

using CapiErrors = CapiPlay;

TEST_F(CapiErrors, AnUnsoundPackIsAnError) {
  Context context = makeContext();
  EXPECT_EQ(context.open("/no/such/pack.blw").error().code, BILLOW_ERROR_PACK);
  auto bytes = smokePack();
  bytes[bytes.size() / 2] ^= std::byte{0xff};
  bytes[8] ^= std::byte{0xff};
  const PackFile broken(bytes);
  const Error error = context.open(broken.path().c_str()).error();
  EXPECT_EQ(error.code, BILLOW_ERROR_PACK);
  EXPECT_GT(std::strlen(error.message), 10u);
  OpenInfo both;
  EXPECT_EQ(context.open(both).error().code, BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiErrors, WhatFailsLaterIsToldOnce) {
  Context context = makeContext();
  OpenInfo info;
  info.path = "/no/such/pack.blw";
  const Pack missing = valueOf(context.openLater(info), "pack");
  Error error;
  BillowResult taken = BILLOW_NOT_READY;
  for (int i = 0; i < 2000 && taken == BILLOW_NOT_READY; ++i) {
    ASSERT_TRUE(context.update({}));
    taken = billowTakeError(context.get(), &error);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(taken, BILLOW_OK);
  EXPECT_EQ(error.code, BILLOW_ERROR_PACK);
  EXPECT_EQ(error.pack.id, missing.id().id);
  EXPECT_EQ(error.volume, BILLOW_NONE);
  EXPECT_EQ(error.frame, BILLOW_NONE);
  EXPECT_EQ(error.page, BILLOW_NONE);
  EXPECT_EQ(missing.state(), BILLOW_PACK_FAILED);
  EXPECT_EQ(billowTakeError(context.get(), &error), BILLOW_NOT_READY);
  EXPECT_EQ(error.code, BILLOW_NOT_READY);
}

// An instance for which the pack turns out to have no volume.
TEST_F(CapiErrors, AnErrorOfAnInstanceThatWaitedNamesItsVolume) {
  Context context = makeContext();
  OpenInfo info;
  const std::string path = file_.path();
  info.path = path.c_str();
  const Pack pack = valueOf(context.openLater(info), "pack");
  InstanceInfo wanted;
  wanted.pack = pack.id();
  wanted.volume = 7;
  const Instance instance = valueOf(context.addInstance(wanted), "instance");
  std::optional<Error> error;
  for (int i = 0; i < 2000 && !error; ++i) {
    ASSERT_TRUE(context.update({}));
    error = context.takeError();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, BILLOW_ERROR_ARGUMENT);
  EXPECT_EQ(error->pack.id, pack.id().id);
  EXPECT_EQ(error->volume, 7u);
}

// A device on which a call fails as on one that is lost.
PFN_vkGetInstanceProcAddr soundInstance = nullptr;
PFN_vkGetDeviceProcAddr soundDevice = nullptr;

VKAPI_ATTR VkResult VKAPI_CALL lostSemaphore(VkDevice, const VkSemaphoreCreateInfo*, const VkAllocationCallbacks*,
                                             VkSemaphore*) {
  return VK_ERROR_DEVICE_LOST;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL lostDevice(VkDevice device, const char* name) {
  if (std::strcmp(name, "vkCreateSemaphore") == 0) return reinterpret_cast<PFN_vkVoidFunction>(lostSemaphore);
  return soundDevice(device, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL lostInstance(VkInstance instance, const char* name) {
  const PFN_vkVoidFunction found = soundInstance(instance, name);
  if (std::strcmp(name, "vkGetDeviceProcAddr") != 0) return found;
  soundDevice = reinterpret_cast<PFN_vkGetDeviceProcAddr>(found);
  return reinterpret_cast<PFN_vkVoidFunction>(lostDevice);
}

TEST_F(CapiErrors, ALostDeviceHasACodeOfItsOwn) {
  Device lost = device();
  soundInstance = lost.getInstanceProcAddr;
  lost.getInstanceProcAddr = lostInstance;
  EXPECT_EQ(Context::create(lost, config()).error().code, BILLOW_ERROR_DEVICE_LOST);
  EXPECT_STREQ(billowResultName(BILLOW_ERROR_DEVICE_LOST), "BILLOW_ERROR_DEVICE_LOST");
}

TEST_F(CapiErrors, BudgetsHaveAFloor) {
  Context context = makeContext();
  EXPECT_EQ(context.setBudget(0, 32u << 20).error().code, BILLOW_ERROR_ARGUMENT);
  EXPECT_EQ(context.setBudget(16u << 20, config().stagingBytes - 1).error().code, BILLOW_ERROR_ARGUMENT);
  EXPECT_TRUE(context.setBudget(8u << 20, 16u << 20));
}

// Reads on a thread of its own, and counts.
struct HostReads {
  std::vector<std::byte> bytes = smokePack();
  std::atomic<int> reads = 0, closes = 0;
  std::mutex mutex;
  std::vector<std::thread> threads;

  static void read(void* user, std::uint64_t offset, void* into, std::size_t count, BillowRead done) {
    auto& self = *static_cast<HostReads*>(user);
    ++self.reads;
    const std::lock_guard lock(self.mutex);
    self.threads.emplace_back([&self, offset, into, count, done] {
      std::memcpy(into, self.bytes.data() + offset, count);
      billowReadDone(done, 1);
    });
  }
  static void close(void* user) { ++static_cast<HostReads*>(user)->closes; }
  ~HostReads() {
    for (std::thread& thread : threads) thread.join();
  }
};

TEST_F(CapiErrors, AHostsFileIsReadThroughItsCallback) {
  HostReads host;
  {
    Context context = makeContext();
    File file;
    file.bytes = host.bytes.size();
    file.read = HostReads::read;
    file.close = HostReads::close;
    file.user = &host;
    OpenInfo info;
    info.file = &file;
    const Pack pack = valueOf(context.open(info), "pack");
    const Instance instance = standing(context, pack);
    settle(context, instance);
    EXPECT_GT(host.reads, 1);
    EXPECT_EQ(host.closes, 0);
  }
  EXPECT_EQ(host.closes, 1);
}

// It stays the host's where the open fails at once, and is closed where it fails later.
TEST_F(CapiErrors, AHostsFileIsClosedIfItWasTaken) {
  for (const bool later : {false, true}) {
    HostReads host;
    host.bytes[8] ^= std::byte{0xff};
    File file;
    file.bytes = host.bytes.size();
    file.read = HostReads::read;
    file.close = HostReads::close;
    file.user = &host;
    OpenInfo info;
    info.file = &file;
    {
      Context context = makeContext();
      std::optional<Pack> pack;
      if (later) pack = valueOf(context.openLater(info), "pack");
      if (!later) {
        EXPECT_EQ(context.open(info).error().code, BILLOW_ERROR_PACK);
      }
      for (int i = 0; i < 2000 && pack && pack->state() == BILLOW_PACK_OPENING; ++i) {
        ASSERT_TRUE(context.update({}));
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    EXPECT_GT(host.reads, 0);
    EXPECT_EQ(host.closes, later ? 1 : 0);
  }
}

}  // namespace
}  // namespace billow::tests
