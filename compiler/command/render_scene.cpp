#include "render_scene.h"

#include <filesystem>

#include "command.h"
#include "json/document.h"
#include "json/look.h"

namespace billow::command {
namespace {

using json::Range;
using json::Value;

constexpr Range kAnywhere{-kLargest, kLargest};
constexpr Range kPositive{0, kLargest};

void readText(const Value& object, const char* key, const char* expected, std::optional<std::string>& field) {
  if (const auto member = object.find(key)) field = member->text(expected);
}

void readCamera(const Value& value, RenderRequest& request) {
  value.requireKeys({"eye", "target", "fieldOfView", "up"});
  CameraRequest& camera = request.camera;
  if (const auto eye = value.find("eye")) camera.eye = eye->numbers<3>(kAnywhere);
  if (const auto target = value.find("target")) camera.target = target->numbers<3>(kAnywhere);
  readNumber(value, "fieldOfView", {1, 170}, camera.fieldOfView);
  if (const auto up = value.find("up")) request.up = "yz"[up->word({"y", "z"})];
  if (camera.eye.has_value() != camera.target.has_value()) value.fail("both eye and target, or neither");
  if (camera.eye && *camera.eye == *camera.target) value.fail("an eye that is not at the target");
}

void readSun(const Value& value, RenderRequest& request) {
  value.requireKeys({"direction", "color", "intensity"});
  if (const auto direction = value.find("direction")) request.sunDirection = direction->singles<3>(kAnywhere);
  if (const auto color = value.find("color")) request.sunColor = color->singles<3>(kPositive);
  if (const auto intensity = value.find("intensity")) request.sunIntensity = intensity->single(kPositive);
  if (request.sunDirection == Triple{0, 0, 0}) value.fail("a direction that is not zero");
}

BackgroundRequest readBackground(const Value& value) {
  BackgroundRequest background;
  if (value.isString()) {
    if (value.text("") != "none") value.fail("\"none\" or an object with bottom and top");
    background.kind = BackgroundRequest::Kind::none;
    return background;
  }
  value.requireKeys({"bottom", "top"});
  background = {BackgroundRequest::Kind::colors, value.at("bottom").singles<3>(kPositive),
                value.at("top").singles<3>(kPositive)};
  return background;
}

void readSize(const Value& value, RenderRequest& request) {
  const auto edges = value.items(2, "[width, height] in pixels");
  request.width = static_cast<std::uint32_t>(edges[0].integer(1, kLargestPicture));
  request.height = static_cast<std::uint32_t>(edges[1].integer(1, kLargestPicture));
}

void readGrids(const Value& value, GridNames& grids) {
  value.requireKeys({"extinction", "temperature", "flames"});
  readText(value, "extinction", "a grid's name", grids.extinction);
  readText(value, "temperature", "a grid's name", grids.temperature);
  readText(value, "flames", "a grid's name", grids.flames);
}

// One volume of a pack, or lists of volumes and effects.
void readContents(const Value& scene, const std::filesystem::path& folder, RenderRequest& request) {
  const auto volumes = scene.find("volumes"), effects = scene.find("effects");
  request.scene = volumes || effects;
  if (!request.scene) {
    request.volumes.emplace_back();
    request.volumes.front().place = scene.place();
    if (const auto rate = scene.find("framesPerSecond")) rate->fail("none beside \"pack\", whose frames have numbers");
    return readSource(scene, folder, request.volumes.front());
  }
  for (const char* single : {"pack", "volume", "level", "grids"}) {
    if (const auto given = scene.find(single)) given->fail("none beside \"volumes\" or \"effects\", which name packs");
  }
  if (volumes) readVolumes(*volumes, folder, request);
  if (effects) readEffects(*effects, folder, request);
  if (const auto rate = scene.find("framesPerSecond")) request.framesPerSecond = rate->number({0.001, 1000});
}

void readDocument(const Value& scene, const std::filesystem::path& folder, RenderRequest& request) {
  scene.requireKeys({"$schema", "pack", "volume", "level", "grids", "volumes", "effects", "framesPerSecond",
                     "voxelSize", "camera", "sun", "look", "background", "size", "exposure", "filter"});
  readContents(scene, folder, request);
  if (const auto edge = scene.find("voxelSize")) request.voxelSize = edge->number({1e-9, 1e9});
  if (const auto camera = scene.find("camera")) readCamera(*camera, request);
  if (const auto sun = scene.find("sun")) readSun(*sun, request);
  if (const auto look = scene.find("look")) readLook(*look, request.look);
  if (const auto background = scene.find("background")) request.background = readBackground(*background);
  if (const auto size = scene.find("size")) readSize(*size, request);
  readNumber(scene, "exposure", {-32, 32}, request.exposure);
  if (const auto filter = scene.find("filter")) {
    constexpr runtime::Filter kFilters[] = {runtime::Filter::nearest, runtime::Filter::trilinear};
    request.filter = kFilters[filter->word({"nearest", "trilinear"})];
  }
}

}  // namespace

void readNumber(const Value& object, const char* key, const Range& range, float& field) {
  if (const auto member = object.find(key)) field = member->single(range);
}

void readSource(const Value& value, const std::filesystem::path& folder, VolumeRequest& volume) {
  volume.pack = (folder / value.at("pack").text("the path of a pack")).string();
  readText(value, "volume", "a volume's name", volume.volume);
  if (const auto level = value.find("level")) {
    volume.level = static_cast<std::uint32_t>(level->integer(0, format::kMaxLevelLog2));
  }
  if (const auto grids = value.find("grids")) readGrids(*grids, volume.grids);
}

void readLook(const Value& value, LookRequest& look) {
  look.record = json::readLook(value, {"density", "fire", "scatteringOrders"});
  readNumber(value, "density", kPositive, look.density);
  readNumber(value, "fire", kPositive, look.fire);
  if (const auto orders = value.find("scatteringOrders")) {
    look.scatteringOrders = static_cast<std::uint32_t>(orders->integer(1, 8));
  }
}

Checked<void> readScene(const std::string& path, RenderRequest& request) {
  try {
    const json::Document document(path);
    readDocument(document.root(), std::filesystem::path(path).parent_path(), request);
  } catch (const json::FileError& error) {
    return tl::unexpected(Refusal{kFile, error.what()});
  } catch (const json::Error& error) {
    return tl::unexpected(Refusal{kInvalid, error.what()});
  }
  return {};
}

}  // namespace billow::command
