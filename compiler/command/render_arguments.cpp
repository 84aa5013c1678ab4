#include "render_arguments.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "billow/format/effect.h"
#include "billow/format/look.h"
#include "command.h"

namespace billow::command {
namespace {

tl::unexpected<Refusal> refuse(int code, const std::string& message) {
  return tl::unexpected(Refusal{code, message});
}

Checked<void> applyTexts(const RenderArguments& arguments, RenderRequest& request) {
  if (arguments.frames) {
    if (auto done = parseFrames(*arguments.frames, request); !done) return done;
  }
  if (arguments.size) {
    if (auto done = parseSize(*arguments.size, request); !done) return done;
  }
  if (arguments.camera) {
    if (auto done = parseCamera(*arguments.camera, request); !done) return done;
  }
  if (arguments.background) {
    if (auto done = parseBackground(*arguments.background, request); !done) return done;
  }
  const auto triple = [](const std::optional<std::string>& text, const char* option, const Bounds& bounds,
                         std::optional<Triple>& field) -> Checked<void> {
    if (!text) return {};
    const auto value = parseTriple(*text, option, bounds);
    if (!value) return tl::unexpected(value.error());
    field = *value;
    return {};
  };
  if (auto done = triple(arguments.sunDirection, "--sun", {-kLargest, kLargest}, request.sunDirection); !done)
    return done;
  if (auto done = triple(arguments.sunColor, "--sun-color", {0, kLargest}, request.sunColor); !done) return done;
  const auto lookTriple = [&](const std::optional<std::string>& text, const char* option,
                              std::uint32_t field) -> Checked<void> {
    const format::LookField& bounds = format::kLookFields[field];
    std::optional<Triple> value;
    auto done = triple(text, option, {double{bounds.low}, double{bounds.high}}, value);
    if (!value) return done;
    format::setLook(request.look.record, field, *value);
    for (VolumeRequest& volume : request.volumes) format::setLook(volume.look.record, field, *value);
    return done;
  };
  if (auto done = lookTriple(arguments.albedo, "--albedo", format::kLookAlbedo); !done) return done;
  if (auto done = lookTriple(arguments.ambient, "--ambient", format::kLookAmbient); !done) return done;
  if (request.sunDirection == Triple{0, 0, 0}) return refuse(kCommandLine, "--sun is 0,0,0; expected a direction");
  return {};
}

template <class T>
void overrideWith(const std::optional<T>& given, std::optional<T>& field) {
  if (given) field = given;
}

// Also over what single volumes of a scene have.
void applyLook(const RenderArguments& arguments, RenderRequest& request) {
  const LookRequest& given = arguments.direct.look;
  const auto apply = [&](LookRequest& look, bool whole) {
    for (std::uint32_t field = 0; field < format::kLookFieldCount; ++field) {
      if (!format::isSet(given.record, field)) continue;
      format::setLook(look.record, field, format::lookValues(given.record, field));
    }
    if (arguments.density) look.density = whole ? *arguments.density : 1;
    if (arguments.fire) look.fire = whole ? *arguments.fire : 1;
  };
  apply(request.look, true);
  for (VolumeRequest& volume : request.volumes) apply(volume.look, false);
  overrideWith(given.scatteringOrders, request.look.scatteringOrders);
}

void applyNumbers(const RenderArguments& arguments, RenderRequest& request) {
  const RenderRequest& given = arguments.direct;
  overrideWith(given.sunIntensity, request.sunIntensity);
  overrideWith(given.voxelSize, request.voxelSize);
  request.exposure = arguments.exposure.value_or(request.exposure);
  request.camera.fieldOfView = arguments.fieldOfView.value_or(request.camera.fieldOfView);
  request.output = arguments.output;
  request.step = given.step;
  request.velocityScale = given.velocityScale;
  request.gpuBudget = given.gpuBudget;
  request.device = given.device;
  request.shadows = arguments.shadows == "none"      ? runtime::Filter::none
                    : arguments.shadows == "nearest" ? runtime::Filter::nearest
                                                     : runtime::Filter::trilinear;
  if (arguments.up) request.up = (*arguments.up)[0];
  if (arguments.filter) {
    request.filter = *arguments.filter == "nearest" ? runtime::Filter::nearest : runtime::Filter::trilinear;
  }
}

// CLI11's own ranges let NaN pass, and what single precision rounds to infinity.
CLI::Validator finite() {
  return CLI::Validator(
      [](std::string& text) {
        float number = 0;
        const bool sound = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
        return sound ? std::string() : text + " is not a finite number";
      },
      "");
}

// A number that the field of a look may have, into the record.
void addLookNumber(CLI::App& command, const std::string& option, std::uint32_t field, format::LookRecord& look,
                   const std::string& description) {
  const auto inRange = [field](std::string& text) {
    const format::LookField& bounds = format::kLookFields[field];
    float number = 0;
    CLI::detail::lexical_cast(text, number);
    if (bounds.holds(number)) return std::string();
    return fmt::format("{} is not {} {:.9g} {} {:.9g}", text, bounds.open ? "between" : "from", bounds.low,
                       bounds.open ? "and" : "to", bounds.high);
  };
  const auto store = [field, &look](float number) { format::setLook(look, field, {&number, 1}); };
  command.add_option_function<float>(option, store, description)->check(finite())->check(CLI::Validator(inRange, ""));
}

void addPictureOptions(CLI::App& command, RenderArguments& arguments) {
  command.add_option("--size", arguments.size, "Picture size in pixels, WIDTHxHEIGHT (default 960x540)");
  command.add_option("--camera", arguments.camera,
                     "Eye, target and field of view in degrees: x,y,z:x,y,z[:degrees]\n"
                     "(default: the whole sequence in view)");
  command.add_option("--fov", arguments.fieldOfView, "Vertical field of view in degrees (default 35)")
      ->check(finite())
      ->check(CLI::Range(1.0, 170.0));
  command.add_option("--up", arguments.up, "Which axis is up (default: the one along which the gas rises, else z)")
      ->check(CLI::IsMember({"y", "z"}));
  command.add_option("--exposure", arguments.exposure, "PNG only: stops to brighten (or darken, below 0)")
      ->check(finite())
      ->check(CLI::Range(-32.0, 32.0));
  command.add_option("--background", arguments.background,
                     "none, r,g,b, or r,g,b:r,g,b from bottom to top, linear\n"
                     "(default: a gradient in PNG, none in EXR)");
  command.add_option("--filter", arguments.filter, "Between voxels (default trilinear)")
      ->check(CLI::IsMember({"nearest", "trilinear"}));
  command.add_option("--step", arguments.direct.step, "Length of a step in voxels (default 1)")
      ->check(finite())
      ->check(CLI::Range(0.05, 16.0));
}

void addLightOptions(CLI::App& command, RenderArguments& arguments) {
  LookRequest& look = arguments.direct.look;
  const auto positive = finite() & CLI::Range(0.0, 1e9);
  command.add_option("--sun", arguments.sunDirection, "Direction to the sun, x,y,z");
  command.add_option("--sun-color", arguments.sunColor, "Linear r,g,b");
  command.add_option("--sun-intensity", arguments.direct.sunIntensity, "Irradiance")->check(positive);
  command.add_option("--ambient", arguments.ambient, "Light from everywhere, linear r,g,b");
  command.add_option("--shadows", arguments.shadows, "The volume's own: none, or between voxels nearest or trilinear")
      ->check(CLI::IsMember({"none", "nearest", "trilinear"}))
      ->capture_default_str();
  command.add_option("--density", arguments.density, "Factor on the smoke's density, which fits the data at 1")
      ->check(positive);
  command.add_option("--fire", arguments.fire, "Factor on the fire's brightness, which fits the data at 1")
      ->check(positive);
  const auto add = [&](const char* option, std::uint32_t field, const char* description) {
    addLookNumber(command, option, field, look.record, description);
  };
  add("--extinction-scale", format::kLookExtinctionScale, "Extinction per world unit and grid value");
  add("--emission-scale", format::kLookEmissionScale, "Radiance per world unit and grid value");
  add("--temperature-scale", format::kLookTemperatureScale, "Kelvin per grid value");
  add("--temperature-offset", format::kLookTemperatureOffset, "Kelvin at grid value 0");
  command.add_option("--albedo", arguments.albedo, "Of smoke, r,g,b in [0, 1]");
  add("--anisotropy", format::kLookAnisotropy, "Henyey-Greenstein g of smoke, between -1 and 1");
  command
      .add_option("--scattering-orders", look.scatteringOrders,
                  "1: single scattering; more imitate multiple scattering (default 4)")
      ->check(CLI::Range(1, 8));
}

void addSourceOptions(CLI::App& command, RenderArguments& arguments) {
  GridNames& grids = arguments.grids;
  command.add_option("--volume", arguments.volume, "The volume, where the pack has several");
  command
      .add_option("--level", arguments.level,
                  "A coarser level of the volume in its place: 1, of voxels twice as long, or 2, of four times")
      ->check(CLI::Range(0u, format::kMaxLevelLog2));
  command.add_option("--extinction", grids.extinction, "Grid to take as smoke, or none (default: by the pack's roles)");
  command.add_option("--temperature", grids.temperature, "Grid to take as temperature, or none");
  command.add_option("--flames", grids.flames, "Grid to take as flames, or none");
  command.add_option("--gpu-budget", arguments.direct.gpuBudget, "Bytes of GPU memory at most (default 1 GiB)")
      ->transform(CLI::AsSizeValue(false));
  command.add_option("--device", arguments.direct.device, "Vulkan device number (default: the fastest kind there is)");
}

void addMethodOptions(CLI::App& command, RenderArguments& arguments) {
  command
      .add_option("--method", arguments.method,
                  "direct marches one volume's tree; metavoxel fills a light-aligned space, which effects need, and\n"
                  "scenes that list what they hold (default: direct where it can)")
      ->check(CLI::IsMember({"direct", "metavoxel"}));
  command.add_option("--effect", arguments.effects, "An effect of the pack, beside the volume or alone");
  command
      .add_option("--time", arguments.direct.time,
                  "Without --frame: seconds after the begin of the volume, the scene, or (drawn alone) the effects")
      ->check(finite())
      ->check(CLI::Range(0.0, format::kMaxEffectTime));
  command
      .add_option("--interpolate", arguments.interpolate,
                  "What volumes show between frames: hold (default) the frame before, blend it with the next, or\n"
                  "advect: carry both along their velocity to the moment, and blend these")
      ->check(CLI::IsMember({"hold", "blend", "advect"}));
  command
      .add_option("--velocity-scale", arguments.direct.velocityScale,
                  "World units a second that a velocity grid's 1 stands for (default 1; what tools write differs)")
      ->check(finite());
  command
      .add_option("--surroundings", arguments.direct.surroundings,
                  "Of metavoxels: how much of the light that matter gives off and scatters reaches other matter,\n"
                  "so that fire lights its smoke (default 0; above, --scattering-orders is 1 by default)")
      ->check(finite())
      ->check(CLI::Range(0.0, 1.0));
  command.add_option("--bounces", arguments.direct.bounces, "How often that light is scattered on (default 2)")
      ->check(CLI::Range(1, 8));
  command
      .add_option("--voxel-size", arguments.direct.voxelSize,
                  "Of metavoxels, world units (default: the volume's, or a 256th of the effects' size)")
      ->check(finite())
      ->check(CLI::Range(1e-9, 1e9));
}

// What the options say of a pack's volume, grids and effects. A scene that lists volumes and effects says it all.
Checked<void> applySources(const RenderArguments& arguments, RenderRequest& request) {
  const GridNames& grids = arguments.grids;
  const bool named = arguments.volume || arguments.level || grids.extinction || grids.temperature || grids.flames;
  if (request.scene) {
    if (!named && arguments.effects.empty()) return {};
    return refuse(
        kCommandLine,
        fmt::format("{}: the scene lists what it holds; --volume, --level, --extinction, --temperature, --flames and "
                    "--effect are for packs",
                    arguments.input));
  }
  VolumeRequest& volume = request.volumes.front();
  overrideWith(arguments.volume, volume.volume);
  volume.level = arguments.level.value_or(volume.level);
  overrideWith(grids.extinction, volume.grids.extinction);
  overrideWith(grids.temperature, volume.grids.temperature);
  overrideWith(grids.flames, volume.grids.flames);
  if (named) volume.place.clear();
  for (const std::string& name : arguments.effects) {
    EffectRequest effect;
    effect.pack = volume.pack;
    effect.name = name;
    request.effects.push_back(std::move(effect));
  }
  return {};
}

Checked<void> applyTime(const RenderArguments& arguments, RenderRequest& request) {
  request.time = arguments.direct.time;
  const bool frames = arguments.frames.has_value();
  if (request.scene) {
    if (frames != request.time.has_value()) return {};
    return refuse(kCommandLine, "--frame or --time of a scene: expected one of the two");
  }
  if (!frames && !request.time && request.effects.empty()) {
    return refuse(kCommandLine, "--frame or --time of a volume, or --effect, must be given");
  }
  if (frames == request.time.has_value()) {
    return refuse(kCommandLine, "--time says what is drawn without --frame: expected one of the two");
  }
  if (!frames && !request.effects.empty()) request.volumes.clear();
  return {};
}

Checked<void> applyMethod(const RenderArguments& arguments, RenderRequest& request) {
  using enum runtime::Interpolation;
  const std::string interpolate = arguments.interpolate.value_or("hold");
  request.interpolate = interpolate == "advect" ? advect : interpolate == "blend" ? blend : hold;
  const bool needed = request.scene || !request.effects.empty() || request.interpolate == advect;
  request.method = arguments.method ? (*arguments.method == "direct" ? Method::direct : Method::metavoxel)
                   : needed         ? Method::metavoxel
                                    : Method::direct;
  request.surroundings = arguments.direct.surroundings;
  request.bounces = arguments.direct.bounces;
  // More of them imitate what is now found.
  if (request.surroundings > 0 && !request.look.scatteringOrders) request.look.scatteringOrders = 1;
  if (request.method == Method::metavoxel) return {};
  if (request.interpolate == advect) {
    return refuse(kCommandLine, "--interpolate advect is drawn by --method metavoxel alone, not by \"direct\"");
  }
  if (request.surroundings > 0) {
    return refuse(kCommandLine, "--surroundings is drawn by --method metavoxel alone, not by \"direct\"");
  }
  if (request.effects.empty() && request.volumes.size() == 1 && request.volumes[0].transform == kIdentity) return {};
  const bool one = request.effects.empty() && request.volumes.size() == 1;
  const std::string held =
      one ? "this one has a transform"
          : fmt::format("here are {} of them and {} effects", request.volumes.size(), request.effects.size());
  return refuse(
      kCommandLine,
      fmt::format("--method is \"direct\", which draws one volume where it lies; {}: expected \"metavoxel\"", held));
}

}  // namespace

Checked<RenderRequest> makeRequest(const RenderArguments& arguments) {
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  if (extension != ".png" && extension != ".exr") {
    return refuse(kCommandLine,
                  fmt::format("-o is \"{}\"; expected a name that ends in .png or .exr", arguments.output));
  }
  RenderRequest request;
  if (std::filesystem::path(arguments.input).extension() == ".json") {
    if (auto done = readScene(arguments.input, request); !done) return tl::unexpected(done.error());
  } else {
    request.volumes.emplace_back();
    request.volumes.front().pack = arguments.input;
  }
  applyNumbers(arguments, request);
  applyLook(arguments, request);
  if (auto done = applyTexts(arguments, request); !done) return tl::unexpected(done.error());
  for (const auto apply : {applySources, applyTime, applyMethod}) {
    if (auto done = apply(arguments, request); !done) return tl::unexpected(done.error());
  }
  return request;
}

void addRenderOptions(CLI::App& command, RenderArguments& arguments) {
  command.add_option("input", arguments.input, "A pack, or a scene (*.json, see spec/scene.schema.json)")
      ->required()
      ->type_name("PACK|SCENE.json");
  command.add_option("--frame", arguments.frames, "Frame number as the source counts, or a range N-M")
      ->type_name("N[-M]");
  command.add_option("-o,--output", arguments.output, "Picture to write; of a range, _NUMBER goes before .png or .exr")
      ->required()
      ->type_name("OUT");
  addPictureOptions(command, arguments);
  addLightOptions(command, arguments);
  addSourceOptions(command, arguments);
  addMethodOptions(command, arguments);
}

}  // namespace billow::command
