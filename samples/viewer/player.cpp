#include "player.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace billow::viewer {
namespace {

constexpr double kSettling = 0.5;  // seconds without a change after which nothing more is expected
// Until what planning says is of this moment: updates while it moves, seconds without a change while it stands.
constexpr std::uint32_t kTelling = 3;
constexpr double kQuiet = 0.25;
constexpr double kWatching = 0.5;                                // seconds between two looks at the packs' files
constexpr std::uint64_t kLeastRing = 64 << 10, kRing = 8 << 20;  // of staging, bytes

bool sameLayers(const runtime::Drawable& a, const runtime::Drawable& b) {
  return a.count == b.count && std::equal(a.layers.begin(), a.layers.begin() + a.count, b.layers.begin(),
                                          [](const runtime::Layer& x, const runtime::Layer& y) {
                                            return x.frame == y.frame && x.weight == y.weight && x.advect == y.advect;
                                          });
}

}  // namespace

command::Checked<std::unique_ptr<Player>> Player::make(runtime::Renderer& renderer, const command::Contents& contents,
                                                       const command::RenderRequest& request,
                                                       const StreamBudgets& budgets, std::uint32_t framesInFlight) {
  std::unique_ptr<Player> player(new Player(contents, request, budgets));
  auto streamer = runtime::Streamer::create(renderer, {.gpuBudget = budgets.gpu,
                                                       .cpuBudget = budgets.cpu,
                                                       .stagingBytes = std::clamp(budgets.cpu / 4, kLeastRing, kRing),
                                                       .framesInFlight = framesInFlight});
  if (!streamer) return tl::unexpected(command::toRefusal(streamer.error(), ""));
  player->streamer_ = std::move(*streamer);
  for (std::size_t i = 0; i < contents.volumes().size(); ++i) {
    if (auto opened = player->open(contents.volumes()[i]); !opened) return tl::unexpected(opened.error());
    const auto instance = player->addInstance(i, {});
    if (!instance) return tl::unexpected(command::toRefusal(instance.error(), contents.volumes()[i].request->pack));
    player->tracks_.push_back({.instance = *instance, .next = {}, .clock = {}});
  }
  player->drawables_.resize(player->tracks_.size());
  return player;
}

command::Checked<void> Player::open(const command::PlacedVolume& volume) {
  const std::string& path = volume.request->pack;
  if (assets_.contains(path)) return {};
  FileWatch file(path);  // from before it is read
  const auto asset = streamer_->open({.path = path});
  if (!asset) return tl::unexpected(command::toRefusal(asset.error(), path));
  assets_.emplace(path, Asset{*asset, std::move(file), streamer_->pack(*asset)});
  return {};
}

runtime::Result<runtime::InstanceId> Player::addInstance(std::size_t volume, const Clock& clock) {
  const command::PlacedVolume& placed = contents_.volumes()[volume];
  return streamer_->addInstance({.asset = assets_.at(placed.request->pack).id,
                                 .volume = placed.number,
                                 .grids = placed.grids,
                                 .time = clock.time,
                                 .playback = clock.playback,
                                 .objectToWorld = placed.request->transform,
                                 .priority = clock.wanted ? 1.0f : 0.0f});
}

void Player::update(const Timeline& timeline, double seconds, const Seen& seen) {
  const bool jumped = follow(timeline);
  // Who has been sent to this moment is there.
  streamer_->update({.seconds = jumped ? 0 : seconds, .view = seen.view, .pixelsHigh = seen.pixelsHigh});
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> passed = now - std::exchange(updated_, now);
  traffic_.add(streamer_->stats(), passed.count());
  swapGrids();
  look();
  updates_ = jumped ? 0 : updates_ + 1;
  moving_ = timeline.velocity() != 0;
  quiet_ = jumped || changed_ ? 0 : quiet_ + seconds;
  watch(seconds);
}

// Tells the streamer where everything is to be; true where that does not follow from where it was.
bool Player::follow(const Timeline& timeline) {
  // A scene's loop is none of its volumes' own.
  bool jumped = seeks_ != timeline.seeks() || (request_.scene && jumps_ != timeline.jumps());
  seeks_ = timeline.seeks();
  jumps_ = timeline.jumps();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Clock clock = clockOf(contents_.volumes()[i], request_, timeline);
    jumped |= clock.part != tracks_[i].clock.part;
    tracks_[i].clock = clock;
  }
  for (const Track& track : tracks_) {
    for (const runtime::InstanceId instance : {track.instance, track.next}) {
      streamer_->setPlayback(instance, track.clock.playback);
      streamer_->setPriority(instance, track.clock.wanted ? 1.0f : 0.0f);
      if (jumped) streamer_->seek(instance, track.clock.time);
    }
  }
  return jumped;
}

// What draws other grids takes its place when it draws something, so that no picture is without.
void Player::swapGrids() {
  for (Track& track : tracks_) {
    if (track.next == runtime::InstanceId{} || streamer_->drawable(track.next).count == 0) continue;
    streamer_->removeInstance(std::exchange(track.instance, std::exchange(track.next, {})));
  }
}

void Player::look() {
  changed_ = false;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    runtime::Drawable drawable;
    if (tracks_[i].clock.shown) drawable = streamer_->drawable(tracks_[i].instance);
    changed_ |= !sameLayers(drawable, drawables_[i]);
    drawables_[i] = drawable;
  }
}

void Player::watch(double seconds) {
  for (auto& [path, asset] : assets_) {
    const format::Pack* pack = streamer_->pack(asset.id);
    renewed_ |= pack != asset.pack;
    asset.pack = pack;
  }
  unwatched_ += seconds;
  if (unwatched_ < kWatching) return;
  unwatched_ = 0;
  for (auto& [path, asset] : assets_) {
    asset.stale |= asset.file.changed();
    // Not while it is being reloaded: once more then.
    if (asset.stale && streamer_->reload(asset.id, {.path = path})) asset.stale = false;
  }
}

bool Player::complete() const {
  const runtime::StreamStats& stats = traffic_.now();
  const bool all = std::accumulate(stats.missingBricks.begin(), stats.missingBricks.end(), std::uint64_t{0}) == 0;
  const bool sharp = std::none_of(drawables_.begin(), drawables_.end(),
                                  [](const runtime::Drawable& shown) { return shown.held || shown.coarse; });
  const bool told = moving_ ? updates_ >= kTelling : quiet_ >= kQuiet;
  return told && all && sharp && stats.instancesEmpty == 0;
}

bool Player::waiting() const {
  const runtime::StreamStats& stats = traffic_.now();
  return quiet_ < kSettling || stats.loadsReading + stats.loadsDecoding + stats.loadsUploading > 0;
}

void Player::regrid(std::size_t volume) {
  Track& track = tracks_[volume];
  streamer_->removeInstance(track.next);
  const auto next = addInstance(volume, track.clock);
  track.next = next.value_or(runtime::InstanceId{});
  if (!next) errors_.push_back(next.error().message);
  // It has missed what the other played since.
  seeks_.reset();
}

void Player::setBudgets(const StreamBudgets& budgets) {
  budgets_ = budgets;
  streamer_->setBudget(budgets.gpu, budgets.cpu);
  quiet_ = 0;
}

std::vector<std::uint8_t> Player::residency() const {
  if (tracks_.empty()) return {};
  std::vector<std::uint8_t> frames(contents_.volumes()[0].record().frameCount);
  streamer_->residency(tracks_[0].instance, frames);
  return frames;
}

std::optional<std::string> Player::takeError() {
  if (!errors_.empty()) {
    std::string error = std::move(errors_.back());
    errors_.pop_back();
    return error;
  }
  const auto error = streamer_->takeError();
  if (!error) return std::nullopt;
  for (const auto& [path, asset] : assets_) {
    if (asset.id == error->asset) return path + ": " + error->message;
  }
  return error->message;
}

}  // namespace billow::viewer
