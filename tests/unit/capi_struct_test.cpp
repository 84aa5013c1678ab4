// Structs of billow.h from hosts of other versions.
#include <cstring>
#include <limits>

#include "capi_fixture.h"

namespace billow::tests {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A field that is appended must not fall into what was padding before.
#define BILLOW_NO_TAIL(Type, last) \
  static_assert(offsetof(Type, last) + sizeof(Type::last) == sizeof(Type), #Type " ends in padding")
BILLOW_NO_TAIL(BillowAllocator, user);
BILLOW_NO_TAIL(BillowBackground, opacity);
BILLOW_NO_TAIL(BillowCompositeInfo, reserved);
BILLOW_NO_TAIL(BillowConfig, log);
BILLOW_NO_TAIL(BillowDevice, allocationCallbacks);
BILLOW_NO_TAIL(BillowDrawInfo, timestamps);
BILLOW_NO_TAIL(BillowEffect, objectToWorld);
BILLOW_NO_TAIL(BillowEffectInfo, name);
BILLOW_NO_TAIL(BillowError, message);
BILLOW_NO_TAIL(BillowFile, user);
BILLOW_NO_TAIL(BillowInstanceInfo, look);
BILLOW_NO_TAIL(BillowInstanceState, time);
BILLOW_NO_TAIL(BillowJobs, user);
BILLOW_NO_TAIL(BillowLog, user);
BILLOW_NO_TAIL(BillowLook, smokeInFire);
BILLOW_NO_TAIL(BillowOpenInfo, file);
BILLOW_NO_TAIL(BillowPackInfo, reserved);
BILLOW_NO_TAIL(BillowPlayback, speed);
BILLOW_NO_TAIL(BillowQuality, shadowSteps);
BILLOW_NO_TAIL(BillowScattering, bounces);
BILLOW_NO_TAIL(BillowShadowMap, reserved);
BILLOW_NO_TAIL(BillowSpaceInfo, packs);
BILLOW_NO_TAIL(BillowSpaceShadow, toTexel);
BILLOW_NO_TAIL(BillowSpaceStats, bytes);
BILLOW_NO_TAIL(BillowStats, missingBricks);
BILLOW_NO_TAIL(BillowSun, irradiance);
BILLOW_NO_TAIL(BillowUpdateInfo, view);
BILLOW_NO_TAIL(BillowView, reserved);
BILLOW_NO_TAIL(BillowVolumeInfo, name);
BILLOW_NO_TAIL(BillowWait, value);

using CapiStruct = CapiTest;

TEST_F(CapiStruct, DefaultsAreTheCores) {
  const runtime::StreamConfig stream;
  const Config config;
  EXPECT_EQ(config.gpuBudget, stream.gpuBudget);
  EXPECT_EQ(config.cpuBudget, stream.cpuBudget);
  EXPECT_EQ(config.stagingBytes, stream.stagingBytes);
  EXPECT_EQ(config.threads, stream.threads);
  EXPECT_EQ(config.readThreads, stream.readThreads);
  EXPECT_EQ(config.framesInFlight, stream.framesInFlight);
  EXPECT_EQ(config.prefetchSeconds, stream.prefetchSeconds);
  EXPECT_EQ(static_cast<int>(config.verify), static_cast<int>(stream.verify));
  EXPECT_EQ(static_cast<int>(config.submission), static_cast<int>(stream.submission));
  const runtime::MetavoxelConfig metavoxels;
  const SpaceInfo space;
  EXPECT_EQ(space.edge, metavoxels.edge);
  EXPECT_EQ(space.metavoxels, metavoxels.metavoxels);
  EXPECT_EQ(space.memoryBudget, metavoxels.memoryBudget);
  EXPECT_EQ(space.maxMetavoxels, metavoxels.maxMetavoxels);
  EXPECT_EQ(space.maxParticles, metavoxels.maxParticles);
  EXPECT_EQ(space.maxListEntries, metavoxels.maxListEntries);
  EXPECT_EQ(space.maxVolumes, metavoxels.maxVolumes);
  const runtime::Look look;
  const Look c;
  EXPECT_EQ(c.extinctionScale, look.extinctionScale);
  EXPECT_EQ(c.albedo[2], look.albedo[2]);
  EXPECT_EQ(c.anisotropy, look.anisotropy);
  EXPECT_EQ(c.ambient[1], look.ambient[1]);
  EXPECT_EQ(c.referenceKelvin, look.referenceKelvin);
  EXPECT_EQ(c.smokeInFire, look.smokeInFire);
  const runtime::Quality quality;
  const Quality q;
  EXPECT_EQ(q.step, quality.step);
  EXPECT_EQ(q.shadowStep, quality.shadowStep);
  EXPECT_EQ(q.shadowSteps, quality.shadowSteps);
  EXPECT_EQ(static_cast<int>(Playback().loop), static_cast<int>(runtime::Playback().loop));
  EXPECT_EQ(static_cast<int>(Playback().interpolation), static_cast<int>(runtime::Playback().interpolation));
}

// A field out of its range is found in a struct that has it, and not in an older one that ends before it.
TEST_F(CapiStruct, AnOlderStructTakesDefaults) {
  Context context = makeContext();
  UpdateInfo update;
  update.seconds = kNan;
  EXPECT_EQ(context.update(update).error().code, BILLOW_ERROR_ARGUMENT);
  update.size = offsetof(BillowUpdateInfo, seconds);
  EXPECT_TRUE(context.update(update));
  Config config = CapiTest::config();
  config.directDraws = 0;
  EXPECT_EQ(Context::create(device(), config).error().code, BILLOW_ERROR_ARGUMENT);
  config.size = offsetof(BillowConfig, directDraws);
  EXPECT_TRUE(Context::create(device(), config));
  SpaceInfo space = smallSpace();
  space.packCount = 1;  // without packs
  EXPECT_EQ(context.createSpace(space).error().code, BILLOW_ERROR_ARGUMENT);
  space.size = offsetof(BillowSpaceInfo, packCount);
  EXPECT_TRUE(context.createSpace(space));
}

TEST_F(CapiStruct, EverySizeOfAnOlderStructIsTaken) {
  Context context = makeContext();
  View view;
  UpdateInfo update;
  update.view = &view;
  for (std::uint32_t size = 4; size <= sizeof(BillowUpdateInfo); size += 4) {
    update.size = size;
    EXPECT_TRUE(context.update(update)) << size;
  }
  for (std::uint32_t size = 4; size <= sizeof(BillowView); size += 4) {
    view.size = size;
    EXPECT_TRUE(context.update(update)) << size;
  }
}

TEST_F(CapiStruct, WithoutASizeItIsRefused) {
  Context context = makeContext();
  UpdateInfo update;
  for (const std::uint32_t size : {0u, 3u, 0xccccccccu}) {
    update.size = size;
    const Error error = context.update(update).error();
    EXPECT_EQ(error.code, BILLOW_ERROR_ARGUMENT);
    EXPECT_NE(std::strstr(error.message, "BILLOW_UPDATE_INFO_DEFAULT"), nullptr) << error.message;
  }
  EXPECT_EQ(billowUpdate(context.get(), nullptr, nullptr), BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiStruct, ANewerStructIsTakenWhereItSaysNothingNew) {
  Context context = makeContext();
  struct {
    BillowUpdateInfo info = BILLOW_UPDATE_INFO_DEFAULT;
    std::uint32_t more[4] = {};
  } newer;
  newer.info.size = sizeof(newer);
  Error error;
  EXPECT_EQ(billowUpdate(context.get(), &newer.info, &error), BILLOW_OK) << error.message;
  newer.more[3] = 1;
  EXPECT_EQ(billowUpdate(context.get(), &newer.info, &error), BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiStruct, NoMoreIsFilledThanAnOlderStructHas) {
  Context context = makeContext();
  ASSERT_TRUE(context.update({}));
  BillowStats stats;
  std::memset(&stats, 0x5a, sizeof(stats));
  stats.size = offsetof(BillowStats, bytesRead);
  billowStats(context.get(), &stats);
  EXPECT_EQ(stats.updates, 1u);
  EXPECT_EQ(stats.size, offsetof(BillowStats, bytesRead));
  EXPECT_EQ(stats.bytesRead, 0x5a5a5a5a5a5a5a5au);
}

TEST_F(CapiStruct, AMessageIsCutWhereThereIsNoRoom) {
  BillowError error;
  std::memset(&error, 0x5a, sizeof(error));
  error.size = offsetof(BillowError, message) + 16;
  EXPECT_EQ(billowCreate(nullptr, nullptr, nullptr, &error), BILLOW_ERROR_ARGUMENT);
  EXPECT_EQ(std::strlen(error.message), 15u);
  EXPECT_EQ(error.message[16], 0x5a);
  EXPECT_EQ(error.code, BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiStruct, WhatTheDeviceLacksIsNamed) {
  VkPhysicalDeviceFeatures2 core{};
  core.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  VkPhysicalDeviceVulkan12Features v12{};
  v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
  VkPhysicalDeviceSynchronization2Features sync{};
  sync.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES;
  core.pNext = &v12;
  v12.pNext = &sync;
  v12.timelineSemaphore = VK_TRUE;
  Device lacking = device();
  lacking.enabledFeatures = &core;
  const Error error = Context::create(lacking, config()).error();
  EXPECT_EQ(error.code, BILLOW_ERROR_UNSUPPORTED);
  EXPECT_NE(std::strstr(error.message, "bufferDeviceAddress"), nullptr) << error.message;
  EXPECT_NE(std::strstr(error.message, "synchronization2"), nullptr) << error.message;
  EXPECT_EQ(std::strstr(error.message, "timelineSemaphore"), nullptr) << error.message;
  v12.bufferDeviceAddress = sync.synchronization2 = VK_TRUE;
  EXPECT_TRUE(Context::create(lacking, config()));
}

}  // namespace
}  // namespace billow::tests
