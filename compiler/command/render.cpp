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
#include "render_arguments.h"
#include "render_image.h"
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
  // No prepare(): it builds the pipelines of every frame ahead, so that none is late. Here nobody waits for a frame,
  // and those that the chosen frames need are built when they are met.
  const bool progress = job.frames.size() > 1 && isatty(STDERR_FILENO) != 0;
  for (std::size_t i = 0; i < job.frames.size(); ++i) {
    if (auto done = renderFrame(job, **gpu, **renderer, draw, job.frames[i]); !done) return done;
    if (progress)
      fmt::print(stderr, "\r{}/{} frames on {}{}", i + 1, job.frames.size(), (*gpu)->deviceName(),
                 i + 1 == job.frames.size() ? "\n" : "");
  }
  return {};
}

int runRender(const RenderArguments& arguments) {
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

}  // namespace

void addRender(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Draw frames of a pack to PNG or EXR pictures");
  command->footer(
      "EXR holds premultiplied linear RGBA (half) and depth Z along the view (single).\n"
      "Examples:\n"
      "  billow render fire.blw --frame 12 -o fire.png\n"
      "  billow render fire.blw --frame 5-12 -o fire.exr      writes fire_0005.exr to fire_0012.exr\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read or written, 3 invalid pack or scene, 4 no usable "
      "GPU");
  addRenderOptions(*command, *arguments);
  command->callback([arguments, &run] { run = [arguments] { return runRender(*arguments); }; });
}

}  // namespace billow::command
