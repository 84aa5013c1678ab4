#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "soak.h"

namespace billow::tests {

void Soak::fail(const std::string& what) const {
  fmt::print(stderr, "billow_stream_soak: seed {}, operation {}, session {}: {}\n{}\n", options_.seed,
             counts_.operations, counts_.sessions, what, summary());
  std::fflush(stderr);
  std::_Exit(1);  // threads still run
}

void Soak::check() {
  checkMemory();
  for (std::size_t i = 0; i < assets_.size(); ++i) {
    Asset& asset = assets_[i];
    const auto state = streamer_->state(asset.id);
    require(state != runtime::Streamer::AssetState::unknown, "an open asset is not known");
    if (asset.opening && state == runtime::Streamer::AssetState::ready) asset.opening = false;
    if (state != runtime::Streamer::AssetState::failed) continue;
    require(faulty_ || !comfortable_, "a sound pack could not be opened");
    ++counts_.refused;
    streamer_->close(asset.id);
    forgetAsset(i--);
  }
  std::uint32_t held = 0, coarse = 0, empty = 0, wanted = 0;
  for (Actor& actor : actors_) {
    checkActor(actor);
    if (!(actor.priority > 0)) continue;
    const runtime::Drawable drawable = streamer_->drawable(actor.id);
    ++wanted;
    held += drawable.held ? 1 : 0;
    coarse += drawable.coarse ? 1 : 0;
    empty += drawable.count == 0 ? 1 : 0;
  }
  const runtime::StreamStats stats = streamer_->stats();
  counts_.loaded += stats.framesLoaded;
  counts_.evicted += stats.framesEvicted;
  if (!attached_) return;
  if (stats.instances != wanted || stats.instancesHeld != held || stats.instancesCoarse != coarse ||
      stats.instancesEmpty != empty) {
    fail(fmt::format("the stats count {} instances, held {}, coarse {}, empty {}; there are {}, {}, {}, {}",
                     stats.instances, stats.instancesHeld, stats.instancesCoarse, stats.instancesEmpty, wanted, held,
                     coarse, empty));
  }
}

void Soak::checkMemory() {
  const runtime::StreamStats stats = streamer_->stats();
  if (stats.gpuAllocated > gpuBound_ || stats.cpuBytes > cpuBound_) {
    fail(fmt::format("the stats say {} bytes of the GPU and {} of the CPU; allowed are {} and {}", stats.gpuAllocated,
                     stats.cpuBytes, gpuBound_, cpuBound_));
  }
  const VulkanFaults::Stats device = VulkanFaults::get().stats();
  const CountingAllocator::Stats memory = allocator_->stats();
  if (attached_) {
    if (device.devicePeak > gpuBaseline_ + gpuBound_) {
      fail(fmt::format("{} bytes of the device were held ({} now, {} by the stats), {} allowed",
                       device.devicePeak - gpuBaseline_, device.deviceBytes - gpuBaseline_, stats.gpuAllocated,
                       gpuBound_));
    }
    const std::uint64_t host = device.hostBytes > hostBaseline_ ? device.hostBytes - hostBaseline_ : 0;
    if (memory.peak + host > cpuBound_) {
      fail(fmt::format("{} bytes of the host's allocator and {} of staging memory were held, {} allowed", memory.peak,
                       host, cpuBound_));
    }
  }
  require(memory.wrong == 0, "memory was given back with another size or alignment");
  VulkanFaults::get().resetPeak();
  allocator_->resetPeak();
}

void Soak::checkActor(Actor& actor) {
  const runtime::Drawable drawable = streamer_->drawable(actor.id);
  ++counts_.shown;
  if (drawable.count == 0) {
    ++counts_.empty;
    require(!drawable.held, "nothing is held");
    // Without priority it misses reloads, and gets something when it has some again.
    if (!(actor.priority > 0)) actor.seen = false;
    if (!actor.seen || assets_[actor.asset].contents.size() > 1) return;
    ++counts_.holes;
    require(!comfortable_ || faulty_, "what was drawn is gone, with room for all");
    return;
  }
  require(attached_, "something is drawn without a device");
  actor.seen = true;
  counts_.held += drawable.held ? 1 : 0;
  counts_.coarse += drawable.coarse ? 1 : 0;
  counts_.full += drawable.held || drawable.coarse ? 0 : 1;
  checkLayers(drawable);
  if (drawable.held) return;
  if (actor.clock.agrees(drawable.time)) return;
  std::string times;
  for (const double time : actor.clock.times()) times += fmt::format(" {}", time);
  const runtime::Playback& playback = actor.clock.playback();
  fail(fmt::format("instance {:#x} of {} frames, speed {}, loop {}, shows {} s, not{}", actor.id.value,
                   packs_[assets_[actor.asset].contents.back()].frames, playback.speed, static_cast<int>(playback.loop),
                   drawable.time, times));
}

void Soak::checkLayers(const runtime::Drawable& drawable) const {
  require(drawable.count <= runtime::kMostLayers, "too many layers");
  require(std::isfinite(drawable.time) && drawable.time >= 0, "the time is outside of the volume");
  float sum = 0;
  for (std::uint32_t i = 0; i < drawable.count; ++i) {
    const runtime::Layer& layer = drawable.layers[i];
    require(layer.frame != nullptr, "a layer without a frame");
    require(layer.frame->stats().allocatedBytes < std::uint64_t{1} << 30, "a layer's frame is none");
    require(layer.weight >= 0 && layer.weight <= 1, "a weight outside of [0, 1]");
    require(std::isfinite(layer.advect), "a layer is carried nowhere");
    sum += layer.weight;
  }
  require(std::abs(sum - 1) < 1e-5f, "weights do not sum to 1");
}

// Of an instance that is shown in full, what its frames must be follows from its time alone.
void Soak::takeSnapshot() {
  if (snapshot_ || !attached_ || viewed_ || !comparable_) return;
  update(0);  // what is drawn is by the playback of the update before
  if (actors_.empty()) return;
  const Actor& actor = actors_[below(static_cast<std::uint32_t>(actors_.size()))];
  const runtime::Drawable drawable = streamer_->drawable(actor.id);
  if (drawable.count == 0 || drawable.coarse || drawable.held) return;
  Snapshot snapshot;
  snapshot.contents = assets_[actor.asset].contents;
  const SoakPack& pack = packs_[snapshot.contents.back()];
  for (const std::size_t content : snapshot.contents) {
    if (packs_[content].frames != pack.frames) return;
  }
  const SoakMoment moment = soakMoment(pack, actor.clock.playback(), drawable.time);
  const bool half = std::abs(moment.share - 0.5) < 1e-3;  // which layer is which cannot be told by weights
  if (!moment.certain || drawable.count > 2 || (drawable.count == 2 && half)) {
    ++counts_.unclear;
    return;
  }
  for (std::uint32_t i = 0; i < drawable.count; ++i) {
    const double weight = drawable.layers[i].weight;
    const bool second = drawable.count == 2 && std::abs(weight - moment.share) < std::abs(weight - 1 + moment.share);
    if (drawable.count == 2) {
      require(std::abs(weight - (second ? moment.share : 1 - moment.share)) < 1e-4, "a weight is not the moment's");
    }
    snapshot.frames.push_back(second ? moment.b : moment.a);
    // Of two one may not have come yet.
    if (drawable.count == 1 && moment.share > 0) snapshot.other = moment.b;
    snapshot.weights.push_back(drawable.layers[i].weight);
    const runtime::FrameStats& stats = drawable.layers[i].frame->stats();
    snapshot.bricks.push_back(stats.bc7Bricks + stats.bufferBricks);
    snapshot.what +=
        fmt::format(" {} of weight {}, {} bricks;", snapshot.frames.back(), weight, snapshot.bricks.back());
  }
  const runtime::Playback& playback = actor.clock.playback();
  snapshot.what = fmt::format("instance {:#x} of pack {} at {} s, speed {}, loop {}, interpolation {}: frames{}{}{}",
                              actor.id.value, snapshot.contents.back(), drawable.time, playback.speed,
                              static_cast<int>(playback.loop), static_cast<int>(playback.interpolation), snapshot.what,
                              comfortable_ ? "" : " budgets are small;", faulty_ ? " there are faults;" : "");
  auto pending = painter_->record({drawable.layers.data(), drawable.count}, streamer_->wait());
  if (!pending) fail("a picture: " + pending.error().message);
  snapshot.pending = std::move(*pending);
  snapshot.updatesLeft = config_.framesInFlight - 1;
  snapshot_ = std::move(snapshot);
}

void Soak::finishSnapshot() {
  if (!snapshot_) return;
  const Snapshot snapshot = std::move(*snapshot_);
  snapshot_.reset();
  const auto picture = snapshot.pending->picture();
  if (!picture) fail(picture.error().message);
  const auto equals = [&](std::size_t content) {
    if (reference(content, snapshot, snapshot.frames) == *picture) return true;
    return snapshot.other && reference(content, snapshot, {*snapshot.other}) == *picture;
  };
  if (std::none_of(snapshot.contents.begin(), snapshot.contents.end(), equals)) {
    const std::vector<float> wanted = reference(snapshot.contents.back(), snapshot, snapshot.frames);
    if (wanted.empty()) fail("a frame is not drawn coarser, yet has not its bricks: " + snapshot.what);
    float most = 0;
    std::size_t apart = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      most = std::max(most, std::abs(wanted[i] - (*picture)[i]));
      apart += wanted[i] != (*picture)[i] ? 1 : 0;
    }
    fail(fmt::format(
        "a picture is not that of a freshly opened pack, {} floats differ by up to {}: {}", apart, most,
        snapshot.what +
            (reference(snapshot.contents.back(), snapshot, snapshot.frames) == wanted ? "" : " (nor is that)")));
  }
  ++counts_.pictures;
  const auto& floats = *picture;
  counts_.lit += std::any_of(floats.begin(), floats.end(), [](float value) { return value > 0.01f; }) ? 1 : 0;
}

// Empty where the frames have not the bricks that are drawn.
std::vector<float> Soak::reference(std::size_t content, const Snapshot& snapshot,
                                   const std::vector<std::uint32_t>& numbers) {
  auto pack = format::Pack::open(format::makeMemorySource(packs_[content].bytes));
  if (!pack) fail(toString(pack.error()));
  std::vector<std::unique_ptr<runtime::Frame>> frames;
  std::vector<runtime::Layer> layers;
  runtime::UploadWait wait{.semaphore = referenceRenderer_->uploadSemaphore()};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    auto frame = referenceRenderer_->upload(*pack, 0, numbers[i], {});
    if (!frame) fail("upload: " + frame.error().message);
    const runtime::FrameStats& stats = (*frame)->stats();
    if (stats.bc7Bricks + stats.bufferBricks != snapshot.bricks[i]) {
      device_->vk.vkDeviceWaitIdle(device_->host.device);  // uploads
      return {};
    }
    layers.push_back({.frame = frame->get(), .weight = snapshot.weights[i]});
    wait.value = std::max(wait.value, (*frame)->uploadValue());
    frames.push_back(std::move(*frame));
  }
  auto pending = referencePainter_->record(layers, wait);
  if (!pending) fail("the picture to compare with: " + pending.error().message);
  auto picture = (*pending)->picture();
  if (!picture) fail(picture.error().message);
  return std::move(*picture);
}

}  // namespace billow::tests
