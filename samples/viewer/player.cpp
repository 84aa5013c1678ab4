#include "player.h"

#include <algorithm>
#include <utility>

namespace billow::viewer {
namespace {

constexpr std::uint32_t kAhead = 6;   // frames that are loaded before they are due
constexpr float kLeastShare = 1e-4f;  // of a frame in a moment; less is not worth a frame

}  // namespace

Player::Player(runtime::Renderer& renderer, const command::Contents& contents, std::uint64_t budget,
               std::uint32_t framesInFlight, Interpolation interpolation)
    : renderer_(renderer),
      contents_(contents),
      budget_(budget),
      framesInFlight_(framesInFlight),
      interpolation_(interpolation),
      volumes_(contents.volumes().size()),
      shown_(contents.volumes().size()) {}

const std::vector<runtime::Drawable>& Player::update(double time, double velocity) {
  ++updates_;
  for (std::size_t i = 0; i < volumes_.size(); ++i) {
    runtime::Drawable next = drawableOf(i, time);
    if (next.held) {
      next = shown_[i];
      next.held = true;
      ++late_;
    }
    touch(next);
    shown_[i] = next;
  }
  prefetch(time, velocity);
  return shown_;
}

// Held where a frame that it needs is not there.
runtime::Drawable Player::drawableOf(std::size_t volume, double time) {
  runtime::Drawable drawable;
  for (const command::FrameShare& share : contents_.volumes()[volume].framesAt(time, interpolation_)) {
    if (share.weight < kLeastShare) continue;
    const runtime::Frame* frame = load(volume, share.frame);
    drawable.held |= frame == nullptr;
    drawable.layers[drawable.count++] = {frame, share.weight, share.advect};
  }
  if (drawable.count == 1) drawable.layers[0] = {.frame = drawable.layers[0].frame};
  return drawable;
}

// One frame that is due soon.
void Player::prefetch(double time, double velocity) {
  waiting_ = false;
  for (std::size_t i = 0; i < volumes_.size() && bytes() < budget_ / 2; ++i) {
    const command::PlacedVolume& placed = contents_.volumes()[i];
    const auto shown = placed.framesAt(time, Interpolation::hold);
    const std::uint32_t count = placed.record().frameCount;
    if (shown.empty() || placed.still) continue;
    for (std::uint32_t ahead = 1; ahead <= std::min(kAhead, count - 1); ++ahead) {
      const std::uint32_t frame = (shown[0].frame + (velocity < 0 ? count - ahead : ahead)) % count;
      if (volumes_[i].residents.contains(frame) || volumes_[i].failed.contains(frame)) continue;
      load(i, frame);
      waiting_ = true;
      return;
    }
  }
}

// Null where it cannot be loaded, which is told once.
const runtime::Frame* Player::load(std::size_t volume, std::uint32_t frame) {
  Volume& known = volumes_[volume];
  if (const auto found = known.residents.find(frame); found != known.residents.end()) {
    found->second.used = updates_;
    return found->second.frame.get();
  }
  if (known.failed.contains(frame)) return nullptr;
  const command::PlacedVolume& placed = contents_.volumes()[volume];
  runtime::GridChoice grids = placed.grids;
  if (interpolation_ == Interpolation::advect) grids = runtime::withVelocity(*placed.pack, placed.record(), grids);
  while (bytes() > budget_ && makeRoom()) {
  }
  for (;;) {
    auto made = renderer_.upload(*placed.pack, placed.number, frame, {.grids = grids});
    if (made) {
      uploadValue_ = std::max(uploadValue_, (*made)->uploadValue());
      return (known.residents[frame] = {std::move(*made), updates_}).frame.get();
    }
    if (made.error().code == runtime::ErrorCode::budget && makeRoom()) continue;
    known.failed.insert(frame);
    errors_.push_back(command::toRefusal(made.error(), placed.request->pack).message);
    return nullptr;
  }
}

// Lets the frame go that was not drawn for longest; false where all are in use.
bool Player::makeRoom() {
  Volume* from = nullptr;
  std::uint32_t oldest = 0;
  std::uint64_t used = updates_ > framesInFlight_ ? updates_ - framesInFlight_ : 0;
  for (Volume& volume : volumes_) {
    for (const auto& [number, resident] : volume.residents) {
      if (resident.used >= used) continue;
      from = &volume;
      oldest = number;
      used = resident.used;
    }
  }
  if (from != nullptr) from->residents.erase(oldest);
  return from != nullptr;
}

// What is drawn now stays.
void Player::touch(const runtime::Drawable& drawable) {
  for (Volume& volume : volumes_) {
    for (auto& [number, resident] : volume.residents) {
      for (std::uint32_t i = 0; i < drawable.count; ++i) {
        if (drawable.layers[i].frame == resident.frame.get()) resident.used = updates_;
      }
    }
  }
}

std::uint64_t Player::bytes() const {
  std::uint64_t sum = 0;
  for (const Volume& volume : volumes_) {
    for (const auto& [number, resident] : volume.residents) sum += resident.frame->stats().allocatedBytes;
  }
  return sum;
}

Residency Player::residency() const {
  Residency residency{.frames = {}, .bytes = bytes(), .resident = 0, .late = late_};
  for (const Volume& volume : volumes_) residency.resident += static_cast<std::uint32_t>(volume.residents.size());
  if (volumes_.empty()) return residency;
  residency.frames.resize(contents_.volumes()[0].record().frameCount);
  for (const auto& [number, resident] : volumes_[0].residents) residency.frames[number] = true;
  return residency;
}

std::optional<std::string> Player::takeError() {
  if (errors_.empty()) return std::nullopt;
  std::string error = std::move(errors_.front());
  errors_.pop_front();
  return error;
}

}  // namespace billow::viewer
