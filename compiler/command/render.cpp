#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "command.h"
#include "pack_lookup.h"
#include "render_arguments.h"
#include "render_contents.h"
#include "render_image.h"
#include "render_metavoxel.h"
#include "render_setup.h"
#include "render_stage.h"

namespace billow::command {
namespace {

int complain(const Refusal& refusal) {
  fmt::print(stderr, "billow: error: {}\n", refusal.message);
  return refusal.code;
}

tl::unexpected<Refusal> refuse(int code, const std::string& message) {
  return tl::unexpected(Refusal{code, message});
}

// One picture.
struct Moment {
  std::int32_t number;  // of the frame
  double time;          // seconds
  std::string output;
  std::optional<std::uint32_t> frame = {};  // an index, where a pack's only volume was asked for one
};

std::string outputName(const RenderRequest& request, std::int32_t number) {
  if (!request.range) return request.output;
  const std::filesystem::path path(request.output);
  const std::string name = fmt::format("{}_{:04}{}", path.stem().string(), number, path.extension().string());
  return (path.parent_path() / name).string();
}

// The frames of the pack's volume that were asked for.
Checked<std::vector<Moment>> framesOf(const RenderRequest& request, const PlacedVolume& volume) {
  const auto frames = volume.pack->framesOf(volume.record());
  std::vector<Moment> moments;
  for (std::uint32_t i = 0; i < frames.size(); ++i) {
    const std::int32_t number = frames[i].number;
    if (number < request.firstFrame || number > request.lastFrame) continue;
    moments.push_back({number, frames[i].time, outputName(request, number), i});
  }
  if (!moments.empty()) return moments;
  const std::string& file = volume.request->pack;
  if (frames.empty()) return refuse(kInvalid, file + ": the volume has no frame");
  return refuse(kCommandLine, fmt::format("--frame: {} has no such frame; it has {} to {}", file, frames.front().number,
                                          frames.back().number));
}

Checked<std::vector<Moment>> momentsOf(const RenderRequest& request, const Contents& contents) {
  if (request.time) return std::vector<Moment>{{0, *request.time, request.output}};
  if (!request.scene) return framesOf(request, contents.volumes().front());
  const std::int64_t count = std::int64_t{request.lastFrame} - request.firstFrame + 1;
  if (count > kMostFrames) {
    return refuse(kCommandLine, fmt::format("--frame asks for {} frames; expected at most {}", count, kMostFrames));
  }
  std::vector<Moment> moments;
  for (std::int64_t number = request.firstFrame; number <= request.lastFrame; ++number) {
    const auto frame = static_cast<std::int32_t>(number);
    moments.push_back({frame, static_cast<double>(frame) / request.framesPerSecond, outputName(request, frame)});
  }
  return moments;
}

// No picture may take the place of what it is drawn from.
Checked<void> checkOutputs(const std::vector<Moment>& moments, const std::vector<std::string>& inputs) {
  for (const Moment& moment : moments) {
    for (const std::string& input : inputs) {
      if (!sameFile(moment.output, input)) continue;
      return refuse(kCommandLine, fmt::format("-o {}: that is the input itself", moment.output));
    }
  }
  return {};
}

struct Job {
  const RenderRequest& request;
  const Contents& contents;
  std::vector<Moment> moments;
  bool png;
};

// The device, what draws on it, and the frames that were shown last.
class Painter {
 public:
  static Checked<Painter> make(const Job& job, SpaceNeeds needs) {
    Painter painter;
    auto gpu = headless::Headless::create({.device = job.request.device});
    if (!gpu) return tl::unexpected(toRefusal(gpu.error(), ""));
    painter.gpu_ = std::move(*gpu);
    auto renderer = runtime::Renderer::create(painter.gpu_->host(), {.gpuBudget = job.request.gpuBudget});
    if (!renderer) return tl::unexpected(toRefusal(renderer.error(), ""));
    painter.renderer_ = std::move(*renderer);
    painter.frames_.resize(job.contents.volumes().size());
    if (job.request.method == Method::direct) return painter;
    if (job.request.voxelSize) needs.lattice.edge = *job.request.voxelSize;
    // The other half is for the frames and their staging memory.
    auto metavoxels =
        MetavoxelPainter::make(*painter.renderer_, job.contents.tables(), needs, job.request.gpuBudget / 2,
                               {job.request.surroundings, job.request.bounces});
    if (!metavoxels) return tl::unexpected(toRefusal(metavoxels.error(), ""));
    painter.metavoxels_ = std::move(*metavoxels);
    return painter;
  }

  const std::string& deviceName() const { return gpu_->deviceName(); }

  Checked<headless::Picture> render(const Job& job, runtime::DrawInfo draw, const Moment& moment) {
    Shown shown;
    shown.layers.resize(frames_.size());
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const PlacedVolume& volume = job.contents.volumes()[i];
      const auto shares = moment.frame ? std::vector<FrameShare>{{*moment.frame}}
                                       : volume.framesAt(moment.time, job.request.interpolate);
      auto layers = layersOf(volume, frames_[i], shares);
      if (!layers) return tl::unexpected(layers.error());
      shown.layers[i] = std::move(*layers);
      if (!shares.empty()) shown.volumes.push_back(placed(job.request, volume, shown.layers[i], draw.look));
    }
    shown.effects = job.contents.effectsAt(moment.time);
    if (!metavoxels_) {
      if (shown.volumes.empty()) {
        return refuse(kInvalid, fmt::format("{}: no frame shows {} s after the begin; \"direct\" draws one",
                                            job.request.volumes[0].place, moment.time));
      }
      draw.layers = shown.layers[0];
      draw.look = shown.volumes[0].look;
    }
    auto picture = metavoxels_ ? metavoxels_->render(*gpu_, *renderer_, draw, shown) : gpu_->render(*renderer_, draw);
    gpu_->waitIdle();
    if (!picture) return tl::unexpected(toRefusal(picture.error(), ""));
    return std::move(*picture);
  }

 private:
  using ResidentFrames = std::map<std::uint32_t, std::unique_ptr<runtime::Frame>>;  // by index

  // The volume's frames, uploaded; of others nothing is kept, so that there is room.
  Checked<std::vector<runtime::Layer>> layersOf(const PlacedVolume& volume, ResidentFrames& resident,
                                                std::span<const FrameShare> shares) {
    std::erase_if(resident, [&](const auto& entry) {
      return std::none_of(shares.begin(), shares.end(), [&](const FrameShare& s) { return s.frame == entry.first; });
    });
    std::vector<runtime::Layer> layers;
    for (const FrameShare& share : shares) {
      std::unique_ptr<runtime::Frame>& place = resident[share.frame];
      if (!place) {
        auto frame = renderer_->upload(*volume.pack, volume.number, share.frame, {.grids = volume.grids});
        if (!frame) return tl::unexpected(toRefusal(frame.error(), volume.request->pack));
        place = std::move(*frame);
      }
      layers.push_back({place.get(), share.weight, share.advect});
    }
    return layers;
  }

  // In the order in which they are made; destroyed the other way round.
  std::unique_ptr<headless::Headless> gpu_;
  std::unique_ptr<runtime::Renderer> renderer_;
  std::optional<MetavoxelPainter> metavoxels_;
  std::vector<ResidentFrames> frames_;  // by volume
};

Checked<void> renderMoments(const Job& job) {
  std::vector<double> times;
  for (const Moment& moment : job.moments) times.push_back(moment.time);
  SpaceNeeds needs;
  const auto stage = stageOf(job.contents, times, needs);
  if (!stage) return tl::unexpected(stage.error());
  const runtime::DrawInfo draw = setUp(job.request, *stage, suggestedLook(job.contents), job.png);
  auto painter = Painter::make(job, needs);
  if (!painter) return tl::unexpected(painter.error());
  // No prepare(): it builds the pipelines of every frame ahead, so that none is late. Here nobody waits for a frame,
  // and those that the chosen frames need are built when they are met.
  const bool progress = job.moments.size() > 1 && isatty(STDERR_FILENO) != 0;
  for (std::size_t i = 0; i < job.moments.size(); ++i) {
    const auto picture = painter->render(job, draw, job.moments[i]);
    if (!picture) return tl::unexpected(picture.error());
    writeWhole(job.moments[i].output, job.png ? encodePng(*picture, job.request.exposure) : encodeExr(*picture));
    if (progress)
      fmt::print(stderr, "\r{}/{} frames on {}{}", i + 1, job.moments.size(), painter->deviceName(),
                 i + 1 == job.moments.size() ? "\n" : "");
  }
  return {};
}

Checked<void> render(const RenderArguments& arguments) {
  const auto request = makeRequest(arguments);
  if (!request) return tl::unexpected(request.error());
  const auto contents = Contents::find(*request);
  if (!contents) return tl::unexpected(contents.error());
  auto moments = momentsOf(*request, *contents);
  if (!moments) return tl::unexpected(moments.error());
  std::vector<std::string> inputs = contents->files();
  inputs.push_back(arguments.input);
  if (auto outputs = checkOutputs(*moments, inputs); !outputs) return outputs;
  const bool png = std::filesystem::path(request->output).extension() == ".png";
  return renderMoments({.request = *request, .contents = *contents, .moments = std::move(*moments), .png = png});
}

int runRender(const RenderArguments& arguments) {
  const auto done = render(arguments);
  return done ? kDone : complain(done.error());
}

}  // namespace

void addRender(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command =
      app.add_subcommand("render", "Draw frames and effects of a pack, or a scene of several, to PNG or EXR pictures");
  command->footer(
      "EXR holds premultiplied linear RGBA (half) and depth Z along the view (single).\n"
      "Examples:\n"
      "  billow render fire.blw --frame 12 -o fire.png\n"
      "  billow render fire.blw --frame 5-12 -o fire.exr      writes fire_0005.exr to fire_0012.exr\n"
      "  billow render smoke.blw --time 0.35 --interpolate advect -o smoke.png   between two frames\n"
      "  billow render smoke.blw --effect 'campfire smoke' --time 2 -o smoke.png\n"
      "  billow render fireplace.scene.json --frame 0-47 -o fireplace.png   frame N at N / 24 s\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read or written, 3 invalid pack or scene, 4 no usable "
      "GPU");
  addRenderOptions(*command, *arguments);
  command->callback([arguments, &run] { run = [arguments] { return runRender(*arguments); }; });
}

}  // namespace billow::command
