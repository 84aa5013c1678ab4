#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "command.h"
#include "pack_lookup.h"
#include "render_arguments.h"
#include "render_image.h"
#include "render_metavoxel.h"
#include "render_setup.h"

namespace billow::command {
namespace {

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
  std::vector<std::uint32_t> effects;
  bool png = false;
  // Where frames are asked for:
  std::uint32_t volume = 0;
  runtime::GridChoice grids;
  std::vector<std::uint32_t> frames;

  const format::VolumeRecord& record() const { return pack.volumes()[volume]; }
};

// The device, and what draws on it.
struct Painter {
  std::unique_ptr<headless::Headless> gpu;
  std::unique_ptr<runtime::Renderer> renderer;
  std::optional<MetavoxelPainter> metavoxels;

  runtime::Result<headless::Picture> render(const runtime::DrawInfo& draw, const Effects& effects) {
    auto picture = metavoxels ? metavoxels->render(*gpu, *renderer, draw, effects) : gpu->render(*renderer, draw);
    gpu->waitIdle();
    return picture;
  }
};

// `box`, `lattice` and the number of particles are those of what metavoxels will hold.
Checked<Painter> makePainter(const Job& job, const runtime::WorldBox& box, VoxelLattice lattice,
                             std::uint64_t particles) {
  Painter painter;
  auto gpu = headless::Headless::create({.device = job.request.device});
  if (!gpu) return tl::unexpected(toRefusal(gpu.error(), job.request.pack));
  painter.gpu = std::move(*gpu);
  auto renderer = runtime::Renderer::create(painter.gpu->host(), {.gpuBudget = job.request.gpuBudget});
  if (!renderer) return tl::unexpected(toRefusal(renderer.error(), job.request.pack));
  painter.renderer = std::move(*renderer);
  if (job.request.method == Method::direct) return painter;
  if (job.request.voxelSize) lattice.edge = *job.request.voxelSize;
  // The other half is for the frame and its staging memory.
  auto metavoxels =
      MetavoxelPainter::make(*painter.renderer, job.pack, box, lattice, particles, job.request.gpuBudget / 2);
  if (!metavoxels) return tl::unexpected(toRefusal(metavoxels.error(), job.request.pack));
  painter.metavoxels = std::move(*metavoxels);
  return painter;
}

Checked<void> save(const Job& job, const runtime::Result<headless::Picture>& picture, const std::string& name) {
  if (!picture) return tl::unexpected(toRefusal(picture.error(), job.request.pack));
  writeWhole(name, job.png ? encodePng(*picture, job.request.exposure) : encodeExr(*picture));
  return {};
}

Checked<void> renderFrame(const Job& job, Painter& painter, runtime::DrawInfo draw, std::uint32_t index,
                          const Effects& effects) {
  const auto frame = painter.renderer->upload(job.pack, job.volume, index, {.grids = job.grids});
  if (!frame) return tl::unexpected(toRefusal(frame.error(), job.request.pack));
  draw.frame = frame->get();
  const auto picture = painter.render(draw, effects);
  return save(job, picture, outputName(job.request, job.pack.framesOf(job.record())[index].number));
}

Checked<void> renderFrames(const Job& job) {
  const auto look = runtime::suggestLook(job.pack, job.record(), job.grids);
  if (!look) return tl::unexpected(toRefusal(look.error(), job.request.pack));
  // The camera frames the whole sequence, so that a frame alone and within a range are the same picture.
  Stage stage = stageOf(job.pack, job.record(), job.grids, *look, 0, job.record().frameCount - 1);
  const auto frames = job.pack.framesOf(job.record());
  std::vector<Effects> effects;
  std::uint64_t particles = 0;
  for (const std::uint32_t index : job.frames) {
    effects.push_back(effectsAt(job.effects, frames[index].time));
    addParticles(particlesOf(job.pack, effects.back()), stage.box);
    particles = std::max(particles, mostParticles(job.pack, effects.back()));
  }
  const runtime::DrawInfo draw = setUp(job.request, stage, *look, job.png);
  auto painter = makePainter(job, stage.box, finestVoxels(job.pack, job.record(), job.grids), particles);
  if (!painter) return tl::unexpected(painter.error());
  // No prepare(): it builds the pipelines of every frame ahead, so that none is late. Here nobody waits for a frame,
  // and those that the chosen frames need are built when they are met.
  const bool progress = job.frames.size() > 1 && isatty(STDERR_FILENO) != 0;
  for (std::size_t i = 0; i < job.frames.size(); ++i) {
    if (auto done = renderFrame(job, *painter, draw, job.frames[i], effects[i]); !done) return done;
    if (progress)
      fmt::print(stderr, "\r{}/{} frames on {}{}", i + 1, job.frames.size(), painter->gpu->deviceName(),
                 i + 1 == job.frames.size() ? "\n" : "");
  }
  return {};
}

// Effects without a volume, at one time.
Checked<void> renderEffects(const Job& job) {
  const Effects effects = effectsAt(job.effects, *job.request.time);
  const Particles particles = particlesOf(job.pack, effects);
  Stage stage{.box = {}, .up = 'y', .burning = false, .ambientGiven = false};
  addParticles(particles, stage.box);
  for (const format::Particle& particle : particles) {
    for (const float channel : particle.emission) stage.burning = stage.burning || channel > 0;
  }
  runtime::Look look;
  look.scatteringOrders = 4;
  const runtime::DrawInfo draw = setUp(job.request, stage, look, job.png);
  auto painter = makePainter(job, stage.box, {}, mostParticles(job.pack, effects));
  if (!painter) return tl::unexpected(painter.error());
  return save(job, painter->render(draw, effects), job.request.output);
}

// The volume, its grids and frames that are asked for.
Checked<void> chooseFrames(const std::string& input, Job& job) {
  const RenderRequest& request = job.request;
  const auto volume = findVolume(job.pack, request.volume.value_or(""));
  if (!volume) return refuse(kCommandLine, fmt::format("{}: {}", request.pack, volume.error()));
  job.volume = static_cast<std::uint32_t>(*volume);
  auto frames = findFrames(job.pack, job.record(), request);
  if (!frames) return tl::unexpected(frames.error());
  job.frames = std::move(*frames);
  if (auto outputs = checkOutputs(request, input, job.pack, job.record(), job.frames); !outputs) return outputs;
  const auto grids = findGrids(job.pack, job.record(), request.grids);
  if (!grids) return tl::unexpected(grids.error());
  job.grids = *grids;
  return {};
}

Checked<void> render(const std::string& input, Job& job) {
  auto effects = findEffects(job.pack, job.request);
  if (!effects) return tl::unexpected(effects.error());
  job.effects = std::move(*effects);
  if (!job.request.frames) {
    if (sameFile(job.request.output, job.request.pack) || sameFile(job.request.output, input)) {
      return refuse(kCommandLine, fmt::format("-o {}: that is the input itself", job.request.output));
    }
    return renderEffects(job);
  }
  if (auto chosen = chooseFrames(input, job); !chosen) return chosen;
  return renderFrames(job);
}

int runRender(const RenderArguments& arguments) {
  const auto request = makeRequest(arguments);
  if (!request) return complain(request.error());
  auto pack = format::Pack::openFile(request->pack);
  if (!pack) return reportIssue(request->pack, pack.error());
  const bool png = std::filesystem::path(request->output).extension() == ".png";
  Job job{
      .request = *request, .pack = std::move(*pack), .effects = {}, .png = png, .volume = 0, .grids = {}, .frames = {}};
  const auto done = render(arguments.input, job);
  return done ? kDone : complain(done.error());
}

}  // namespace

void addRender(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Draw frames and effects of a pack to PNG or EXR pictures");
  command->footer(
      "EXR holds premultiplied linear RGBA (half) and depth Z along the view (single).\n"
      "Examples:\n"
      "  billow render fire.blw --frame 12 -o fire.png\n"
      "  billow render fire.blw --frame 5-12 -o fire.exr      writes fire_0005.exr to fire_0012.exr\n"
      "  billow render smoke.blw --effect 'campfire smoke' --time 2 -o smoke.png\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read or written, 3 invalid pack or scene, 4 no usable "
      "GPU");
  addRenderOptions(*command, *arguments);
  command->callback([arguments, &run] { run = [arguments] { return runRender(*arguments); }; });
}

}  // namespace billow::command
