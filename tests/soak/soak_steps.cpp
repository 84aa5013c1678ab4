#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "soak.h"

namespace billow::tests {
namespace {

constexpr std::size_t kMostAssets = 6;
constexpr std::size_t kMostActors = 40;

}  // namespace

void Soak::trace(const char* what) const {
  if (options_.trace) fmt::print(stderr, "{} {}\n", counts_.operations, what);
}

void Soak::step() {
  struct Kind {
    std::uint32_t weight;
    void (Soak::*act)();
    const char* name;
  };
  static constexpr Kind kKinds[] = {{6000, &Soak::updateOnce, "update"},   {1800, &Soak::changePlayback, "playback"},
                                    {500, &Soak::addInstance, "add"},      {400, &Soak::removeInstance, "remove"},
                                    {120, &Soak::openAsset, "open"},       {60, &Soak::closeAsset, "close"},
                                    {80, &Soak::reloadAsset, "reload"},    {60, &Soak::changeBudgets, "budgets"},
                                    {15, &Soak::squeeze, "squeeze"},       {60, &Soak::setFaults, "faults"},
                                    {60, &Soak::clearFaults, "no faults"}, {5, &Soak::loseDevice, "device lost"},
                                    {5, &Soak::reattach, "attach"},        {15, &Soak::drain, "drain"},
                                    {150, &Soak::takeSnapshot, "picture"}, {60, &Soak::nonsense, "nonsense"}};
  std::uint32_t sum = 0;
  for (const Kind& kind : kKinds) sum += kind.weight;
  std::uint32_t at = below(sum);
  ++counts_.operations;
  for (const Kind& kind : kKinds) {
    if (at < kind.weight) {
      trace(kind.name);
      (this->*kind.act)();
      break;
    }
    at -= kind.weight;
  }
  takeErrors();
}

void Soak::updateOnce() {
  const double choices[] = {0, 1.0 / 144, 1.0 / 60, 1.0 / 60, 1.0 / 60, 1.0 / 24, 0.5, 30};
  update(choices[below(8)]);
  // Operations do not wait for a clock, so that other threads get their turn by chance.
  if (chance(0.02)) std::this_thread::sleep_for(std::chrono::microseconds(500));
  if (chance(0.2)) std::this_thread::yield();
}

void Soak::update(double seconds) {
  if (snapshot_ && snapshot_->updatesLeft-- == 0) finishSnapshot();
  runtime::UpdateInfo info{.seconds = seconds};
  if (viewed_ && !chance(0.1)) {
    info.view =
        runtime::lookAt({share() * 200 - 100, share() * 20, 20 + share() * 200}, {4.8, 4.8, 4.8}, {0, 1, 0}, 40);
    info.pixelsHigh = 100 + below(2000);
  }
  streamer_->update(info);
  ++counts_.updates;
  for (Actor& actor : actors_) actor.clock.advance(seconds);
  check();
}

void Soak::addInstance() {
  if (actors_.size() >= kMostActors) return;
  std::vector<std::size_t> ready;
  for (std::size_t i = 0; i < assets_.size(); ++i) {
    if (!assets_[i].opening) ready.push_back(i);
  }
  if (ready.empty()) return;
  const std::size_t asset = ready[below(static_cast<std::uint32_t>(ready.size()))];
  runtime::InstanceInfo info{.asset = assets_[asset].id, .time = share() * 3 - 1, .playback = anyPlayback()};
  for (std::size_t axis = 0; axis < 3; ++axis) info.objectToWorld[4 * axis + 3] = share() * 50 - 25;
  info.priority = chance(0.1) ? 0 : static_cast<float>(share() * 3);
  const auto id = streamer_->addInstance(info);
  if (!id) fail("an instance of a ready asset: " + id.error().message);
  SoakClock clock(packs_[assets_[asset].contents.back()], info.playback, info.time);
  if (assets_[asset].contents.size() > 1) clock.forget();
  actors_.push_back({.id = *id, .asset = asset, .clock = clock, .priority = info.priority});
}

void Soak::removeInstance() {
  if (actors_.empty()) return;
  const std::uint32_t which = below(static_cast<std::uint32_t>(actors_.size()));
  const runtime::InstanceId id = actors_[which].id;
  streamer_->removeInstance(id);
  require(streamer_->drawable(id).count == 0, "an instance that is gone is drawn");
  actors_.erase(actors_.begin() + which);
}

runtime::Playback Soak::anyPlayback() {
  const double speeds[] = {0, 1, 1, 1, -1, 4, -4, 0.1, 1000};
  const runtime::Loop loops[] = {runtime::Loop::once, runtime::Loop::loop, runtime::Loop::pingPong};
  const runtime::Interpolation ways[] = {runtime::Interpolation::hold, runtime::Interpolation::blend,
                                         runtime::Interpolation::advect};
  return {.speed = speeds[below(9)], .loop = loops[below(3)], .interpolation = ways[below(3)]};
}

void Soak::changePlayback() {
  if (actors_.empty()) return;
  Actor& actor = actors_[below(static_cast<std::uint32_t>(actors_.size()))];
  switch (below(5)) {
    case 0: {
      const runtime::Playback playback = anyPlayback();
      actor.clock.set(playback);
      return streamer_->setPlayback(actor.id, playback);
    }
    case 1: {
      actor.priority = chance(0.2) ? 0 : static_cast<float>(share() * 3);
      return streamer_->setPriority(actor.id, actor.priority);
    }
    case 2: {
      std::array<double, 12> transform{1, 0, 0, share() * 50, 0, 1, 0, share() * 50, 0, 0, 1, share() * 50};
      return streamer_->setTransform(actor.id, transform);
    }
    default: {
      const double time = share() * 3 - 1;
      actor.clock.seek(time);
      return streamer_->seek(actor.id, time);
    }
  }
}

// By a temporary name and rename(), as a build writes a pack.
void Soak::writeFile(std::span<const std::byte> bytes, const std::string& path) {
  {
    std::ofstream file(path + ".new", std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file) fail("cannot write " + path);
  }
  std::filesystem::rename(path + ".new", path);
}

// A pack with a wrong bit, or the beginning of one.
std::vector<std::byte> Soak::spoiled(std::vector<std::byte> bytes) {
  const std::uint32_t at = below(static_cast<std::uint32_t>(bytes.size()));
  if (chance(0.5))
    bytes.resize(at);
  else
    bytes[at] ^= static_cast<std::byte>(1u << below(8));
  return bytes;
}

runtime::PackSource Soak::sourceOf(Asset& asset, std::vector<std::byte> bytes) {
  if (asset.path.empty()) return {.source = disk_->file(std::move(bytes))};
  writeFile(bytes, asset.path);
  return {.path = asset.path};
}

void Soak::openAsset() {
  if (assets_.size() >= kMostAssets) return;
  const std::size_t content = below(static_cast<std::uint32_t>(packs_.size()));
  Asset asset;
  asset.contents = {content};
  if (chance(0.5)) asset.path = fmt::format("{}/{}.blw", folder_, ++files_);
  const bool bad = chance(0.15);
  faulty_ = faulty_ || bad;
  const runtime::PackSource source = sourceOf(asset, bad ? spoiled(packs_[content].bytes) : packs_[content].bytes);
  asset.opening = stalled_ || chance(0.5);  // open() waits for the disk
  asset.damaged = bad;
  if (bad && config_.verify == runtime::Verify::never) comparable_ = false;
  const auto id = asset.opening ? streamer_->openLater(source) : streamer_->open(source);
  ++counts_.opens;
  if (!id) {
    ++counts_.refused;
    if (!faulty_ && comfortable_) fail("a sound pack is refused: " + id.error().message);
    return;
  }
  asset.id = *id;
  assets_.push_back(std::move(asset));
}

void Soak::forgetAsset(std::size_t which) {
  std::erase_if(actors_, [&](const Actor& actor) { return actor.asset == which; });
  for (Actor& actor : actors_) actor.asset -= actor.asset > which ? 1 : 0;
  assets_.erase(assets_.begin() + static_cast<std::ptrdiff_t>(which));
}

void Soak::closeAsset() {
  if (assets_.empty()) return;
  const std::size_t which = below(static_cast<std::uint32_t>(assets_.size()));
  const runtime::AssetId id = assets_[which].id;
  streamer_->close(id);
  require(streamer_->state(id) == runtime::Streamer::AssetState::unknown, "a closed asset has a state");
  for (const Actor& actor : actors_) {
    if (actor.asset == which) require(streamer_->drawable(actor.id).count == 0, "an instance of a closed asset");
  }
  forgetAsset(which);
}

void Soak::reloadAsset() {
  if (assets_.empty()) return;
  Asset& asset = assets_[below(static_cast<std::uint32_t>(assets_.size()))];
  if (asset.opening) return;
  // Another one of the same frames as a rule, so that pictures stay comparable.
  const std::size_t now = asset.contents.back();
  const std::size_t content = now < 2 && chance(0.8) ? 1 - now : below(static_cast<std::uint32_t>(packs_.size()));
  const bool bad = chance(0.3);
  const runtime::PackSource source = sourceOf(asset, bad ? spoiled(packs_[content].bytes) : packs_[content].bytes);
  const format::Pack* const before = streamer_->pack(asset.id);
  const auto done = streamer_->reload(asset.id, source);
  ++counts_.reloads;
  faulty_ = faulty_ || bad;
  if (bad && config_.verify == runtime::Verify::never) comparable_ = false;
  if (!done) {
    // A reload by the same content is not seen to be over.
    const bool underWay = done.error().message.find("is being reloaded") != std::string::npos;
    if (!faulty_ && comfortable_ && !underWay) fail("a sound pack is refused: " + done.error().message);
    return;
  }
  // Faults may let even a sound one fail, so the next drain does it once more.
  asset.damaged = asset.damaged || bad || faulty_;
  asset.contents.push_back(content);
  asset.before = before;
  forgetErrors(asset);
  for (Actor& actor : actors_) {
    if (&assets_[actor.asset] == &asset && packs_[content].frames != packs_[now].frames) {
      actor.clock.forget();
    }
  }
}

void Soak::changeBudgets() {
  const std::uint64_t gpu = std::uint64_t{1} << (16 + below(11));
  const std::uint64_t cpu = config_.stagingBytes + (std::uint64_t{1} << (18 + below(8)));
  streamer_->setBudget(gpu, cpu);
  // A smaller one holds as soon as the frames in flight allow: squeeze() waits for that.
  gpuBound_ = std::max(gpuBound_, gpu);
  cpuBound_ = std::max(cpuBound_, cpu);
  comfortable_ = false;
}

void Soak::squeeze() {
  clearFaults();
  if (!attached_) return;
  const std::uint64_t gpu = std::uint64_t{1} << (18 + below(8));
  const std::uint64_t cpu = config_.stagingBytes + (std::uint64_t{1} << (20 + below(6)));
  streamer_->setBudget(gpu, cpu);
  gpuBound_ = std::max(gpuBound_, gpu);
  cpuBound_ = std::max(cpuBound_, cpu);
  comfortable_ = false;
  const auto begin = std::chrono::steady_clock::now();
  for (;;) {
    update(1.0 / 60);
    const runtime::StreamStats stats = streamer_->stats();
    if (stats.gpuAllocated <= gpu && stats.cpuBytes <= cpu) break;
    if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(60)) {
      fail(fmt::format("a minute after budgets of {} and {} bytes were set, {} and {} are held", gpu, cpu,
                       stats.gpuAllocated, stats.cpuBytes));
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  gpuBound_ = gpu;
  cpuBound_ = cpu;
  VulkanFaults::get().resetPeak();
  allocator_->resetPeak();
}

void Soak::setFaults() {
  faulty_ = true;
  switch (below(6)) {
    case 0:
      stalled_ = false;
      return disk_->setFaults({.failures = share() * 0.2});
    case 1:
      // What is not verified is drawn as it was read.
      if (config_.verify != runtime::Verify::always) comparable_ = false;
      stalled_ = false;
      return disk_->setFaults({.flips = share() * 0.2});
    case 2:
      stalled_ = true;
      return disk_->setFaults({.stalled = true});
    case 3:
      return allocator_->setFailures(share() * 0.1);
    case 4:
      return VulkanFaults::get().setFaults({.outOfMemory = share()});
    default:
      return jobs_->pause(true);
  }
}

// As the host sees it: calls fail for a while, then it gives the device up and goes on with another one.
void Soak::loseDevice() {
  if (!attached_) return;
  finishSnapshot();
  faulty_ = true;
  ++counts_.losses;
  VulkanFaults::get().setFaults({.deviceLost = true});
  for (std::uint32_t i = 2 + below(20); i > 0; --i) {
    updateOnce();
    takeErrors();
  }
  reattach();
}

void Soak::reattach() {
  finishSnapshot();
  // detach() waits for reads in flight.
  if (stalled_) disk_->setFaults({});
  stalled_ = false;
  if (attached_) {
    // The device was not lost in truth: what it still does must end before its objects go.
    device_->vk.vkDeviceWaitIdle(device_->host.device);
    streamer_->detach();
    dropRenderer();
    for (Actor& actor : actors_) actor.seen = false;
    attached_ = false;
    for (std::uint32_t i = below(4); i > 0; --i) update(1.0 / 60);
  }
  VulkanFaults::get().setFaults({});
  makeRenderer();
  const auto done = streamer_->attach(*renderer_);
  if (!done && !faulty_) fail("attach: " + done.error().message);
  if (!done) return dropRenderer();
  measureBaseline();
  attached_ = true;
  ++counts_.attaches;
}

// What a host should not do, and what must not hurt.
void Soak::nonsense() {
  const runtime::InstanceId stranger{static_cast<std::uint32_t>(random_() | 0x80000000u)};
  const runtime::AssetId foreign{static_cast<std::uint32_t>(random_() | 0x80000000u)};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  switch (below(7)) {
    case 0:
      streamer_->removeInstance(stranger);
      return streamer_->seek(stranger, 1);
    case 1:
      require(streamer_->drawable(stranger).count == 0, "a stranger is drawn");
      return streamer_->close(foreign);
    case 2:
      return require(!streamer_->addInstance({.asset = foreign}), "an instance of no asset");
    case 3:
      return require(streamer_->pack(foreign) == nullptr, "a pack of no asset");
    case 4:
      return require(!streamer_->open({.path = folder_ + "/nothing.blw"}), "a pack that is not there");
    case 5:
      if (actors_.empty()) return;
      streamer_->seek(actors_[0].id, nan);
      return streamer_->setPlayback(actors_[0].id, {.speed = nan});
    default:
      if (assets_.empty()) return;
      return require(!streamer_->addInstance({.asset = assets_[0].id, .volume = 99}), "an instance of no volume");
  }
}

}  // namespace billow::tests
