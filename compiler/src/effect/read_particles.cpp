#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "effect/particle_files.h"
#include "effect/read.h"
#include "import/frame_choice.h"

namespace billow::compiler {
namespace {

using json::Value;

constexpr double kMost = static_cast<double>(format::kMaxMagnitude);

// A name, or false for none; where nothing is said, the first of `usual` that the files have.
AttributeChoice readAttribute(const Value& value, const char* key, std::vector<std::string> usual) {
  const auto member = value.find(key);
  if (!member) return {std::move(usual), false};
  if (member->isString()) return {{member->text("an attribute's name, or false")}, true};
  if (member->boolean()) member->fail("an attribute's name, or false");
  return {};
}

std::vector<std::string> readTexts(const Value& value, const char* expected) {
  if (value.isString()) return {value.text(expected)};
  std::vector<std::string> texts;
  for (const Value& item : value.items(expected)) texts.push_back(item.text(expected));
  return texts;
}

}  // namespace

void readParticles(const Value& value, const EffectDescription& effect, const std::filesystem::path& folder,
                   EmitterDescription& emitter) {
  value.requireKeys({"files", "framesPerSecond", "frames", "missing", "grids", "id", "radius", "age", "life", "colour",
                     "scale", "error"});
  ParticleRequest request;
  request.place = value.place();
  request.duration = effect.duration;
  request.loop = effect.flags != 0;
  for (const std::string& file : readTexts(value.at("files"), "a .ply or .vdb file or a pattern, or a list of them")) {
    request.inputs.push_back((folder / file).string());
  }
  const auto rate = value.find("framesPerSecond");
  constexpr double kLeastRate = static_cast<double>(format::kMinTrackRate);
  request.options.framesPerSecond =
      rate ? static_cast<double>(rate->single({kLeastRate, static_cast<double>(format::kMaxTrackRate)})) : 24;
  if (const auto frames = value.find("frames")) readFrames(*frames, request.options);
  if (const auto missing = value.find("missing")) readMissing(*missing, request.options);
  if (const auto grids = value.find("grids")) request.attributes.grids = readTexts(*grids, "names of point grids");
  request.attributes.id = readAttribute(value, "id", {"id"});
  request.attributes.radius = readAttribute(value, "radius", {"pscale", "radius"});
  request.attributes.age = readAttribute(value, "age", {"age"});
  request.attributes.life = readAttribute(value, "life", {"life"});
  request.attributes.colour = readAttribute(value, "colour", {"", "Cd"});
  if (const auto scale = value.find("scale")) request.scale = scale->number({1e-6, kMost});
  if (const auto error = value.find("error")) emitter.trackError = error->number({1e-6, kMost});
  emitter.given = gatherParticles(request);
  const auto [least, most] = std::minmax_element(emitter.given->particles.begin(), emitter.given->particles.end(),
                                                 [](const auto& a, const auto& b) { return a.lifetime < b.lifetime; });
  emitter.record.lifetime[0] = least->lifetime;
  emitter.record.lifetime[1] = most->lifetime;
}

}  // namespace billow::compiler
