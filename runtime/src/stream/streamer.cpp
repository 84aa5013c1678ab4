#include "streamer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>

#include "api.h"
#include "asset_clips.h"
#include "checks.h"
#include "openings.h"
#include "planning.h"
#include "players.h"

namespace billow::runtime {
namespace {

constexpr double kLongestReload = 30;     // seconds until what is drawn must be resident of the new pack
constexpr double kMostPassing = 60;       // seconds of an update that count for what is not play
constexpr std::size_t kMostErrors = 256;  // that the host has not taken yet; the newest are dropped

struct Asset {
  AssetId id = {};
  Streamer::AssetState state = Streamer::AssetState::opening;
  Opened opened;
  AssetClips clips;
  // What is to take its place.
  bool reloading = false;
  bool told = false;  // of an error in it
  double waited = 0;  // seconds since it was open
  std::optional<Opened> next;
};

const char* badField(const StreamConfig& config) {
  if (config.gpuBudget == 0) return "gpuBudget";
  if (config.stagingBytes < (std::uint64_t{64} << 10) || config.stagingBytes > config.cpuBudget) return "stagingBytes";
  if (config.threads == 0 && config.jobs.submit == nullptr) return "threads, jobs";
  if ((config.allocator.allocate == nullptr) != (config.allocator.release == nullptr)) return "allocator";
  if (!(config.prefetchSeconds >= 0) || config.prefetchSeconds > 60) return "prefetchSeconds";
  return nullptr;
}

class StreamerImpl final : public Streamer {
 public:
  StreamerImpl(const StreamConfig& config, MakeTransport make, PlanOn on)
      : config_(config), make_(std::move(make)), planning_(on) {}

  ~StreamerImpl() override {
    drop();
    assets_.clear();
  }

  Result<void> connect(Device* device) {
    auto transport = make_(device, config_, {.call = &wake, .user = this});
    if (!transport) return tl::unexpected(transport.error());
    std::uint64_t bytes = 0;
    for (const auto& [id, asset] : assets_) {
      bytes += asset.opened.bytes + (asset.next ? asset.next->bytes : 0);
    }
    if (!(*transport)->reserveCpu(bytes)) {
      return failure(ErrorCode::budget, "the tables of the open packs do not fit into the CPU budget");
    }
    transport_ = std::move(*transport);
    openings_.start(*transport_);
    planning_.start(*transport_, config_);
    before_ = transport_->stats();
    return {};
  }

  Result<AssetId> open(const PackSource& source) override {
    return guarded<AssetId>([&]() -> Result<AssetId> {
      if (auto fits = checkSource(source); !fits) return tl::unexpected(fits.error());
      const AssetId id{nextAsset_++};
      auto opened = openings_.openHere(source, id);
      if (!opened) return tl::unexpected(opened.error());
      assets_[id.value].id = id;
      begin(assets_[id.value], std::move(*opened));
      log(LogLevel::information, "opened " + nameOf(source));
      return id;
    });
  }

  Result<AssetId> openLater(const PackSource& source) override {
    return guarded<AssetId>([&]() -> Result<AssetId> {
      if (auto fits = checkSource(source); !fits) return tl::unexpected(fits.error());
      const AssetId id{nextAsset_++};
      assets_[id.value].id = id;
      try {
        openings_.openLater(source, id, false);
      } catch (...) {
        assets_.erase(id.value);
        throw;
      }
      return id;
    });
  }

  AssetState state(AssetId asset) const override {
    const auto found = assets_.find(asset.value);
    return found == assets_.end() ? AssetState::unknown : found->second.state;
  }

  const format::Pack* pack(AssetId asset) const override {
    const auto found = assets_.find(asset.value);
    if (found == assets_.end() || found->second.state != AssetState::ready) return nullptr;
    return &found->second.opened.pack->pack;
  }

  Result<void> reload(AssetId id, const PackSource& source) override {
    return guarded<void>([&]() -> Result<void> {
      if (auto fits = checkSource(source); !fits) return tl::unexpected(fits.error());
      if (state(id) == AssetState::failed) {
        openings_.openLater(source, id, false);
        assets_[id.value].state = AssetState::opening;
        return {};
      }
      if (state(id) != AssetState::ready) return failure(ErrorCode::argument, "reload: the asset is not open");
      Asset& asset = assets_[id.value];
      if (asset.reloading) return failure(ErrorCode::argument, "reload: the asset is being reloaded");
      openings_.openLater(source, id, true);
      asset.reloading = true;
      asset.told = false;
      return {};
    });
  }

  void close(AssetId id) override {
    const auto found = assets_.find(id.value);
    if (found == assets_.end()) return;
    players_.removeOf(id);
    found->second.clips.close(homeOf(id));
    letGo(std::move(found->second.opened));
    if (found->second.next) letGo(std::move(*found->second.next));
    assets_.erase(found);
  }

  Result<InstanceId> addInstance(const InstanceInfo& info) override {
    return guarded<InstanceId>([&]() -> Result<InstanceId> {
      if (state(info.asset) != AssetState::ready) return failure(ErrorCode::argument, "the asset is not open");
      Asset& asset = assets_[info.asset.value];
      const auto clip = asset.clips.find(info, asset.opened, nextOf(asset), homeOf(asset.id));
      if (!clip) return tl::unexpected(clip.error());
      auto id = players_.add(info, *clip);
      if (!id) dropUnused(asset);
      if (id && asset.next) players_.setSuccessors(asset.id, asset.clips.successions());
      return id;
    });
  }

  void removeInstance(InstanceId instance) override {
    const InstanceView* view = players_.find(instance);
    if (view == nullptr) return;
    const AssetId asset = players_.track(view->clip).clip->asset;
    players_.remove(instance);
    dropUnused(assets_[asset.value]);
  }
  void setPlayback(InstanceId instance, const Playback& playback) override { players_.setPlayback(instance, playback); }
  void setTransform(InstanceId instance, const std::array<double, 12>& objectToWorld) override {
    players_.setTransform(instance, objectToWorld);
  }
  void setPriority(InstanceId instance, float priority) override { players_.setPriority(instance, priority); }
  void seek(InstanceId instance, double time) override { players_.seek(instance, time); }

  void setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) override {
    config_.gpuBudget = gpuBytes;
    config_.cpuBudget = cpuBytes;
    if (transport_ != nullptr) transport_->setBudget(gpuBytes, cpuBytes);
  }

  void update(const UpdateInfo& info) override {
    const auto done = guarded<void>([&]() -> Result<void> {
      advance(info);
      return {};
    });
    if (!done) tell({.code = done.error().code, .message = done.error().message + " in update()"});
  }

  Drawable drawable(InstanceId instance) const override { return players_.drawable(instance); }
  UploadWait wait() const override { return transport_ != nullptr ? transport_->wait() : UploadWait{}; }
  void residency(InstanceId instance, std::span<std::uint8_t> frames) const override {
    players_.residency(instance, frames);
  }
  StreamStats stats() const override { return stats_; }

  std::optional<StreamError> takeError() override {
    if (errors_.empty()) return std::nullopt;
    StreamError error = std::move(errors_.front());
    errors_.pop_front();
    return error;
  }

  void detach() override {
    drop();
    log(LogLevel::information, "detached from the device");
  }

  Result<void> attach(Renderer& renderer) override {
    return guarded<void>([&]() -> Result<void> {
      if (transport_ != nullptr) return failure(ErrorCode::argument, "attach: there is a device already");
      return connect(&deviceOf(renderer));
    });
  }

 private:
  static void wake(void* self) { static_cast<StreamerImpl*>(self)->planning_.request(); }

  static std::string nameOf(const PackSource& source) {
    return source.source != nullptr ? "a source of the host's" : source.path;
  }

  void log(LogLevel level, const std::string& line) const {
    if (config_.log.write != nullptr) config_.log.write(config_.log.user, level, line.c_str());
  }

  void tell(StreamError error) {
    // Where memory is short every load says so.
    const auto same = [&](const StreamError& known) { return known.code == error.code && known.asset == error.asset; };
    if (error.code == ErrorCode::memory && std::any_of(errors_.begin(), errors_.end(), same)) return;
    log(LogLevel::error, error.message);
    if (errors_.size() < kMostErrors) errors_.push_back(std::move(error));
  }

  Result<void> checkSource(const PackSource& source) const {
    if (transport_ == nullptr) return failure(ErrorCode::argument, "the streamer is detached");
    if (source.path.empty() == (source.source == nullptr)) {
      return failure(ErrorCode::argument, "PackSource: one of path and source must be given");
    }
    if (source.source == nullptr && config_.readThreads == 0) {
      return failure(ErrorCode::argument, "StreamConfig: without readThreads packs come from sources alone");
    }
    return {};
  }

  AssetClips::Home homeOf(AssetId asset) { return {asset, players_, transport_.get()}; }
  static Opened* nextOf(Asset& asset) { return asset.next ? &*asset.next : nullptr; }
  void dropUnused(Asset& asset) { asset.clips.dropUnused(asset.opened, nextOf(asset), homeOf(asset.id)); }

  void begin(Asset& asset, Opened opened) {
    asset.clips.open(opened, homeOf(asset.id));
    asset.opened = std::move(opened);
    asset.state = AssetState::ready;
  }

  // The host may use the pack until the next update().
  void letGo(Opened opened) {
    if (transport_ != nullptr) transport_->releaseCpu(opened.bytes);
    opened.bytes = 0;
    dying_.push_back(std::move(opened));
  }

  void takeOpened() {
    openings_.take(opened_);
    for (OpenDone& done : opened_) takeOpened(done);
    opened_.clear();
  }

  void takeOpened(OpenDone& done) {
    const auto found = assets_.find(done.asset.value);
    if (found == assets_.end()) {  // closed meanwhile
      if (done.opened) letGo(std::move(*done.opened));
      return;
    }
    Asset& asset = found->second;
    if (!done.opened) {
      tell({.code = done.opened.error().code, .asset = asset.id, .message = done.opened.error().message});
      if (done.reload) asset.reloading = false;
      if (!done.reload) asset.state = AssetState::failed;
      return;
    }
    if (!done.reload) return begin(asset, std::move(*done.opened));
    asset.next = std::move(*done.opened);
    asset.clips.openNext(asset.opened, *asset.next, homeOf(asset.id));
    asset.waited = 0;
    players_.setSuccessors(asset.id, asset.clips.successions());
    const auto& views = players_.views();
    const auto lacking = std::find_if(views.begin(), views.end(), [&](const InstanceView& view) {
      return players_.track(view.clip).clip->asset == asset.id && view.successor == format::kNone;
    });
    if (lacking == views.end()) return;
    const std::uint32_t volume = players_.track(lacking->clip).clip->volume;
    const auto& volumes = asset.next->pack->pack.volumes();
    const bool there = volume < volumes.size() && volumes[volume].frameCount != 0;
    const std::string what = there ? "tables for what is drawn of the new pack do not fit into the CPU budget"
                                   : "the new pack has no volume " + std::to_string(volume) + " with frames";
    tell({.code = there ? ErrorCode::budget : ErrorCode::pack,
          .asset = asset.id,
          .volume = volume,
          .message = what + "; the old one stays"});
    leaveNext(asset);
  }

  void abandonReload(Asset& asset) {
    if (!asset.told) {
      tell({.code = ErrorCode::pack, .asset = asset.id, .message = "the new pack cannot be drawn; the old one stays"});
    }
    leaveNext(asset);
  }

  void leaveNext(Asset& asset) {
    players_.setSuccessors(asset.id, {});
    asset.clips.closeNext(homeOf(asset.id));
    letGo(std::move(*asset.next));
    asset.next.reset();
    asset.reloading = false;
  }

  void finishReloads(double seconds) {
    for (auto& [id, asset] : assets_) {
      if (!asset.next) continue;
      asset.waited += std::min(seconds, kLongestUpdate);
      if (players_.successorFailed(asset.id)) {
        abandonReload(asset);
      } else if (players_.succeed(asset.id)) {
        asset.clips.succeed(homeOf(asset.id));
        letGo(std::exchange(asset.opened, std::move(*asset.next)));
        asset.next.reset();
        asset.reloading = false;
        log(LogLevel::information, "a reloaded pack has taken its place");
      } else if (asset.waited > kLongestReload) {
        abandonReload(asset);
      }
    }
  }

  void advance(const UpdateInfo& info) {
    const double seconds = std::isfinite(info.seconds) ? std::max(info.seconds, 0.0) : 0;
    now_ += std::clamp(seconds, kLeastPassing, kMostPassing);
    ++stats_.updates;
    bury();
    if (transport_ == nullptr) return players_.advance(seconds);
    transport_->update();
    planning_.take(changes_, met_, plan_);
    const std::size_t taken = players_.take(changes_, *transport_);
    changes_.erase(changes_.begin(), changes_.begin() + static_cast<std::ptrdiff_t>(taken));
    takeErrors();
    takeOpened();
    finishReloads(seconds);
    players_.advance(seconds);
    players_.giveBack(*transport_);
    if (planning_.wantsReport()) {
      fillReport(info);
      planning_.publish(report_);
    }
    planning_.request();
    count();
  }

  // Packs take their time to destroy, and a host's source may take more.
  void bury() {
    if (dying_.empty()) return;
    if (transport_ == nullptr) return dying_.clear();
    {
      const std::lock_guard lock(graveMutex_);
      std::move(dying_.begin(), dying_.end(), std::back_inserter(graves_));
    }
    dying_.clear();
    transport_->run(
        [](void* context) {
          auto& self = *static_cast<StreamerImpl*>(context);
          std::vector<Opened> graves;  // destroyed without the lock
          const std::lock_guard lock(self.graveMutex_);
          graves.swap(self.graves_);
        },
        this);
  }

  void takeErrors() {
    for (StreamError& error : met_) {
      const auto found = assets_.find(error.asset.value);
      if (found != assets_.end()) found->second.told = true;
      tell(std::move(error));
    }
    met_.clear();
  }

  void fillReport(const UpdateInfo& info) {
    report_.now = now_;
    report_.update = stats_.updates;
    report_.view = info.view;
    if (info.view && badView(*info.view) != nullptr) report_.view.reset();
    report_.pixelsHigh = info.pixelsHigh;
    report_.gpuBudget = config_.gpuBudget;
    players_.fill(report_);
  }

  void count() {
    const TransportStats now = transport_->stats();
    stats_.bytesRead = now.bytesRead - before_.bytesRead;
    stats_.bytesDecompressed = now.bytesDecompressed - before_.bytesDecompressed;
    stats_.bytesUploaded = now.bytesUploaded - before_.bytesUploaded;
    before_ = now;
    const RetiredCount retired = players_.retired();
    stats_.framesEvicted = retired.frames - retiredBefore_.frames;
    stats_.bytesEvicted = retired.bytes - retiredBefore_.bytes;
    retiredBefore_ = retired;
    stats_.framesLoaded = plan_.framesLoaded - loadedBefore_;
    loadedBefore_ = plan_.framesLoaded;
    stats_.gpuBytes = plan_.gpuBytes;
    stats_.gpuAllocated = now.gpuAllocated;
    stats_.gpuPeak = now.gpuPeak;
    stats_.cpuBytes = now.cpuBytes;
    stats_.cpuPeak = now.cpuPeak;
    stats_.framesResident = plan_.framesResident;
    stats_.loadsQueued = plan_.loadsQueued;
    stats_.loadsReading = plan_.loadsReading;
    stats_.loadsDecoding = plan_.loadsDecoding;
    stats_.loadsUploading = plan_.loadsUploading;
    stats_.missingBricks = plan_.missingBricks;
    const InstanceCount instances = players_.count();
    stats_.instances = instances.all;
    stats_.instancesHeld = instances.held;
    stats_.instancesCoarse = instances.coarse;
    stats_.instancesEmpty = instances.empty;
    stats_.framesLate = instances.late;
  }

  // Everything on the device is given back, or is about to be with the transport.
  void drop() {
    if (transport_ == nullptr) return;
    openings_.stop();
    takeOpened();
    planning_.stop();
    transport_->stop();
    planning_.clear();
    changes_.clear();
    met_.clear();
    report_ = {};
    players_.dropFrames();
    plan_ = {};
    loadedBefore_ = 0;
    transport_.reset();
    graves_.clear();
  }

  StreamConfig config_;
  MakeTransport make_;
  std::unique_ptr<Transport> transport_;
  Openings openings_;
  Planning planning_;
  Players players_;
  std::map<std::uint32_t, Asset> assets_;
  std::vector<Opened> dying_;
  std::mutex graveMutex_;
  std::vector<Opened> graves_;  // by graveMutex_; those of update()s before, which a job destroys
  std::uint32_t nextAsset_ = 1;
  double now_ = 0;
  // Scratch of update().
  std::vector<Change> changes_;
  std::vector<StreamError> met_;
  std::vector<OpenDone> opened_;
  Report report_;
  PlanStats plan_;
  TransportStats before_;
  RetiredCount retiredBefore_;
  std::uint32_t loadedBefore_ = 0;
  StreamStats stats_;
  std::deque<StreamError> errors_;
};

}  // namespace

Device& Streamer::deviceOf(Renderer& renderer) {
  return renderer.device();
}

Result<std::unique_ptr<Streamer>> makeStreamer(const StreamConfig& config, Device* device, MakeTransport make,
                                               PlanOn on) {
  if (const char* field = badField(config)) {
    return failure(ErrorCode::argument, std::string("StreamConfig: ") + field + " is outside of its range");
  }
  return guarded<std::unique_ptr<Streamer>>([&]() -> Result<std::unique_ptr<Streamer>> {
    auto streamer = std::make_unique<StreamerImpl>(config, std::move(make), on);
    if (auto connected = streamer->connect(device); !connected) return tl::unexpected(connected.error());
    return std::unique_ptr<Streamer>(std::move(streamer));
  });
}

}  // namespace billow::runtime
