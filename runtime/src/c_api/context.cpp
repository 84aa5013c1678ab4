#include "c_api/context.h"

#include <limits>

#include "c_api/convert.h"
#include "c_api/device.h"

namespace billow::c_api {
namespace {

void writeLog(void* user, runtime::LogLevel level, const char* line) {
  const auto& log = *static_cast<const BillowLog*>(user);
  log.write(log.user, static_cast<BillowLogLevel>(level), line);
}

Outcome<void> addCallbacks(const BillowConfig& c, BillowContext& context, runtime::StreamConfig& config) {
  if (c.jobs != nullptr) {
    const auto jobs = given(c.jobs);
    if (!jobs) return tl::unexpected(jobs.error());
    config.jobs = {.submit = jobs->submit, .user = jobs->user};
  }
  if (c.threads == 0 && config.jobs.submit == nullptr) {
    return badArgument("BillowConfig::threads is 0, so jobs must be given");
  }
  if (c.allocator != nullptr) {
    const auto allocator = given(c.allocator);
    if (!allocator) return tl::unexpected(allocator.error());
    if ((allocator->allocate == nullptr) != (allocator->release == nullptr)) {
      return badArgument("BillowAllocator has one function; it needs both or none");
    }
    config.allocator = {.allocate = allocator->allocate, .release = allocator->release, .user = allocator->user};
  }
  if (c.log == nullptr) return {};
  const auto log = given(c.log);
  if (!log) return tl::unexpected(log.error());
  context.log = *log;
  if (log->write != nullptr) config.log = {.write = writeLog, .user = &context.log};
  return {};
}

Outcome<runtime::StreamConfig> streamConfigOf(const BillowConfig& c, BillowContext& context) {
  if (c.framesInFlight == 0) return badArgument("BillowConfig::framesInFlight is 0");
  if (c.directDraws == 0) return badArgument("BillowConfig::directDraws is 0");
  if (c.stagingBytes < 65536) return badArgument("BillowConfig::stagingBytes is less than 64 KiB");
  if (!(c.prefetchSeconds >= 0 && c.prefetchSeconds <= 60)) {
    return badArgument("BillowConfig::prefetchSeconds is outside of its range");
  }
  const auto verify = enumerator<runtime::Verify>(c.verify, 3, "BillowConfig::verify");
  if (!verify) return tl::unexpected(verify.error());
  const auto submission = enumerator<runtime::Submission>(c.submission, 2, "BillowConfig::submission");
  if (!submission) return tl::unexpected(submission.error());
  runtime::StreamConfig config{.gpuBudget = c.gpuBudget,
                               .cpuBudget = c.cpuBudget,
                               .stagingBytes = c.stagingBytes,
                               .threads = c.threads,
                               .readThreads = c.readThreads,
                               .framesInFlight = c.framesInFlight,
                               .verify = *verify,
                               .submission = *submission,
                               .prefetchSeconds = c.prefetchSeconds};
  if (auto done = addCallbacks(c, context, config); !done) return tl::unexpected(done.error());
  return config;
}

Outcome<std::unique_ptr<runtime::Renderer>> makeRenderer(const BillowDevice* device, const runtime::Config& config) {
  const auto host = hostOf(device);
  if (!host) return tl::unexpected(host.error());
  auto renderer = runtime::Renderer::create(*host, config);
  if (!renderer) return problem(renderer.error());
  return std::move(*renderer);
}

Outcome<void> create(const BillowDevice* device, const BillowConfig* config, BillowContext** into) {
  if (into == nullptr) return badArgument("context is NULL");
  const auto c = given(config);
  if (!c) return tl::unexpected(c.error());
  auto context = std::make_unique<BillowContext>();
  const auto stream = streamConfigOf(*c, *context);
  if (!stream) return tl::unexpected(stream.error());
  const auto blocks = enumerator<runtime::BlockUse>(c->blocks, 3, "BillowConfig::blocks");
  if (!blocks) return tl::unexpected(blocks.error());
  // What is streamed and each space keep to budgets of their own.
  context->rendererConfig = {
      .gpuBudget = std::numeric_limits<std::uint64_t>::max(), .recordsInFlight = c->directDraws, .blocks = *blocks};
  auto renderer = makeRenderer(device, context->rendererConfig);
  if (!renderer) return tl::unexpected(renderer.error());
  context->renderer = std::move(*renderer);
  auto streamer = runtime::Streamer::create(*context->renderer, *stream);
  if (!streamer) return problem(streamer.error());
  context->streamer = std::move(*streamer);
  context->stagingBytes = c->stagingBytes;
  *into = context.release();
  return {};
}

Outcome<void> setBudget(BillowContext& context, std::uint64_t gpuBytes, std::uint64_t cpuBytes) {
  if (gpuBytes == 0) return badArgument("gpuBytes is 0");
  if (cpuBytes < context.stagingBytes) {
    return badArgument("cpuBytes of " + std::to_string(cpuBytes) + " do not hold BillowConfig::stagingBytes of " +
                       std::to_string(context.stagingBytes));
  }
  context.streamer->setBudget(gpuBytes, cpuBytes);
  return {};
}

void forgetDevice(BillowContext& context) {
  for (BillowSpace* space : context.spaces) space->metavoxels.reset();
  for (BillowCompositor* compositor : context.compositors) compositor->compositor.reset();
  context.renderer.reset();
}

Outcome<void> makeObjects(BillowContext& context) {
  for (BillowSpace* space : context.spaces) {
    if (auto made = space->make(); !made) return made;
  }
  for (BillowCompositor* compositor : context.compositors) {
    if (auto made = compositor->make(); !made) return made;
  }
  return {};
}

Outcome<void> attach(BillowContext& context, const BillowDevice* device) {
  if (context.renderer != nullptr) return badArgument("the context has a device already; see billowDetach()");
  auto renderer = makeRenderer(device, context.rendererConfig);
  if (!renderer) return tl::unexpected(renderer.error());
  context.renderer = std::move(*renderer);
  auto made = makeObjects(context);
  if (made) {
    const auto attached = context.streamer->attach(*context.renderer);
    if (attached) return {};
    made = problem(attached.error());
  }
  forgetDevice(context);
  return made;
}

}  // namespace
}  // namespace billow::c_api

// All that is on the device goes before the renderer.
BillowContext::~BillowContext() {
  streamer.reset();
  renderer.reset();
}

extern "C" {

BillowResult billowCreate(const BillowDevice* device, const BillowConfig* config, BillowContext** context,
                          BillowError* error) {
  return billow::c_api::answering(error, [&] { return billow::c_api::create(device, config, context); });
}

void billowDestroy(BillowContext* context) {
  delete context;
}

BillowResult billowSetBudget(BillowContext* context, uint64_t gpuBytes, uint64_t cpuBytes, BillowError* error) {
  return billow::c_api::answering(error, [&] { return billow::c_api::setBudget(*context, gpuBytes, cpuBytes); });
}

void billowDetach(BillowContext* context) {
  if (context->renderer == nullptr) return;
  billow::c_api::quietly([&] { context->streamer->detach(); });
  billow::c_api::forgetDevice(*context);
}

BillowResult billowAttach(BillowContext* context, const BillowDevice* device, BillowError* error) {
  return billow::c_api::answering(error, [&] { return billow::c_api::attach(*context, device); });
}

}  // extern "C"
