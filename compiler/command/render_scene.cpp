#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "billow/format/source.h"
#include "command.h"
#include "render_request.h"

namespace billow::command {
namespace {

using nlohmann::json;

// Throws Refusal, caught in readScene: a scene has many ways to be wrong, and each leaves from the depth of it.
class SceneReader {
 public:
  explicit SceneReader(const std::string& path) : path_(path) {}

  using Member = std::function<void(const json&, const std::string& at)>;

  [[noreturn]] void fail(const std::string& at, const json& value, const std::string& expected) const {
    std::string shown = value.dump(-1, ' ', false, json::error_handler_t::replace);
    if (shown.size() > 60) shown = shown.substr(0, 57) + "...";
    throw Refusal{kInvalid,
                  fmt::format("{}: {} is {}; expected {}", path_, at.empty() ? "the scene" : at, shown, expected)};
  }

  void object(const json& value, const std::string& at, const std::map<std::string, Member>& members) const {
    if (!value.is_object()) fail(at, value, "an object");
    for (const auto& [key, child] : value.items()) {
      const auto member = members.find(key);
      const std::string childAt = at.empty() ? key : at + "." + key;
      if (member == members.end()) {
        std::string known;
        for (const auto& [name, read] : members) known.append(known.empty() ? "" : ", ").append(name);
        throw Refusal{kInvalid, fmt::format("{}: {} is not known; expected one of {}", path_, childAt, known)};
      }
      member->second(child, childAt);
    }
  }

  double number(const json& value, const std::string& at, double low, double high) const {
    const double got = value.is_number() ? value.get<double>() : std::nan("");
    if (!(got >= low && got <= high)) fail(at, value, fmt::format("a number from {} to {}", low, high));
    return got;
  }

  std::array<double, 3> triple(const json& value, const std::string& at, double low, double high) const {
    if (!value.is_array() || value.size() != 3) fail(at, value, "an array of three numbers");
    std::array<double, 3> numbers;
    for (std::size_t i = 0; i < 3; ++i) numbers[i] = number(value[i], fmt::format("{}[{}]", at, i), low, high);
    return numbers;
  }

  std::string text(const json& value, const std::string& at) const {
    if (!value.is_string() || value.get<std::string>().empty()) fail(at, value, "a text that is not empty");
    return value.get<std::string>();
  }

  Member into(std::optional<float>& field, double low, double high) const {
    return [this, &field, low, high](const json& value, const std::string& at) {
      field = static_cast<float>(number(value, at, low, high));
    };
  }
  Member into(float& field, double low, double high) const {
    return [this, &field, low, high](const json& value, const std::string& at) {
      field = static_cast<float>(number(value, at, low, high));
    };
  }
  Member into(std::optional<Triple>& field, double low, double high) const {
    return [this, &field, low, high](const json& value, const std::string& at) {
      const auto v = triple(value, at, low, high);
      field = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
    };
  }
  Member into(std::optional<std::array<double, 3>>& field) const {
    return [this, &field](const json& value, const std::string& at) { field = triple(value, at, -1e9, 1e9); };
  }
  Member into(std::optional<std::string>& field) const {
    return [this, &field](const json& value, const std::string& at) { field = text(value, at); };
  }

 private:
  const std::string& path_;
};

SceneReader::Member readCamera(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    CameraRequest& camera = request.camera;
    scene.object(value, at,
                 {{"eye", scene.into(camera.eye)},
                  {"target", scene.into(camera.target)},
                  {"fieldOfView", scene.into(camera.fieldOfView, 1, 170)},
                  {"up", [&](const json& up, const std::string& upAt) {
                     const std::string name = scene.text(up, upAt);
                     if (name != "y" && name != "z") scene.fail(upAt, up, "\"y\" or \"z\"");
                     request.up = name[0];
                   }}});
    if (camera.eye.has_value() != camera.target.has_value()) scene.fail(at, value, "both eye and target, or neither");
    if (camera.eye && *camera.eye == *camera.target) scene.fail(at, value, "an eye that is not at the target");
  };
}

SceneReader::Member readSun(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    scene.object(value, at,
                 {{"direction", scene.into(request.sunDirection, -kLargest, kLargest)},
                  {"color", scene.into(request.sunColor, 0, kLargest)},
                  {"intensity", scene.into(request.sunIntensity, 0, kLargest)}});
    if (request.sunDirection == Triple{0, 0, 0}) scene.fail(at, value, "a direction that is not zero");
  };
}

SceneReader::Member readLook(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    LookRequest& look = request.look;
    scene.object(value, at,
                 {{"extinctionScale", scene.into(look.extinctionScale, 0, kLargest)},
                  {"albedo", scene.into(look.albedo, 0, 1)},
                  {"anisotropy", scene.into(look.anisotropy, -0.99, 0.99)},
                  {"emissionScale", scene.into(look.emissionScale, 0, kLargest)},
                  {"temperatureScale", scene.into(look.temperatureScale, -kLargest, kLargest)},
                  {"temperatureOffset", scene.into(look.temperatureOffset, -kLargest, kLargest)},
                  {"ambient", scene.into(look.ambient, 0, kLargest)},
                  {"density", scene.into(look.density, 0, kLargest)},
                  {"fire", scene.into(look.fire, 0, kLargest)},
                  {"scatteringOrders", [&](const json& orders, const std::string& ordersAt) {
                     if (!orders.is_number_integer()) scene.fail(ordersAt, orders, "a whole number from 1 to 8");
                     look.scatteringOrders = static_cast<std::uint32_t>(scene.number(orders, ordersAt, 1, 8));
                   }}});
  };
}

SceneReader::Member readBackground(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    if (value.is_string()) {
      if (value != "none") scene.fail(at, value, "\"none\" or an object with bottom and top");
      request.background.kind = BackgroundRequest::Kind::none;
      return;
    }
    std::optional<Triple> bottom, top;
    scene.object(value, at, {{"bottom", scene.into(bottom, 0, kLargest)}, {"top", scene.into(top, 0, kLargest)}});
    if (!bottom || !top) scene.fail(at, value, "both bottom and top");
    request.background = {BackgroundRequest::Kind::colors, *bottom, *top};
  };
}

SceneReader::Member readSize(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    const auto whole = [](const json& edge) { return edge.is_number_integer(); };
    if (!value.is_array() || value.size() != 2 || !whole(value[0]) || !whole(value[1])) {
      scene.fail(at, value, "[width, height] in pixels");
    }
    request.width = static_cast<std::uint32_t>(scene.number(value[0], at + "[0]", 1, kLargestPicture));
    request.height = static_cast<std::uint32_t>(scene.number(value[1], at + "[1]", 1, kLargestPicture));
  };
}

SceneReader::Member readFilter(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    const std::string name = scene.text(value, at);
    if (name != "nearest" && name != "trilinear") scene.fail(at, value, "\"nearest\" or \"trilinear\"");
    request.filter = name == "nearest" ? runtime::Filter::nearest : runtime::Filter::trilinear;
  };
}

SceneReader::Member readGrids(const SceneReader& scene, RenderRequest& request) {
  return [&scene, &request](const json& value, const std::string& at) {
    scene.object(value, at,
                 {{"extinction", scene.into(request.grids.extinction)},
                  {"temperature", scene.into(request.grids.temperature)},
                  {"flames", scene.into(request.grids.flames)}});
  };
}

void readDocument(const SceneReader& scene, const json& document, const std::string& path, RenderRequest& request) {
  scene.object(document, "",
               {{"$schema", [&](const json& value, const std::string& at) { scene.text(value, at); }},
                {"pack",
                 [&](const json& value, const std::string& at) {
                   const std::filesystem::path pack = scene.text(value, at);
                   request.pack = (std::filesystem::path(path).parent_path() / pack).string();
                 }},
                {"volume", scene.into(request.volume)},
                {"grids", readGrids(scene, request)},
                {"camera", readCamera(scene, request)},
                {"sun", readSun(scene, request)},
                {"look", readLook(scene, request)},
                {"background", readBackground(scene, request)},
                {"size", readSize(scene, request)},
                {"exposure", scene.into(request.exposure, -32, 32)},
                {"filter", readFilter(scene, request)}});
  if (request.pack.empty()) throw Refusal{kInvalid, path + ": pack is missing; expected the path of a pack"};
}

}  // namespace

Checked<void> readScene(const std::string& path, RenderRequest& request) {
  const auto text = format::readTextFile(path);
  if (!text) return tl::unexpected(Refusal{kFile, fmt::format("{}: cannot be read: {}", path, text.error().detail)});
  try {
    const SceneReader scene(path);
    readDocument(scene, json::parse(*text), path, request);
  } catch (const json::parse_error& error) {
    return tl::unexpected(Refusal{kInvalid, fmt::format("{}: no JSON at byte {}", path, error.byte)});
  } catch (const json::exception& error) {  // a number that no double holds
    return tl::unexpected(Refusal{kInvalid, fmt::format("{}: not usable JSON: {}", path, error.what())});
  } catch (const Refusal& refusal) {
    return tl::unexpected(refusal);
  }
  return {};
}

}  // namespace billow::command
