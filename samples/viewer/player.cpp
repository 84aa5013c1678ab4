#include "player.h"

#include <algorithm>

namespace billow::viewer {
namespace {

constexpr std::uint32_t kAhead = 6;      // frames that are loaded before they are due
constexpr std::size_t kMostFrames = 16;  // of a volume, on the device

}  // namespace

Player::Player(runtime::Renderer& renderer, const command::Contents& contents, std::uint64_t budget,
               std::uint32_t framesInFlight)
    : renderer_(renderer),
      contents_(contents),
      budget_(budget),
      framesInFlight_(framesInFlight),
      residents_(contents.volumes().size()) {}

command::Checked<std::vector<const runtime::Frame*>> Player::update(double time, double velocity) {
  ++updates_;
  std::vector<const runtime::Frame*> shown;
  for (std::size_t volume = 0; volume < residents_.size(); ++volume) {
    const auto number = contents_.volumes()[volume].frameAt(time);
    shown.push_back(nullptr);
    if (!number) continue;
    if (!residents_[volume].contains(*number) && updates_ > 1) ++late_;
    const auto resident = load(volume, *number);
    if (!resident) return tl::unexpected(resident.error());
    (*resident)->used = updates_;
    shown.back() = (*resident)->frame.get();
  }
  if (auto done = prefetch(time, velocity); !done) return tl::unexpected(done.error());
  return shown;
}

// One frame that is due soon.
command::Checked<void> Player::prefetch(double time, double velocity) {
  waiting_ = false;
  for (std::size_t volume = 0; volume < residents_.size(); ++volume) {
    const command::PlacedVolume& placed = contents_.volumes()[volume];
    const auto now = placed.frameAt(time);
    const std::uint32_t count = placed.record().frameCount;
    if (!now || placed.still) continue;
    for (std::uint32_t ahead = 1; ahead <= std::min(kAhead, count - 1); ++ahead) {
      const std::uint32_t frame = velocity < 0 ? (*now + count - ahead) % count : (*now + ahead) % count;
      if (residents_[volume].contains(frame)) continue;
      if (bytes() > budget_ / 2) return {};
      waiting_ = true;
      const auto loaded = load(volume, frame);
      if (!loaded) return tl::unexpected(loaded.error());
      return {};
    }
  }
  return {};
}

command::Checked<Player::Resident*> Player::load(std::size_t volume, std::uint32_t frame) {
  Residents& residents = residents_[volume];
  if (const auto found = residents.find(frame); found != residents.end()) return &found->second;
  if (residents.size() >= kMostFrames) makeRoom(volume, frame);
  const command::PlacedVolume& placed = contents_.volumes()[volume];
  for (;;) {
    auto made = renderer_.upload(*placed.pack, placed.number, frame, {.grids = placed.grids});
    if (made) {
      uploadValue_ = std::max(uploadValue_, (*made)->uploadValue());
      return &(residents[frame] = {std::move(*made), updates_});
    }
    if (made.error().code != runtime::ErrorCode::budget || !makeRoom(volume, frame)) {
      return tl::unexpected(command::toRefusal(made.error(), placed.request->pack));
    }
  }
}

// Lets the frame go that was not drawn for longest; false where all are in use.
bool Player::makeRoom(std::size_t volume, std::uint32_t wanted) {
  Residents& residents = residents_[volume];
  auto oldest = residents.end();
  for (auto it = residents.begin(); it != residents.end(); ++it) {
    if (it->first == wanted || it->second.used + framesInFlight_ >= updates_) continue;
    if (oldest == residents.end() || it->second.used < oldest->second.used) oldest = it;
  }
  if (oldest == residents.end()) return false;
  residents.erase(oldest);
  return true;
}

std::uint64_t Player::bytes() const {
  std::uint64_t sum = 0;
  for (const Residents& residents : residents_) {
    for (const auto& [number, resident] : residents) sum += resident.frame->stats().allocatedBytes;
  }
  return sum;
}

Residency Player::residency() const {
  Residency residency{.frames = {}, .bytes = bytes(), .resident = 0, .late = late_};
  for (const Residents& residents : residents_) residency.resident += static_cast<std::uint32_t>(residents.size());
  if (residents_.empty()) return residency;
  residency.frames.resize(contents_.volumes()[0].record().frameCount);
  for (const auto& [number, resident] : residents_[0]) residency.frames[number] = true;
  return residency;
}

}  // namespace billow::viewer
