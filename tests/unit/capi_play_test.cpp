// Open, update, draw through billow.h, against what the core draws of the same frame.
#include <atomic>
#include <cstring>

#include "billow/runtime/look.h"
#include "capi_fixture.h"

namespace billow::tests {
namespace {

TEST_F(CapiPlay, APackSaysWhatIsInIt) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  EXPECT_EQ(pack.state(), BILLOW_PACK_READY);
  EXPECT_EQ(valueOf(pack.info(), "info").volumes, 1u);
  const VolumeInfo volume = valueOf(pack.volume(0), "volume");
  EXPECT_STREQ(volume.name, "v");
  EXPECT_EQ(volume.frames, 4u);
  EXPECT_NEAR(volume.seconds, 4 / 24.0, 1e-9);
  EXPECT_NEAR(volume.voxelSize, 0.1, 1e-9);
  EXPECT_NEAR(volume.max[0] - volume.min[0], 16 * 8 * 0.1, 0.2);
  EXPECT_EQ(pack.volume(1).error().code, BILLOW_ERROR_ARGUMENT);
  EXPECT_EQ(pack.effect(0).error().code, BILLOW_ERROR_ARGUMENT);
  const auto open = valueOf(format::Pack::openFile(file_.path()), "pack");
  const runtime::Look fitted =
      valueOf(runtime::suggestLook(open, open.volumes()[0], runtime::chooseGrids(open, open.volumes()[0])), "look");
  EXPECT_EQ(valueOf(pack.suggestLook(0), "look").extinctionScale, fitted.extinctionScale);
}

TEST_F(CapiPlay, ADirectDrawIsTheRenderers) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  const Instance instance = standing(context, pack);
  settle(context, instance);
  const View view = viewOf(valueOf(pack.volume(0), "volume"));
  const Picture picture;
  const Error error = draw(context, drawInfo(picture, view));
  ASSERT_EQ(error.code, BILLOW_OK) << error.message;

  const auto open = valueOf(format::Pack::openFile(file_.path()), "pack");
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, open);
  const Sun sun;
  runtime::DrawInfo expected{.frame = frame.get(), .width = kSide, .height = kSide};
  expected.view = {.tanHalfHeight = view.tanHalfHeight};
  std::copy_n(view.eye, 3, expected.view.eye.begin());
  std::copy_n(view.right, 3, expected.view.right.begin());
  std::copy_n(view.up, 3, expected.view.up.begin());
  std::copy_n(view.forward, 3, expected.view.forward.begin());
  std::copy_n(sun.direction, 3, expected.sun.direction.begin());
  std::copy_n(sun.irradiance, 3, expected.sun.irradiance.begin());
  expected.look =
      valueOf(runtime::suggestLook(open, open.volumes()[0], runtime::chooseGrids(open, open.volumes()[0])), "look");
  expected.colorFormat = runtime::ColorFormat::single;
  EXPECT_EQ(picture.rgba(), valueOf(gpu().render(*renderer, expected), "render").rgba);
  EXPECT_GT(sum(picture.rgba()), 10);
}

// A turned instance, seen by a camera that is turned with it, is the same picture.
TEST_F(CapiPlay, ADirectDrawTurnsWithItsInstance) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  Instance instance = standing(context, pack);
  settle(context, instance);
  View view = viewOf(valueOf(pack.volume(0), "volume"));
  Sun sun;
  const Picture upright, turned;
  DrawInfo info = drawInfo(upright, view);
  info.sun = &sun;
  ASSERT_EQ(draw(context, info).code, BILLOW_OK);
  // x to y, y to z, z to x; then moved.
  ASSERT_TRUE(instance.setTransform({0, 0, 1, 5, 1, 0, 0, -7, 0, 1, 0, 11}));
  const auto turn = [](auto(&v)[3]) { std::rotate(v, v + 2, v + 3); };
  turn(view.eye);
  turn(view.right);
  turn(view.up);
  turn(view.forward);
  turn(sun.direction);
  view.eye[0] += 5;
  view.eye[1] -= 7;
  view.eye[2] += 11;
  ASSERT_TRUE(context.update({}));
  info.color = turned.color->view();
  info.depth = turned.depth->view();
  ASSERT_EQ(draw(context, info).code, BILLOW_OK);
  const auto a = upright.rgba(), b = turned.rgba();
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-3f) << i;
  ASSERT_TRUE(instance.setTransform({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0}));
  EXPECT_EQ(draw(context, info).code, BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiPlay, ASpaceDrawsAllThatIsThere) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  const Space space = valueOf(context.createSpace(smallSpace()), "space");
  const View view = viewOf(valueOf(pack.volume(0), "volume"));
  const Picture picture;
  DrawInfo info = drawInfo(picture, view);
  info.space = space.get();
  EXPECT_EQ(draw(context, info).code, BILLOW_OK);
  EXPECT_EQ(sum(picture.rgba()), 0) << "nothing is there yet, and every pixel is written";
  const Instance instance = standing(context, pack);
  settle(context, instance);
  const Error error = draw(context, info);
  ASSERT_EQ(error.code, BILLOW_OK) << error.message;
  const double one = sum(picture.rgba());
  EXPECT_GT(one, 10);
  EXPECT_GT(space.stats().drawn, 0u);
  EXPECT_LE(space.stats().bytes, smallSpace().memoryBudget);
  EXPECT_GT(space.shadow().texels, 0u);
  const Instance other = standing(context, pack);
  settle(context, other);
  const BillowInstance ids[] = {other.id()};
  info.instances = ids;
  info.instanceCount = 0;
  EXPECT_EQ(draw(context, info).code, BILLOW_OK);
  EXPECT_EQ(sum(picture.rgba()), 0);
  info.instanceCount = 1;
  EXPECT_EQ(draw(context, info).code, BILLOW_OK);
  EXPECT_NEAR(sum(picture.rgba()), one, 1e-3 * one);
}

// Of all instances a space that is too small for them shows those that matter most.
TEST_F(CapiPlay, ASmallSpaceDrawsTheMostImportant) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  SpaceInfo spaceInfo = smallSpace();
  spaceInfo.maxVolumes = 1;
  const Space space = valueOf(context.createSpace(spaceInfo), "space");
  Instance far = standing(context, pack);
  ASSERT_TRUE(far.setTransform({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -900}));
  const Instance near = standing(context, pack);
  settle(context, near);
  settle(context, far);
  const View view = viewOf(valueOf(pack.volume(0), "volume"));
  const Picture all, one;
  DrawInfo info = drawInfo(all, view);
  info.space = space.get();
  ASSERT_EQ(draw(context, info).code, BILLOW_OK);
  const BillowInstance ids[] = {near.id(), far.id()};
  info.instances = ids;
  info.instanceCount = 2;
  EXPECT_EQ(draw(context, info).code, BILLOW_ERROR_ARGUMENT);
  info.instanceCount = 1;
  info.color = one.color->view();
  info.depth = one.depth->view();
  ASSERT_EQ(draw(context, info).code, BILLOW_OK);
  EXPECT_GT(sum(one.rgba()), 10);
  EXPECT_NEAR(sum(all.rgba()), sum(one.rgba()), 1e-3 * sum(one.rgba()));
}

TEST_F(CapiPlay, NamesOfWhatIsGoneAreRefused) {
  Context context = makeContext();
  Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  const BillowPack id = pack.id();
  const Instance instance = standing(context, pack);
  EXPECT_EQ(context.addInstance(BillowPack{77}).error().code, BILLOW_ERROR_ARGUMENT);
  pack.reset();
  EXPECT_EQ(billowPackState(context.get(), id), BILLOW_PACK_UNKNOWN);
  EXPECT_EQ(context.addInstance(id).error().code, BILLOW_ERROR_ARGUMENT);
  EXPECT_EQ(instance.state().error().code, BILLOW_ERROR_ARGUMENT);
  ASSERT_TRUE(context.update({}));
  EXPECT_FALSE(context.takeError().has_value());
}

TEST_F(CapiPlay, LaterItIsReadyAndWhatWaitedPlays) {
  Context context = makeContext();
  OpenInfo info;
  const std::string path = file_.path();
  info.path = path.c_str();
  const Pack pack = valueOf(context.openLater(info), "pack");
  const Instance instance = standing(context, pack);
  for (int i = 0; i < 2000 && pack.state() == BILLOW_PACK_OPENING; ++i) {
    EXPECT_EQ(pack.volume(0).error().code, BILLOW_NOT_READY);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(context.update({}));
  }
  EXPECT_EQ(pack.state(), BILLOW_PACK_READY);
  settle(context, instance);
  for (int i = 0; i < 2000 && pack.suggestLook(0).error().code == BILLOW_NOT_READY; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(context.update({}));
  }
  const Pack again = valueOf(context.open(info), "pack");
  EXPECT_EQ(valueOf(pack.suggestLook(0), "look").extinctionScale,
            valueOf(again.suggestLook(0), "look").extinctionScale);
}

TEST_F(CapiPlay, AfterTheDeviceIsReplacedItGoesOn) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  const Space space = valueOf(context.createSpace(smallSpace()), "space");
  const Instance instance = standing(context, pack);
  settle(context, instance);
  const View view = viewOf(valueOf(pack.volume(0), "volume"));
  const Picture before, after, spaceBefore, spaceAfter;
  const auto drawBoth = [&](const Picture& direct, const Picture& inSpace) {
    DrawInfo info = drawInfo(direct, view);
    const BillowResult first = draw(context, info).code;
    info = drawInfo(inSpace, view);
    info.space = space.get();
    const BillowResult second = draw(context, info).code;
    EXPECT_EQ(first, second);
    return first;
  };
  ASSERT_EQ(drawBoth(before, spaceBefore), BILLOW_OK);
  context.detach();
  EXPECT_EQ(drawBoth(after, spaceAfter), BILLOW_NOT_READY);
  EXPECT_TRUE(context.update({}));
  EXPECT_EQ(context.wait().semaphore, VkSemaphore{});
  EXPECT_EQ(context.stats().gpuBytesInAll, 0u);
  EXPECT_EQ(context.createSpace(smallSpace()).error().code, BILLOW_NOT_READY);
  ASSERT_TRUE(context.attach(device()));
  settle(context, instance);
  ASSERT_EQ(drawBoth(after, spaceAfter), BILLOW_OK);
  EXPECT_EQ(before.rgba(), after.rgba());
  // A space's metavoxels may lie elsewhere in its pool, where filtering rounds otherwise.
  const std::vector<float> was = spaceBefore.rgba(), is = spaceAfter.rgba();
  ASSERT_EQ(was.size(), is.size());
  for (std::size_t i = 0; i < was.size(); ++i) {
    ASSERT_NEAR(static_cast<double>(was[i]), static_cast<double>(is[i]), 1e-3) << i;
  }
}

struct Counted {
  std::atomic<std::int64_t> bytes = 0, peak = 0, lines = 0, jobs = 0;
  static void* allocate(void* user, std::size_t size, std::size_t alignment) {
    auto& self = *static_cast<Counted*>(user);
    const std::int64_t now = self.bytes += static_cast<std::int64_t>(size);
    std::int64_t most = self.peak;
    while (now > most && !self.peak.compare_exchange_weak(most, now)) {
    }
    return ::operator new(size, std::align_val_t(alignment));
  }
  static void release(void* user, void* memory, std::size_t size, std::size_t alignment) {
    static_cast<Counted*>(user)->bytes -= static_cast<std::int64_t>(size);
    ::operator delete(memory, std::align_val_t(alignment));
  }
  static void write(void* user, BillowLogLevel, const char* line) {
    if (std::strchr(line, '\n') == nullptr) ++static_cast<Counted*>(user)->lines;
  }
  static void submit(void* user, void (*job)(void*), void* context) {
    ++static_cast<Counted*>(user)->jobs;
    std::thread(job, context).detach();
  }
};

TEST_F(CapiPlay, MemoryJobsAndLinesAreTheHosts) {
  Counted counted;
  Allocator allocator;
  allocator.allocate = Counted::allocate;
  allocator.release = Counted::release;
  Log log;
  log.write = Counted::write;
  Jobs jobs;
  jobs.submit = Counted::submit;
  allocator.user = log.user = jobs.user = &counted;
  Config with = config();
  with.allocator = &allocator;
  with.log = &log;
  with.jobs = &jobs;
  with.threads = 0;
  {
    Context context = makeContext(with);
    const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
    const Instance instance = standing(context, pack);
    settle(context, instance);
    const Stats stats = context.stats();
    EXPECT_LE(stats.gpuAllocated, with.gpuBudget);
    EXPECT_LE(stats.cpuPeak, with.cpuBudget);
    EXPECT_GT(stats.framesResident, 0u);
    EXPECT_LE(stats.gpuBytesInAll, stats.gpuAllocated + with.stagingBytes + (1u << 20));
  }
  EXPECT_GT(counted.jobs, 0);
  EXPECT_GT(counted.peak, 0);
  EXPECT_LE(counted.peak, static_cast<std::int64_t>(with.cpuBudget));
  EXPECT_EQ(counted.bytes, 0);
  with.jobs = nullptr;
  EXPECT_EQ(Context::create(device(), with).error().code, BILLOW_ERROR_ARGUMENT);
}

TEST_F(CapiPlay, APictureIsLaidOverTheGames) {
  Context context = makeContext();
  const Pack pack = valueOf(context.open(file_.path().c_str()), "pack");
  const Instance instance = standing(context, pack);
  settle(context, instance);
  Compositor compositor = valueOf(context.createCompositor(1), "compositor");
  const View view = viewOf(valueOf(pack.volume(0), "volume"));
  const Picture picture;
  ASSERT_EQ(draw(context, drawInfo(picture, view)).code, BILLOW_OK);
  const std::vector<float> far(std::size_t{kSide} * kSide, 1e30f);
  const auto target = valueOf(gpu().sceneImage(kSide, kSide, std::vector<float>(far.size() * 4, 0.0f)), "target");
  const auto depth = valueOf(gpu().sceneImage(kSide, kSide, far), "depth");
  CompositeInfo info;
  info.colorFormat = info.targetFormat = BILLOW_COLOR_RGBA32F;
  info.width = info.height = info.targetWidth = info.targetHeight = kSide;
  info.color = picture.color->view();
  info.depth = picture.depth->view();
  info.target = target->view();
  info.targetDepth = depth->view();
  const auto record = [&](VkCommandBuffer commands) -> runtime::Result<void> {
    EXPECT_TRUE(compositor.record(commands, info));
    return {};
  };
  ASSERT_TRUE(gpu().run(record));
  const auto laid = valueOf(gpu().read(*target), "read");
  EXPECT_NEAR(sum(laid), sum(picture.rgba()), 1e-3 * sum(laid));
}

}  // namespace
}  // namespace billow::tests
