#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "command.h"
#include "pack_lookup.h"
#include "render_image.h"
#include "render_request.h"
#include "render_setup.h"

namespace billow::command {
namespace {

// Options as texts, before they are checked; those that are given override the scene's.
struct Arguments {
  std::string input, frames, output;
  std::optional<std::string> size, camera, sunDirection, sunColor, background, up, filter, albedo, ambient;
  std::string method = "direct";
  std::string shadows = "nearest";
  RenderRequest direct;  // what CLI11 checks by itself
  std::optional<float> fieldOfView, exposure, density, fire;
};

int complain(const Refusal& refusal) {
  fmt::print(stderr, "billow: error: {}\n", refusal.message);
  return refusal.code;
}

tl::unexpected<Refusal> refuse(int code, const std::string& message) {
  return tl::unexpected(Refusal{code, message});
}

// Runtime errors as the command's: what is wrong with the pack is the pack's fault, all else the GPU's.
Refusal toRefusal(const runtime::Error& error, const std::string& pack) {
  if (error.code == runtime::ErrorCode::pack) {
    const bool unreadable = error.issue && error.issue->kind->id < 100;
    return {unreadable ? kFile : kInvalid, fmt::format("{}: {}", pack, error.message)};
  }
  return {error.code == runtime::ErrorCode::argument ? kInternal : kGpu, error.message};
}

Checked<void> applyTexts(const Arguments& arguments, RenderRequest& request) {
  if (auto done = parseFrames(arguments.frames, request); !done) return done;
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
  if (auto done = triple(arguments.albedo, "--albedo", {0, 1}, request.look.albedo); !done) return done;
  if (auto done = triple(arguments.ambient, "--ambient", {0, kLargest}, request.look.ambient); !done) return done;
  if (request.sunDirection == Triple{0, 0, 0}) return refuse(kCommandLine, "--sun is 0,0,0; expected a direction");
  return {};
}

template <class T>
void overrideWith(const std::optional<T>& given, std::optional<T>& field) {
  if (given) field = given;
}

void applyNumbers(const Arguments& arguments, RenderRequest& request) {
  const RenderRequest& given = arguments.direct;
  overrideWith(given.volume, request.volume);
  overrideWith(given.grids.extinction, request.grids.extinction);
  overrideWith(given.grids.temperature, request.grids.temperature);
  overrideWith(given.grids.flames, request.grids.flames);
  overrideWith(given.sunIntensity, request.sunIntensity);
  overrideWith(given.look.extinctionScale, request.look.extinctionScale);
  overrideWith(given.look.emissionScale, request.look.emissionScale);
  overrideWith(given.look.anisotropy, request.look.anisotropy);
  overrideWith(given.look.temperatureScale, request.look.temperatureScale);
  overrideWith(given.look.temperatureOffset, request.look.temperatureOffset);
  overrideWith(given.look.scatteringOrders, request.look.scatteringOrders);
  request.look.density = arguments.density.value_or(request.look.density);
  request.look.fire = arguments.fire.value_or(request.look.fire);
  request.exposure = arguments.exposure.value_or(request.exposure);
  request.camera.fieldOfView = arguments.fieldOfView.value_or(request.camera.fieldOfView);
  request.output = arguments.output;
  request.step = given.step;
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

Checked<RenderRequest> makeRequest(const Arguments& arguments) {
  if (arguments.method != "direct") {
    return refuse(kCommandLine,
                  fmt::format("--method is \"{}\"; this version draws by \"direct\" alone", arguments.method));
  }
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  if (extension != ".png" && extension != ".exr") {
    return refuse(kCommandLine,
                  fmt::format("-o is \"{}\"; expected a name that ends in .png or .exr", arguments.output));
  }
  RenderRequest request;
  if (std::filesystem::path(arguments.input).extension() == ".json") {
    if (auto done = readScene(arguments.input, request); !done) return tl::unexpected(done.error());
  } else {
    request.pack = arguments.input;
  }
  applyNumbers(arguments, request);
  if (auto done = applyTexts(arguments, request); !done) return tl::unexpected(done.error());
  return request;
}

Checked<std::uint32_t> chosenGrid(const format::Pack& pack, const format::VolumeRecord& volume,
                                  const std::string& name) {
  if (name == "none") return format::kNone;
  const std::ptrdiff_t grid = findGrid(pack, volume, name);
  if (grid >= 0) return static_cast<std::uint32_t>(grid);
  return refuse(kCommandLine, fmt::format("the volume has no grid \"{}\"; it has {}", name, gridNames(pack, volume)));
}

Checked<runtime::GridChoice> findGrids(const format::Pack& pack, const format::VolumeRecord& volume,
                                       const GridNames& names) {
  runtime::GridChoice choice = runtime::chooseGrids(pack, volume);
  const auto pick = [&](const std::optional<std::string>& name, std::uint32_t& field) -> Checked<void> {
    if (!name) return {};
    const auto grid = chosenGrid(pack, volume, *name);
    if (!grid) return tl::unexpected(grid.error());
    field = *grid;
    return {};
  };
  if (auto done = pick(names.extinction, choice.extinction); !done) return tl::unexpected(done.error());
  if (auto done = pick(names.temperature, choice.temperature); !done) return tl::unexpected(done.error());
  if (auto done = pick(names.flames, choice.flames); !done) return tl::unexpected(done.error());
  return choice;
}

// Indices of the frames that were asked for.
Checked<std::vector<std::uint32_t>> findFrames(const format::Pack& pack, const format::VolumeRecord& volume,
                                               const RenderRequest& request) {
  const auto frames = pack.framesOf(volume);
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < frames.size(); ++i) {
    if (frames[i].number >= request.firstFrame && frames[i].number <= request.lastFrame) found.push_back(i);
  }
  if (!found.empty()) return found;
  if (frames.empty()) return refuse(kInvalid, request.pack + ": the volume has no frame");
  return refuse(kCommandLine, fmt::format("--frame: {} has no such frame; it has {} to {}", request.pack,
                                          frames.front().number, frames.back().number));
}

std::string outputName(const RenderRequest& request, std::int32_t number) {
  if (!request.range) return request.output;
  const std::filesystem::path path(request.output);
  const std::string name = fmt::format("{}_{:04}{}", path.stem().string(), number, path.extension().string());
  return (path.parent_path() / name).string();
}

// No picture may take the place of what it is drawn from.
Checked<void> checkOutputs(const RenderRequest& request, const std::string& input, const format::Pack& pack,
                           const format::VolumeRecord& volume, const std::vector<std::uint32_t>& frames) {
  for (const std::uint32_t frame : frames) {
    const std::string name = outputName(request, pack.framesOf(volume)[frame].number);
    if (!sameFile(name, request.pack) && !sameFile(name, input)) continue;
    return refuse(kCommandLine, fmt::format("-o {}: that is the input itself", name));
  }
  return {};
}

struct Job {
  RenderRequest request;
  format::Pack pack;
  std::uint32_t volume;
  runtime::GridChoice grids;
  std::vector<std::uint32_t> frames;
  bool png;

  const format::VolumeRecord& record() const { return pack.volumes()[volume]; }
};

Checked<void> renderFrame(const Job& job, headless::Headless& gpu, runtime::Renderer& renderer, runtime::DrawInfo draw,
                          std::uint32_t index) {
  const auto frame = renderer.upload(job.pack, job.volume, index, {.grids = job.grids});
  if (!frame) return tl::unexpected(toRefusal(frame.error(), job.request.pack));
  draw.frame = frame->get();
  const auto picture = gpu.render(renderer, draw);
  gpu.waitIdle();
  if (!picture) return tl::unexpected(toRefusal(picture.error(), job.request.pack));
  const std::string name = outputName(job.request, job.pack.framesOf(job.record())[index].number);
  writeWhole(name, job.png ? encodePng(*picture, job.request.exposure) : encodeExr(*picture));
  return {};
}

Checked<void> renderAll(const Job& job) {
  const auto look = runtime::suggestLook(job.pack, job.record(), job.grids);
  if (!look) return tl::unexpected(toRefusal(look.error(), job.request.pack));
  // The camera frames the whole sequence, so that a frame alone and within a range are the same picture.
  const std::uint32_t lastFrame = job.record().frameCount - 1;
  const runtime::DrawInfo draw = setUp(job.request, job.pack, job.record(), job.grids, *look, 0, lastFrame, job.png);
  const auto gpu = headless::Headless::create({.device = job.request.device});
  if (!gpu) return tl::unexpected(toRefusal(gpu.error(), job.request.pack));
  const auto renderer = runtime::Renderer::create((*gpu)->host(), {.gpuBudget = job.request.gpuBudget});
  if (!renderer) return tl::unexpected(toRefusal(renderer.error(), job.request.pack));
  const bool progress = job.frames.size() > 1 && isatty(STDERR_FILENO) != 0;
  for (std::size_t i = 0; i < job.frames.size(); ++i) {
    if (auto done = renderFrame(job, **gpu, **renderer, draw, job.frames[i]); !done) return done;
    if (progress)
      fmt::print(stderr, "\r{}/{} frames on {}{}", i + 1, job.frames.size(), (*gpu)->deviceName(),
                 i + 1 == job.frames.size() ? "\n" : "");
  }
  return {};
}

int runRender(const Arguments& arguments) {
  const auto request = makeRequest(arguments);
  if (!request) return complain(request.error());
  auto pack = format::Pack::openFile(request->pack);
  if (!pack) return reportIssue(request->pack, pack.error());
  const auto volume = findVolume(*pack, request->volume.value_or(""));
  if (!volume) return complain({kCommandLine, fmt::format("{}: {}", request->pack, volume.error())});
  const format::VolumeRecord& record = pack->volumes()[*volume];
  const auto frames = findFrames(*pack, record, *request);
  if (!frames) return complain(frames.error());
  const auto outputs = checkOutputs(*request, arguments.input, *pack, record, *frames);
  if (!outputs) return complain(outputs.error());
  const auto grids = findGrids(*pack, record, request->grids);
  if (!grids) return complain(grids.error());
  const bool png = std::filesystem::path(request->output).extension() == ".png";
  const Job job{*request, std::move(*pack), *volume, *grids, *frames, png};
  const auto done = renderAll(job);
  return done ? kDone : complain(done.error());
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

void addPictureOptions(CLI::App& command, Arguments& arguments) {
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

void addLightOptions(CLI::App& command, Arguments& arguments) {
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
  command.add_option("--extinction-scale", look.extinctionScale, "Extinction per world unit and grid value")
      ->check(positive);
  command.add_option("--emission-scale", look.emissionScale, "Radiance per world unit and grid value")->check(positive);
  command.add_option("--temperature-scale", look.temperatureScale, "Kelvin per grid value")->check(finite());
  command.add_option("--temperature-offset", look.temperatureOffset, "Kelvin at grid value 0")->check(finite());
  command.add_option("--albedo", arguments.albedo, "Of smoke, r,g,b in [0, 1]");
  command.add_option("--anisotropy", look.anisotropy, "Henyey-Greenstein g of smoke")
      ->check(finite())
      ->check(CLI::Range(-0.99, 0.99));
  command
      .add_option("--scattering-orders", look.scatteringOrders,
                  "1: single scattering; more imitate multiple scattering (default 4)")
      ->check(CLI::Range(1, 8));
}

void addSourceOptions(CLI::App& command, Arguments& arguments) {
  GridNames& grids = arguments.direct.grids;
  command.add_option("--volume", arguments.direct.volume, "The volume, where the pack has several");
  command.add_option("--extinction", grids.extinction, "Grid to take as smoke, or none (default: by the pack's roles)");
  command.add_option("--temperature", grids.temperature, "Grid to take as temperature, or none");
  command.add_option("--flames", grids.flames, "Grid to take as flames, or none");
  command.add_option("--gpu-budget", arguments.direct.gpuBudget, "Bytes of GPU memory at most (default 1 GiB)")
      ->transform(CLI::AsSizeValue(false));
  command.add_option("--device", arguments.direct.device, "Vulkan device number (default: the fastest kind there is)");
  // Not in the help: the one method there is.
  command.add_option("--method", arguments.method)->group("");
}

}  // namespace

void addRender(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("render", "Draw frames of a pack to PNG or EXR pictures");
  command->footer(
      "EXR holds premultiplied linear RGBA (half) and depth Z along the view (single).\n"
      "Examples:\n"
      "  billow render fire.blw --frame 12 -o fire.png\n"
      "  billow render fire.blw --frame 5-12 -o fire.exr      writes fire_0005.exr to fire_0012.exr\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read or written, 3 invalid pack or scene, 4 no usable "
      "GPU");
  command->add_option("input", arguments->input, "A pack, or a scene (*.json, see spec/scene.schema.json)")
      ->required()
      ->type_name("PACK|SCENE.json");
  command->add_option("--frame", arguments->frames, "Frame number as the source counts, or a range N-M")
      ->required()
      ->type_name("N[-M]");
  command
      ->add_option("-o,--output", arguments->output, "Picture to write; of a range, _NUMBER goes before .png or .exr")
      ->required()
      ->type_name("OUT");
  addPictureOptions(*command, *arguments);
  addLightOptions(*command, *arguments);
  addSourceOptions(*command, *arguments);
  command->callback([arguments, &run] { run = [arguments] { return runRender(*arguments); }; });
}

}  // namespace billow::command
