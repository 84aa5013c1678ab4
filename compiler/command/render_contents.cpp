#include "render_contents.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "billow/format/affine.h"
#include "billow/format/similarity.h"
#include "command.h"
#include "pack_lookup.h"

namespace billow::command {
namespace {

// What the command line asks for and is not there is its fault, what a scene names is the scene's.
tl::unexpected<Refusal> missing(const std::string& place, const std::string& pack, const std::string& message) {
  if (place.empty()) return tl::unexpected(Refusal{kCommandLine, fmt::format("{}: {}", pack, message)});
  return tl::unexpected(Refusal{kInvalid, fmt::format("{}: {}: {}", place, pack, message)});
}

Checked<runtime::GridChoice> findGrids(const format::Pack& pack, const format::VolumeRecord& volume,
                                       const VolumeRequest& request) {
  runtime::GridChoice choice = runtime::chooseGrids(pack, volume);
  const std::pair<const std::optional<std::string>*, std::uint32_t*> roles[] = {
      {&request.grids.extinction, &choice.extinction},
      {&request.grids.temperature, &choice.temperature},
      {&request.grids.flames, &choice.flames}};
  for (const auto& [name, field] : roles) {
    if (!*name) continue;
    const std::ptrdiff_t grid = findGrid(pack, volume, **name);
    if (grid < 0 && **name != "none") {
      return missing(request.place, request.pack,
                     fmt::format("the volume has no grid \"{}\"; it has {}", **name, gridNames(pack, volume)));
    }
    *field = grid < 0 ? format::kNone : static_cast<std::uint32_t>(grid);
  }
  return choice;
}

std::array<std::uint32_t, 3> numbersOf(const runtime::GridChoice& grids) {
  return {grids.extinction, grids.temperature, grids.flames};
}

// The present grid frames, and how their indices lie in the scene.
template <class Visit>
void forEachGridFrame(const PlacedVolume& volume, const Visit& visit) {
  const format::VolumeRecord& record = volume.record();
  for (std::uint32_t frame = 0; frame < record.frameCount; ++frame) {
    for (const std::uint32_t grid : numbersOf(volume.grids)) {
      if (grid == format::kNone) continue;
      const format::GridFrame& gridFrame = volume.pack->gridFrame(record, frame, grid);
      if ((gridFrame.flags & format::kGridPresent) == 0) continue;
      double indexToScene[12];
      format::compose(volume.request->transform, gridFrame.indexToWorld, indexToScene);
      visit(frame, indexToScene);
    }
  }
}

// A transform that can be turned round may still take a pack's own out of range.
Checked<void> checkTransform(const PlacedVolume& volume) {
  std::optional<std::uint32_t> bad;
  forEachGridFrame(volume, [&](std::uint32_t frame, const double(&indexToScene)[12]) {
    if (!format::invertible(indexToScene)) bad = bad.value_or(frame);
  });
  if (!bad) return {};
  const std::int32_t number = volume.pack->framesOf(volume.record())[*bad].number;
  return missing(volume.request->place, volume.request->pack,
                 fmt::format("the transform and that of frame {} together cannot be turned round", number));
}

}  // namespace

double PlacedVolume::scale() const {
  double matrix[12];
  std::copy(request->transform.begin(), request->transform.end(), matrix);
  return std::cbrt(std::abs(format::determinant(matrix)));
}

std::vector<FrameShare> PlacedVolume::framesAt(double seconds, runtime::Interpolation interpolation) const {
  if (still) return {{*still}};
  const auto frames = pack->framesOf(record());
  if (frames.empty()) return {};
  const auto rate = static_cast<double>(record().framesPerSecond);
  const double frameTime = 1 / rate;
  double time = (seconds - request->begin) * (request->framesPerSecond.value_or(rate) / rate);
  time += 1e-6 * frameTime;  // what rounding takes away must not cost a frame
  const double length = frames.back().time + frameTime;
  if (!(time >= 0)) return {};
  if (time >= length && request->after == AfterLast::vanish) return {};
  if (request->after == AfterLast::loop) time = std::fmod(time, length);
  const auto next = std::upper_bound(frames.begin(), frames.end(), time,
                                     [](double t, const format::FrameRecord& frame) { return t < frame.time; });
  if (next == frames.begin()) return {};
  const auto before = static_cast<std::uint32_t>(next - frames.begin() - 1);
  if (interpolation == runtime::Interpolation::hold || next == frames.end()) return {{before}};
  const double since = time - frames[before].time, until = next->time - time;
  const auto share = static_cast<float>(since / (since + until));
  const bool carried = interpolation == runtime::Interpolation::advect;
  return {{before, 1 - share, carried ? static_cast<float>(since) : 0},
          {before + 1, share, carried ? static_cast<float>(-until) : 0}};
}

runtime::WorldBox PlacedVolume::box() const {
  const std::uint32_t first = still.value_or(0), last = still.value_or(std::max(record().frameCount, 1u) - 1);
  return runtime::worldBox(*pack, record(), grids, first, last, request->transform);
}

Checked<Contents> Contents::find(const RenderRequest& request) {
  Contents contents;
  for (const VolumeRequest& volume : request.volumes) {
    if (auto added = contents.addVolume(volume, request.interpolate); !added) return tl::unexpected(added.error());
  }
  for (const EffectRequest& effect : request.effects) {
    if (auto added = contents.addEffect(effect); !added) return tl::unexpected(added.error());
  }
  const std::size_t maps = contents.tables().maps.size();
  if (maps > format::kMaxMaps) {
    return tl::unexpected(Refusal{kInvalid, fmt::format("the effects have {} displacement maps; expected at most {} of "
                                                        "all together",
                                                        maps, format::kMaxMaps)});
  }
  return contents;
}

Checked<const format::Pack*> Contents::open(const std::string& file, const std::string& place) {
  std::unique_ptr<format::Pack>& known = packs_[file];
  if (known) return known.get();
  auto pack = format::Pack::openFile(file);
  if (!pack) {
    Refusal refusal = toRefusal(pack.error(), file);
    if (!place.empty()) refusal.message = fmt::format("{}: {}", place, refusal.message);
    return tl::unexpected(refusal);
  }
  known = std::make_unique<format::Pack>(std::move(*pack));
  return known.get();
}

Checked<void> Contents::addVolume(const VolumeRequest& request, runtime::Interpolation interpolation) {
  const auto pack = open(request.pack, request.place);
  if (!pack) return tl::unexpected(pack.error());
  const auto number = findVolume(**pack, request.volume.value_or(""), request.level);
  if (!number) return missing(request.place, request.pack, number.error());
  PlacedVolume volume{.request = &request, .pack = *pack, .number = *number, .grids = {}, .suggested = {}, .still = {}};
  const auto grids = findGrids(**pack, volume.record(), request);
  if (!grids) return tl::unexpected(grids.error());
  volume.grids = *grids;
  if (interpolation == runtime::Interpolation::advect) {
    volume.grids = runtime::withVelocity(**pack, volume.record(), volume.grids);
  }
  if (request.frame) {
    const std::ptrdiff_t frame = findFrame(**pack, volume.record(), *request.frame);
    if (frame < 0)
      return missing(request.place, request.pack, fmt::format("the volume has no frame {}", *request.frame));
    volume.still = static_cast<std::uint32_t>(frame);
  }
  const auto look = runtime::suggestLook(**pack, volume.record(), volume.grids);
  if (!look) return tl::unexpected(toRefusal(look.error(), request.pack));
  volume.suggested = *look;
  if (auto sound = checkTransform(volume); !sound) return sound;
  volumes_.push_back(volume);
  return {};
}

Checked<void> Contents::addEffect(const EffectRequest& request) {
  const auto pack = open(request.pack, request.place);
  if (!pack) return tl::unexpected(pack.error());
  const auto number = findEffect(**pack, request.name);
  if (!number) return missing(request.place, request.pack, number.error());
  effects_.push_back({&request, gathered_.add((*pack)->effects(), *number, request.density, request.fire)});
  return {};
}

std::vector<std::string> Contents::files() const {
  std::vector<std::string> files;
  for (const auto& [file, pack] : packs_) files.push_back(file);
  return files;
}

Effects Contents::effectsAt(double seconds) const {
  Effects all;
  for (const PlacedEffect& effect : effects_) {
    const EffectRequest& request = *effect.request;
    all.push_back({.effect = effect.number, .time = seconds - request.begin, .objectToWorld = request.transform});
  }
  return all;
}

Particles Contents::particlesAt(double seconds) const {
  Particles all;
  for (const runtime::MetavoxelEffect& effect : effectsAt(seconds)) {
    const auto similarity = format::similarityOf(effect.objectToWorld);
    for (const format::Particle& particle : format::particlesAt(tables(), effect.effect, effect.time)) {
      all.push_back(format::transformed(particle, *similarity));
    }
  }
  return all;
}

std::uint64_t Contents::mostParticles(double seconds) const {
  std::uint64_t sum = 0;
  for (const runtime::MetavoxelEffect& effect : effectsAt(seconds)) {
    for (const auto& candidates : format::candidatesAt(tables(), effect.effect, effect.time)) {
      sum += candidates.last - candidates.first;
    }
  }
  return sum;
}

VoxelLattice Contents::finestVoxels() const {
  VoxelLattice finest;
  for (const PlacedVolume& volume : volumes_) {
    forEachGridFrame(volume, [&](std::uint32_t, const double(&indexToScene)[12]) {
      const double edge = std::cbrt(std::abs(format::determinant(indexToScene)));
      if (finest.edge > 0 && finest.edge <= edge) return;
      finest = {edge, {indexToScene[3], indexToScene[7], indexToScene[11]}};
    });
  }
  return finest;
}

Refusal toRefusal(const format::Issue& issue, const std::string& pack) {
  // Ids below 100 are about getting at the bytes, not about what they say.
  const bool unreadable = issue.kind != nullptr && issue.kind->id < 100;
  return {unreadable ? kFile : kInvalid, fmt::format("{}: {}", pack, format::toString(issue))};
}

Refusal toRefusal(const runtime::Error& error, const std::string& pack) {
  if (error.code == runtime::ErrorCode::pack) {
    const bool unreadable = error.issue && error.issue->kind->id < 100;
    return {unreadable ? kFile : kInvalid, fmt::format("{}: {}", pack, error.message)};
  }
  return {error.code == runtime::ErrorCode::argument ? kInternal : kGpu, error.message};
}

}  // namespace billow::command
