#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "soak.h"

namespace billow::tests {
namespace {

constexpr std::uint32_t kPicturesADrain = 4;
constexpr std::uint64_t kOperationsASession = 2500;
constexpr std::uint64_t kComfortableGpu = std::uint64_t{96} << 20;
constexpr std::uint64_t kComfortableCpu = std::uint64_t{64} << 20;

template <class Expected>
auto valueOf(Expected result, const char* what) {
  if (!result) {
    fmt::print(stderr, "billow_stream_soak: {}: {}\n", what, result.error().message);
    std::exit(1);
  }
  return std::move(*result);
}

}  // namespace

Soak::Soak(const SoakOptions& options)
    : options_(options), random_(options.seed), packs_(makeSoakPacks()), device_(new headless::VulkanDevice) {
  folder_ = (std::filesystem::temp_directory_path() / "billow_soak_XXXXXX").string();
  require(mkdtemp(folder_.data()) != nullptr, "a folder for packs");
  const auto opened = device_->open({.validation = options.validation});
  if (!opened) fail(opened.error().message);
  referenceRenderer_ = valueOf(runtime::Renderer::create(device_->host, {}), "the renderer to compare with");
  referencePainter_ = std::make_unique<Painter>(*device_, *referenceRenderer_);
}

Soak::~Soak() {
  referencePainter_.reset();
  referenceRenderer_.reset();
  std::filesystem::remove_all(folder_);
}

void Soak::run() {
  const auto begin = std::chrono::steady_clock::now();
  const auto over = [&] {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    return options_.seconds > 0 ? passed.count() > options_.seconds : counts_.operations >= options_.operations;
  };
  while (!over()) {
    beginSession();
    for (std::uint64_t i = 0; i < kOperationsASession && !over(); ++i) step();
    endSession();
  }
}

void Soak::beginSession() {
  ++counts_.sessions;
  const auto seed = static_cast<std::uint32_t>(random_());
  disk_ = std::make_unique<SimulatedDisk>(chance(0.7) ? kMemoryDisk : kNvme, seed);
  jobs_ = std::make_unique<HostJobs>(1 + below(2), seed);
  allocator_ = std::make_unique<CountingAllocator>(seed);
  const runtime::Verify policies[] = {runtime::Verify::always, runtime::Verify::once, runtime::Verify::never};
  config_ = {.gpuBudget = kComfortableGpu,
             .cpuBudget = kComfortableCpu,
             .stagingBytes = std::uint64_t{64} << (10 + 2 * below(4)),
             .threads = below(4),
             .readThreads = 1 + below(2),
             .jobs = {},
             .allocator = allocator_->callbacks(),
             .framesInFlight = 1 + below(3),
             .verify = policies[below(3)],
             .prefetchSeconds = 0.25 * below(4)};
  if (config_.threads == 0) config_.jobs = jobs_->callbacks();
  viewed_ = chance(0.3);
  makeRenderer();
  streamer_ = valueOf(runtime::Streamer::create(*renderer_, config_), "a streamer");
  measureBaseline();
  gpuBound_ = kComfortableGpu;
  cpuBound_ = kComfortableCpu;
  faulty_ = false;
  comfortable_ = comparable_ = attached_ = true;
}

// Sometimes in the middle of everything, sometimes when all is calm.
void Soak::endSession() {
  if (chance(0.7)) drain();
  finishSnapshot();
  clearFaults();
  takeErrors();
  device_->vk.vkDeviceWaitIdle(device_->host.device);
  streamer_.reset();
  const CountingAllocator::Stats memory = allocator_->stats();
  require(memory.blocks == 0, "memory of the host's allocator is left");
  require(memory.wrong == 0, "memory was given back with another size or alignment");
  if (attached_) dropRenderer();
  assets_.clear();
  actors_.clear();
  told_.clear();
  counts_.memoryFaults += memory.failed;
  counts_.diskFaults += disk_->stats().failed + disk_->stats().flipped;
  jobs_.reset();
  disk_.reset();
  for (const std::string& message : device_->messages) fail(message);
}

void Soak::makeRenderer() {
  renderer_ = valueOf(runtime::Renderer::create(VulkanFaults::get().wrap(device_->host), {}), "a renderer");
  painter_ = std::make_unique<Painter>(*device_, *renderer_);
  hostBaseline_ = VulkanFaults::get().stats().hostBytes;
}

// Of the device: what renderer, painter and streamer have before there is a frame.
void Soak::measureBaseline() {
  gpuBaseline_ = VulkanFaults::get().stats().deviceBytes;
  VulkanFaults::get().resetPeak();
}

void Soak::dropRenderer() {
  painter_.reset();
  renderer_.reset();
  const VulkanFaults::Stats stats = VulkanFaults::get().stats();
  require(stats.none(), "Vulkan objects are left");
}

void Soak::clearFaults() {
  const VulkanFaults::Stats stats = VulkanFaults::get().stats();
  counts_.deviceFaults = stats.outOfMemory + stats.lost;
  disk_->setFaults({});
  stalled_ = false;
  allocator_->setFailures(0);
  jobs_->pause(false);
  VulkanFaults::get().setFaults({});
}

// Faults stop, budgets are wide and every instance stands: so everything must become as fine as can be.
void Soak::drain() {
  trace("drain");
  ++counts_.drains;
  finishSnapshot();
  clearFaults();
  if (!attached_) reattach();
  streamer_->setBudget(kComfortableGpu, kComfortableCpu);
  gpuBound_ = kComfortableGpu;
  cpuBound_ = kComfortableCpu;
  for (Actor& actor : actors_) {
    runtime::Playback playback = actor.clock.playback();
    playback.speed = 0;
    actor.clock.set(playback);
    streamer_->setPlayback(actor.id, playback);
  }
  takeErrors();
  // What was read wrongly and not verified is resident without an error.
  for (Asset& asset : assets_) asset.damaged = asset.damaged || !comparable_;
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint32_t calm = 0; calm < 4;) {
    repair();
    update(1.0 / 60);
    takeErrors();
    calm = settled() ? calm + 1 : 0;
    if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(120)) failDrain();
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  for (Asset& asset : assets_) {
    asset.contents = {asset.contents.back()};
    asset.before = nullptr;
  }
  faulty_ = false;
  comfortable_ = comparable_ = true;
  told_.clear();
  for (std::uint32_t i = 0; i < kPicturesADrain; ++i) {
    takeSnapshot();
    finishSnapshot();
  }
  for (Actor& actor : actors_) {
    const SoakPack& pack = packs_[assets_[actor.asset].contents[0]];
    const double time = share() * pack.last;
    actor.clock = SoakClock(pack, actor.clock.playback(), time);
    streamer_->seek(actor.id, time);
  }
}

bool Soak::settled() {
  for (Asset& asset : assets_) {
    if (asset.opening || asset.damaged) return false;
    const format::Pack* pack = streamer_->pack(asset.id);
    if (pack == nullptr || pack == asset.before) return false;
    if (pack->fileSize() != packs_[asset.contents.back()].bytes.size()) return false;
  }
  return std::all_of(actors_.begin(), actors_.end(), [&](const Actor& actor) {
    if (!(actor.priority > 0)) return true;
    const runtime::Drawable drawable = streamer_->drawable(actor.id);
    return drawable.count > 0 && !drawable.held && !drawable.coarse;
  });
}

void Soak::failDrain() {
  std::string what = "faults are over, but two minutes later not all is full:";
  for (const Asset& asset : assets_) {
    const format::Pack* pack = streamer_->pack(asset.id);
    what += fmt::format("\n  asset {:#x}: state {}, {} bytes of {}, opening {}, damaged {}", asset.id.value,
                        static_cast<int>(streamer_->state(asset.id)), pack != nullptr ? pack->fileSize() : 0,
                        packs_[asset.contents.back()].bytes.size(), asset.opening, asset.damaged);
  }
  for (const Actor& actor : actors_) {
    const runtime::Drawable drawable = streamer_->drawable(actor.id);
    what += fmt::format("\n  instance {:#x} of asset {:#x}: priority {}, {} layers, time {}, held {}, coarse {}",
                        actor.id.value, assets_[actor.asset].id.value, actor.priority, drawable.count, drawable.time,
                        drawable.held, drawable.coarse);
  }
  const runtime::StreamStats stats = streamer_->stats();
  what +=
      fmt::format("\n  gpu {} of {}, cpu {}, {} resident; queued {}, reading {}, decoding {}, uploading {}; missing",
                  stats.gpuAllocated, gpuBound_, stats.cpuBytes, stats.framesResident, stats.loadsQueued,
                  stats.loadsReading, stats.loadsDecoding, stats.loadsUploading);
  for (const std::uint64_t bricks : stats.missingBricks) what += fmt::format(" {}", bricks);
  fail(what);
}

// A page that could not be had is asked for again when the host opens the pack anew.
void Soak::repair() {
  for (Asset& asset : assets_) {
    if (!asset.damaged || asset.opening) continue;
    const std::size_t content = asset.contents.back();
    // One that is under way still must end first.
    const format::Pack* const before = streamer_->pack(asset.id);
    if (!streamer_->reload(asset.id, sourceOf(asset, packs_[content].bytes))) continue;
    asset.contents.push_back(content);
    forgetErrors(asset);
    asset.before = before;
    asset.damaged = false;
    ++counts_.reloads;
  }
}

// Of another pack the same pages are others.
void Soak::forgetErrors(const Asset& asset) {
  const std::string prefix = fmt::format("{} ", asset.id.value);
  std::erase_if(told_, [&](const std::string& key) { return key.starts_with(prefix); });
}

void Soak::takeErrors() {
  while (const auto error = streamer_->takeError()) {
    ++counts_.errors;
    if (options_.trace) fmt::print(stderr, "  error: {}\n", error->message);
    if (!faulty_ && comfortable_) fail("an error where nothing was let fail: " + error->message);
    require(!error->message.empty() && error->message.find('\n') == std::string::npos, "an error is one line");
    // What passes (a full memory, a read that fails) may come again; a page that is wrong stays wrong. Of a reload
    // under way there are two packs.
    const auto known =
        std::find_if(assets_.begin(), assets_.end(), [&](const Asset& asset) { return asset.id == error->asset; });
    const bool one = known != assets_.end() && known->contents.size() == 1;
    const std::string key = fmt::format("{} {} {}", error->asset.value, error->volume, error->page.value_or(0));
    if (one && error->page && error->code == runtime::ErrorCode::pack && !told_.insert(key).second) {
      fail("an error that the host knows: " + error->message);
    }
    for (Asset& asset : assets_) {
      if (asset.id == error->asset) asset.damaged = true;
    }
  }
}

std::string Soak::summary() const {
  const Counts& c = counts_;
  return fmt::format(
      "{} operations, {} updates, {} sessions, {} drains\n"
      "shown {}: full {}, coarse {}, held {}, empty {} (after something had been there: {})\n"
      "pictures equal {}, of these with something on them {}; not comparable {}\n"
      "frames loaded {}, evicted {}; opened {} ({} refused), reloaded {}, device lost {}, attached {}\n"
      "faults: disk {}, memory {}, device {}; errors told {}",
      c.operations, c.updates, c.sessions, c.drains, c.shown, c.full, c.coarse, c.held, c.empty, c.holes, c.pictures,
      c.lit, c.unclear, c.loaded, c.evicted, c.opens, c.refused, c.reloads, c.losses, c.attaches, c.diskFaults,
      c.memoryFaults, c.deviceFaults, c.errors);
}

}  // namespace billow::tests
