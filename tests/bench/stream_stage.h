// What the stream bench plays on: a device, a renderer, metavoxels and a loop of frames; and how it judges what it is
// given to draw.
#ifndef BILLOW_TESTS_BENCH_STREAM_STAGE_H
#define BILLOW_TESTS_BENCH_STREAM_STAGE_H

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "../draw_loop.h"
#include "bench_failure.h"
#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"
#include "billow/runtime/stream.h"

namespace billow::bench {

using Clock = std::chrono::steady_clock;
inline double millisecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// The value below which a share of them lie; 0 of none.
inline double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

inline constexpr double kHertz = 60;
inline constexpr std::uint32_t kFramesInFlight = 2;
inline constexpr std::uint32_t kVolumesDrawn = 4;  // the first instances; all are updated and judged

// Where a pack is looked at from, and how.
struct Scene {
  runtime::Look look;
  std::array<double, 3> center{};
  double reach = 1;  // world units, half of the box's largest edge
  float voxel = 0.1f;
  double seconds = 1;  // of the volume, to its last frame
  double framesPerSecond = 24;
  std::uint32_t frames = 1;
  std::uint64_t gpuBytes = 0;   // of all frames, each alone, as Vulkan was asked for them
  std::uint64_t mostBytes = 0;  // of the largest
};

// Uploads every frame once, to know what it takes.
inline Scene sceneOf(headless::Headless& gpu, runtime::Renderer& renderer, const std::string& path) {
  const format::Pack pack = valueOf(format::Pack::openFile(path));
  if (pack.volumes().empty()) fail(path + " has no volume");
  const format::VolumeRecord& volume = pack.volumes()[0];
  const runtime::GridChoice grids = runtime::chooseGrids(pack, volume);
  Scene scene{.look = valueOf(runtime::suggestLook(pack, volume, grids)),
              .framesPerSecond = volume.framesPerSecond,
              .frames = volume.frameCount};
  const runtime::WorldBox box = runtime::worldBox(pack, volume, grids, 0, volume.frameCount - 1);
  double edge = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    scene.center[i] = (box.min[i] + box.max[i]) / 2;
    edge = std::max(edge, box.max[i] - box.min[i]);
  }
  scene.reach = edge / 2;
  scene.voxel = static_cast<float>(std::max(edge, 1e-3) / 128);
  const auto frames = pack.framesOf(volume);
  scene.seconds = frames.back().time - frames.front().time;
  for (std::uint32_t i = 0; i < volume.frameCount; ++i) {
    const auto frame = valueOf(renderer.upload(pack, 0, i, {}));
    scene.gpuBytes += frame->stats().allocatedBytes;
    scene.mostBytes = std::max(scene.mostBytes, frame->stats().allocatedBytes);
    gpu.waitIdle();
  }
  return scene;
}

class Stage {
 public:
  explicit Stage(const headless::DeviceOptions& device, bool draws)
      : gpu_(valueOf(headless::Headless::create(device))),
        renderer_(valueOf(runtime::Renderer::create(gpu_->host(), {.gpuBudget = std::uint64_t{4} << 30}))) {
    if (!draws) return;
    // Small: the bench asks whether frames are there and are drawn in time, not how fast passes are.
    metavoxels_ = valueOf(runtime::Metavoxels::create(*renderer_, {.edge = 16,
                                                                   .metavoxels = 10,
                                                                   .memoryBudget = std::uint64_t{128} << 20,
                                                                   .maxMetavoxels = 1000,
                                                                   .maxVolumes = kVolumesDrawn,
                                                                   .recordsInFlight = kFramesInFlight}));
    loop_ = valueOf(tests::DrawLoop::create(*gpu_, 128, 72, kFramesInFlight));
  }
  ~Stage() { gpu_->waitIdle(); }

  headless::Headless& gpu() { return *gpu_; }
  runtime::Renderer& renderer() { return *renderer_; }
  const tests::DrawLoop* loop() const { return loop_.get(); }

  void begin() {
    if (loop_ != nullptr) require(loop_->begin());
  }

  runtime::View view(const Scene& scene) const {
    const double far = scene.reach * 3.5;
    return runtime::lookAt({scene.center[0] + 0.55 * far, scene.center[1] - 0.75 * far, scene.center[2] + 0.35 * far},
                           scene.center, {0, 0, 1}, 35);
  }

  void draw(const Scene& scene, std::span<const runtime::Drawable> drawables, const runtime::UploadWait& wait) {
    if (loop_ == nullptr) return;
    std::vector<runtime::MetavoxelVolume> volumes;
    for (const runtime::Drawable& drawable : drawables.first(std::min<std::size_t>(drawables.size(), kVolumesDrawn))) {
      if (drawable.count == 0) continue;
      volumes.push_back({.layers = {drawable.layers.data(), drawable.count}, .look = scene.look});
    }
    runtime::MetavoxelDraw draw;
    draw.view = view(scene);
    draw.sun.direction = {-0.6f, -0.4f, 0.7f};
    draw.center = scene.center;
    draw.voxelSize = scene.voxel;
    draw.volumes = volumes;
    require(loop_->draw(*metavoxels_, draw, wait));
  }

 private:
  std::unique_ptr<headless::Headless> gpu_;
  std::unique_ptr<runtime::Renderer> renderer_;
  std::unique_ptr<runtime::Metavoxels> metavoxels_;
  std::unique_ptr<tests::DrawLoop> loop_;
};

// Counts over updates and instances.
struct Judged {
  std::uint64_t shown = 0;
  std::uint64_t late = 0;     // nothing of the wanted moment: the last one is held, or there is none
  std::uint64_t coarse = 0;   // the wanted moment, some of it coarser than the picture asks for
  std::uint64_t moments = 0;  // frames of volumes that were newly wanted
  // From the update() that wanted a moment to the one that drew it, or to the end where none did; and to the one that
  // drew it, or a later one, in full detail.
  std::vector<double> waitFrames, waitMs, fullFrames;
  std::vector<double> updateUs;
  std::uint64_t skipped = 0;  // ticks of the clock in which nothing was drawn, for the one before took too long
  double share(std::uint64_t count) const {
    return shown == 0 ? 0 : 100 * static_cast<double>(count) / static_cast<double>(shown);
  }
};

// A host that plays instances at kHertz, keeps its own idea of which frame each should show, and judges what it gets.
class Player {
 public:
  Player(Stage& stage, runtime::Streamer& streamer, const Scene& scene)
      : stage_(stage), streamer_(streamer), scene_(scene) {}

  void add(runtime::InstanceId id, double time, const runtime::Playback& playback) {
    actors_.push_back({.id = id, .time = time, .playback = playback});
  }
  void seek(std::size_t which, double time) {
    streamer_.seek(actors_[which].id, time);
    actors_[which].time = time;
    actors_[which].moment.reset();
  }
  std::size_t size() const { return actors_.size(); }

  // For a while that is judged. `paced`: by the clock; else as fast as it goes. `before` runs before each update.
  template <class Before>
  Judged play(double seconds, bool paced, const Before& before) {
    Judged judged;
    const auto updates = static_cast<std::uint64_t>(seconds * kHertz);
    Clock::time_point tick = Clock::now();
    for (std::uint64_t i = 0; i < updates; ++i) {
      before(i);
      stage_.begin();
      step(judged);
      if (!paced) continue;
      tick += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / kHertz));
      for (; tick < Clock::now(); ++judged.skipped) {
        tick += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / kHertz));
      }
      std::this_thread::sleep_until(tick);
    }
    for (Actor& actor : actors_) {
      met(actor, judged);
      metInFull(actor, judged);
    }
    return judged;
  }
  Judged play(double seconds, bool paced = true) {
    return play(seconds, paced, [](std::uint64_t) {});
  }

  // Plays on until everything that is wanted is shown, a second at least and at most `seconds`: how fast a game updates
  // is part of what planning goes by.
  void settle(double seconds) {
    for (const Clock::time_point begin = Clock::now(); millisecondsSince(begin) < seconds * 1e3;) {
      play(1);
      const auto shown = [&](const Actor& actor) {
        const runtime::Drawable drawable = streamer_.drawable(actor.id);
        return drawable.count != 0 && !drawable.held;
      };
      if (std::all_of(actors_.begin(), actors_.end(), shown)) return;
    }
  }

  // The game goes on, with as many updates as there is time for and `pause` microseconds between them, until `done()`;
  // false after `seconds`.
  template <class Done>
  bool until(double seconds, const Done& done, int pause = 200) {
    const Clock::time_point begin = Clock::now();
    for (Clock::time_point last = begin; millisecondsSince(begin) < seconds * 1e3;) {
      stage_.begin();
      const double passed = std::min(millisecondsSince(last) * 1e-3, 1 / kHertz);
      last = Clock::now();
      streamer_.update({.seconds = passed, .view = stage_.view(scene_)});
      for (Actor& actor : actors_) actor.time += actor.playback.speed * passed;
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(pause));
    }
    return false;
  }

  static bool full(const runtime::Drawable& drawable) {
    return drawable.count != 0 && !drawable.held && !drawable.coarse;
  }

 private:
  struct Actor {
    runtime::InstanceId id;
    double time;  // seconds, not folded into the volume's
    runtime::Playback playback;
    std::optional<std::int64_t> moment = {};  // frame that should be shown, not folded
    std::optional<std::uint64_t> wantedAt = {}, fullWantedAt = {};
    Clock::time_point wantedSince = {};
  };

  void step(Judged& judged) {
    const Clock::time_point begin = Clock::now();
    streamer_.update({.seconds = 1 / kHertz, .view = stage_.view(scene_)});
    judged.updateUs.push_back(millisecondsSince(begin) * 1e3);
    ++updates_;
    drawables_.clear();
    for (Actor& actor : actors_) {
      drawables_.push_back(streamer_.drawable(actor.id));
      judge(actor, drawables_.back(), begin, judged);
    }
    stage_.draw(scene_, drawables_, streamer_.wait());
  }

  // A moment that is not there when the next one is wanted goes on waiting: so long has there been nothing right to
  // see.
  void judge(Actor& actor, const runtime::Drawable& drawable, Clock::time_point begin, Judged& judged) {
    actor.time += actor.playback.speed / kHertz;
    const auto moment = static_cast<std::int64_t>(std::floor(actor.time * scene_.framesPerSecond));
    if (actor.moment != moment) {
      ++judged.moments;
      actor.moment = moment;
      if (!actor.wantedAt) {
        actor.wantedAt = updates_;
        actor.wantedSince = begin;
      }
      if (!actor.fullWantedAt) actor.fullWantedAt = updates_;
    }
    ++judged.shown;
    if (drawable.count == 0 || drawable.held) {
      ++judged.late;
      return;
    }
    judged.coarse += drawable.coarse ? 1 : 0;
    met(actor, judged);
    if (!drawable.coarse) metInFull(actor, judged);
  }

  void met(Actor& actor, Judged& judged) const {
    if (!actor.wantedAt) return;
    judged.waitFrames.push_back(static_cast<double>(updates_ - *actor.wantedAt));
    judged.waitMs.push_back(millisecondsSince(actor.wantedSince));
    actor.wantedAt.reset();
  }

  void metInFull(Actor& actor, Judged& judged) const {
    if (!actor.fullWantedAt) return;
    judged.fullFrames.push_back(static_cast<double>(updates_ - *actor.fullWantedAt));
    actor.fullWantedAt.reset();
  }

  Stage& stage_;
  runtime::Streamer& streamer_;
  const Scene& scene_;
  std::vector<Actor> actors_;
  std::vector<runtime::Drawable> drawables_;
  std::uint64_t updates_ = 0;
};

}  // namespace billow::bench

#endif  // BILLOW_TESTS_BENCH_STREAM_STAGE_H
