#include "document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "billow/format/look.h"
#include "command.h"
#include "pack_lookup.h"

namespace billow::viewer {
namespace {

using command::PlacedVolume;
using command::Refusal;
using command::RenderRequest;
using nlohmann::ordered_json;

constexpr double kLongest = 3600;        // seconds of a time line
constexpr double kStill = 10;            // of what has no end of its own
constexpr std::size_t kStageTimes = 24;  // at which effects are looked at for their extent

std::vector<Choice> choicesOf(const format::Pack& pack) {
  std::vector<Choice> choices;
  for (std::uint32_t i = 0; i < pack.volumes().size(); ++i) {
    if (!pack.isLevel(i)) choices.push_back({false, std::string(pack.string(pack.volumes()[i].name))});
  }
  for (const format::EffectRecord& effect : pack.effects().effects) {
    choices.push_back({true, std::string(pack.string(effect.name))});
  }
  return choices;
}

RenderRequest requestOf(const std::string& path, const Choice& choice) {
  RenderRequest request;
  if (choice.effect) {
    request.effects.emplace_back();
    request.effects.back().pack = path;
    request.effects.back().name = choice.name;
  } else {
    request.volumes.emplace_back();
    request.volumes.back().pack = path;
    request.volumes.back().volume = choice.name;
  }
  return request;
}

// The whole's factors become the volumes' own, so that there is one of each to change.
void spreadFactors(RenderRequest& request) {
  for (command::VolumeRequest& volume : request.volumes) {
    const format::LookRecord& own = volume.look.record;
    if (!format::isSet(own, format::kLookExtinctionScale)) volume.look.density *= request.look.density;
    if (!format::isSet(own, format::kLookEmissionScale)) volume.look.fire *= request.look.fire;
  }
  request.look.density = request.look.fire = 1;
}

// When the last of the scene ends, seconds.
double endOf(const command::Contents& contents) {
  double end = 0;
  for (const PlacedVolume& volume : contents.volumes()) {
    const auto frames = volume.pack->framesOf(volume.record());
    if (volume.still || frames.empty()) continue;
    const auto rate = double{volume.record().framesPerSecond};
    const double length = frames.back().time + 1 / rate;
    end = std::max(end, volume.request->begin + length * rate / volume.request->framesPerSecond.value_or(rate));
  }
  for (const command::PlacedEffect& effect : contents.effects()) {
    const double length = double{contents.tables().effects[effect.number].duration};
    end = std::max(end, effect.request->begin + length);
  }
  return std::min(end > 0 ? end : kStill, kLongest);
}

std::unique_ptr<Timeline> timelineOf(const RenderRequest& request, const command::Contents& contents) {
  std::vector<Tick> ticks;
  if (!request.scene && !contents.volumes().empty()) {
    const PlacedVolume& volume = contents.volumes().front();
    for (const format::FrameRecord& frame : volume.pack->framesOf(volume.record())) {
      ticks.push_back({frame.time, frame.number});
    }
    if (!ticks.empty()) {
      const double end = ticks.back().time + 1 / double{volume.record().framesPerSecond};
      return std::make_unique<Timeline>(std::move(ticks), end);
    }
  }
  const double end = endOf(contents), rate = request.framesPerSecond;
  const auto count = static_cast<std::int32_t>(std::clamp(std::round(end * rate), 1.0, double{command::kMostFrames}));
  for (std::int32_t frame = 0; frame < count; ++frame) ticks.push_back({frame / rate, frame});
  return std::make_unique<Timeline>(std::move(ticks), std::max(end, count / rate));
}

// At moments between those that were looked at a few more may live.
std::uint64_t particlesWithRoom(const command::Contents& contents, const Timeline& timeline) {
  std::uint64_t most = 0;
  for (const Tick& tick : timeline.ticks()) most = std::max(most, contents.mostParticles(tick.time));
  return most == 0 ? 0 : std::min(most + most / 8 + 64, command::kMostParticles);
}

// The shortest decimals that mean this float.
double plain(float value) {
  return std::stod(fmt::format("{}", value));
}

ordered_json plain(const command::Triple& values) {
  return {plain(values[0]), plain(values[1]), plain(values[2])};
}

ordered_json ownLook(const Document& document, std::size_t volume) {
  const runtime::Look look = document.lookOf(volume);
  ordered_json json;
  if (volume < document.request.volumes.size()) {
    json["density"] = plain(document.request.volumes[volume].look.density);
    json["fire"] = plain(document.request.volumes[volume].look.fire);
  }
  json["extinctionScale"] = plain(look.extinctionScale);
  json["albedo"] = plain(look.albedo);
  json["emissionScale"] = plain(look.emissionScale);
  json["temperatureScale"] = plain(look.temperatureScale);
  json["temperatureOffset"] = plain(look.temperatureOffset);
  return json;
}

}  // namespace

Checked<std::unique_ptr<Document>> Document::open(const std::string& path, const std::optional<Choice>& choice) {
  std::unique_ptr<Document> document(new Document);
  document->path_ = path;
  if (std::filesystem::path(path).extension() == ".json") {
    if (choice) {
      return tl::unexpected(Refusal{command::kCommandLine, path + ": the scene lists what it holds; a volume or an "
                                                                  "effect is chosen of a pack"});
    }
    if (auto read = command::readScene(path, document->request); !read) return tl::unexpected(read.error());
  } else {
    auto pack = format::Pack::openFile(path);
    if (!pack) return tl::unexpected(command::toRefusal(pack.error(), path));
    document->choices_ = choicesOf(*pack);
    if (document->choices_.empty()) {
      return tl::unexpected(Refusal{command::kInvalid, path + ": the pack has no volume and no effect to show"});
    }
    document->choice_ = choice.value_or(document->choices_.front());
    document->request = requestOf(path, document->choice_);
  }
  document->request.method = command::Method::metavoxel;
  document->request.interpolate = runtime::Interpolation::blend;
  spreadFactors(document->request);
  if (auto found = document->find(); !found) return tl::unexpected(found.error());
  document->original_ = document->request;
  return document;
}

Checked<void> Document::find() {
  auto contents = command::Contents::find(request);
  if (!contents) return tl::unexpected(contents.error());
  auto line = timelineOf(request, *contents);
  std::vector<double> times;
  for (std::size_t i = 0; i < kStageTimes && !contents->effects().empty(); ++i) {
    times.push_back(line->end() * static_cast<double>(i) / (kStageTimes - 1));
  }
  command::SpaceNeeds needs;
  auto stage = command::stageOf(*contents, times, needs);
  if (!stage) return tl::unexpected(stage.error());
  needs.particles = particlesWithRoom(*contents, *line);
  contents_ = std::move(*contents);
  timeline = std::move(line);
  stage_ = *stage;
  needs_ = needs;
  return {};
}

Checked<void> Document::renew() {
  std::unique_ptr<Timeline> before = std::move(timeline);
  auto found = find();
  if (!found || before->sameTicks(*timeline)) {
    timeline = std::move(before);
  } else {
    timeline->goOnAs(*before);
  }
  return found;
}

std::string Document::name() const {
  return std::filesystem::path(path_).filename().string();
}

std::string Document::whyNotDirect() const {
  if (!request.effects.empty()) return "effects are drawn by metavoxels";
  if (request.volumes.size() != 1) return "several volumes are drawn by metavoxels";
  return request.volumes[0].transform == command::kIdentity ? "" : "the volume has a transform";
}

bool Document::hasVelocity() const {
  const auto& volumes = contents_->volumes();
  return std::any_of(volumes.begin(), volumes.end(), [](const PlacedVolume& volume) {
    const auto grids = runtime::withVelocity(*volume.pack, volume.record(), volume.grids);
    return grids.velocityX != format::kNone || grids.velocityY != format::kNone || grids.velocityZ != format::kNone;
  });
}

runtime::DrawInfo Document::describe(bool opaque) const {
  return command::setUp(request, stage_, command::suggestedLook(*contents_), opaque);
}

runtime::Look Document::lookOf(std::size_t volume) const {
  const bool whole = contents_->volumes().empty();
  runtime::Look look = whole ? command::suggestedLook(*contents_) : contents_->volumes()[volume].suggested;
  runtime::applyLook(request.look.record, look);
  if (!whole) runtime::applyLook(request.volumes[volume].look.record, look);
  const runtime::Look shared = describe(true).look;
  look.anisotropy = shared.anisotropy;
  look.ambient = shared.ambient;
  look.scatteringOrders = shared.scatteringOrders;
  return look;
}

void Document::resetLook() {
  for (std::size_t i = 0; i < request.volumes.size(); ++i) request.volumes[i].look = original_.volumes[i].look;
  request.look = original_.look;
  request.sunDirection = original_.sunDirection;
  request.sunColor = original_.sunColor;
  request.sunIntensity = original_.sunIntensity;
  request.surroundings = original_.surroundings;
  request.bounces = original_.bounces;
  request.exposure = original_.exposure;
}

std::string sceneMembers(const Document& document, std::size_t volume) {
  const RenderRequest& request = document.request;
  const runtime::DrawInfo draw = document.describe(true);
  const command::SunChoice sun =
      command::sunOf(request, request.up.value_or(document.stage().up), document.stage().burning);
  ordered_json scene;
  scene["sun"] = {
      {"direction", plain(sun.direction)}, {"color", plain(sun.color)}, {"intensity", plain(sun.intensity)}};
  if (request.exposure != 0) scene["exposure"] = plain(request.exposure);
  if (request.voxelSize) scene["voxelSize"] = *request.voxelSize;
  ordered_json shared = {{"anisotropy", plain(draw.look.anisotropy)},
                         {"ambient", plain(draw.look.ambient)},
                         {"scatteringOrders", draw.look.scatteringOrders}};
  ordered_json own = ownLook(document, volume);
  if (request.volumes.size() > 1) {
    scene["look"] = std::move(shared);
    scene["volumes"] = ordered_json::array({{{"look", std::move(own)}}});
  } else {
    own.update(shared);
    scene["look"] = std::move(own);
  }
  return scene.dump(2);
}

}  // namespace billow::viewer
