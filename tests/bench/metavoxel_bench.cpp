// What metavoxels cost on a real GPU: billow_metavoxel_bench [PACK] [--frames N] [--frame I] [--size WxH] [--device D]
// [--picture FILE.ppm] evaluates an effect's particles on CPU and GPU; with a pack it then draws the pack's frame in a
// cloud of displaced spheres and prints, for each scene, the median time of every pass, of all, and the memory. It
// needs nothing but libvulkan and a driver at run time.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "bench_failure.h"
#include "billow/format/effect.h"
#include "billow/format/noise.h"
#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"

namespace {

using namespace billow;
using bench::fail;
using bench::valueOf;

struct Options {
  std::string pack;
  std::uint32_t draws = 25;
  std::uint32_t frame = format::kNone;  // index; default: the middle one
  std::uint32_t width = 1920, height = 1080;
  std::chrono::milliseconds warmUp{400};
  std::string picture;  // of the scene of 1000 spheres
  headless::DeviceOptions device;
};

struct Scene {
  const char* name;
  std::uint32_t spheres;
  bool volume;
  std::uint32_t metavoxels;  // along an axis of the space
  double spread;             // of the spheres, in voxels: half of the region's width
  std::uint64_t budget;
  bool kept = false;         // only what changed is filled
  std::uint32_t moving = 0;  // of the spheres, from draw to draw
  std::uint32_t lightField = 0;
  std::uint32_t layers = 1;  // of the volume, of as many frames
  bool carried = false;      // along a velocity
};

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr Scene kScenes[] = {
    {"volume alone", 0, true, 34, 300, 3072 * kMiB},
    {"1000 spheres", 1000, false, 34, 300, 3072 * kMiB},
    {"1000 and volume", 1000, true, 34, 300, 3072 * kMiB},
    {"10000 and volume", 10000, true, 34, 300, 3072 * kMiB},
    {"1000, twice as wide", 2000, false, 34, 300 * 1.41421356, 3072 * kMiB},
    {"1000 and volume, 512^3", 1000, true, 17, 200, 3072 * kMiB},
    {"the same, 1024^3", 1000, true, 34, 200, 3072 * kMiB},
    {"the same, 2048^3", 1000, true, 68, 200, 3072 * kMiB},
    {"the same, 4096^3", 1000, true, 128, 200, 3072 * kMiB},
    {"1000 and volume, 128 MB", 1000, true, 34, 300, 128 * kMiB},
    {"1000 and volume, kept", 1000, true, 34, 300, 3072 * kMiB, true},
    {"the same, 10 move", 1000, true, 34, 300, 3072 * kMiB, true, 10},
    {"the same, 100 move", 1000, true, 34, 300, 3072 * kMiB, true, 100},
    {"the same, all move", 1000, true, 34, 300, 3072 * kMiB, true, 1000},
    {"volume alone, light field", 0, true, 34, 300, 3072 * kMiB, false, 0, 136},
    {"volume, 2 layers", 0, true, 34, 300, 3072 * kMiB, false, 0, 0, 2},
    {"volume, carried", 0, true, 34, 300, 3072 * kMiB, false, 0, 0, 1, true},
    {"volume, 2 layers, carried", 0, true, 34, 300, 3072 * kMiB, false, 0, 0, 2, true},
    {"1000, volume, light field", 1000, true, 34, 300, 3072 * kMiB, false, 0, 136},
    {"the same, of half as fine", 1000, true, 34, 300, 3072 * kMiB, false, 0, 68},
    {"the same, 192 MB", 1000, true, 34, 300, 192 * kMiB, false, 0, 68},
};

Options parse(int argc, char** argv) {
  Options options;
  const auto number = [&](int i) {
    if (i >= argc) fail("an option lacks its value");
    return static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10));
  };
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--frames")
      options.draws = std::max(1u, number(++i));
    else if (argument == "--frame")
      options.frame = number(++i);
    else if (argument == "--device")
      options.device.device = number(++i);
    else if (argument == "--picture" && i + 1 < argc)
      options.picture = argv[++i];
    else if (argument == "--size") {
      if (++i >= argc || std::sscanf(argv[i], "%ux%u", &options.width, &options.height) != 2) fail("--size WxH");
    } else
      options.pack = argument;
  }
  return options;
}

// Values of [0, 1] as blocks between 1 and 0 in eight steps.
format::CubeMap noiseMap(std::uint32_t seed) {
  format::CubeMap map{};
  for (std::uint32_t level = 0; level < format::kCubeLevels; ++level) {
    const std::uint32_t edge = format::kCubeEdge >> level, blocks = format::cubeBlocks(level);
    for (std::uint32_t b = 0; b < blocks * blocks * format::kCubeFaces; ++b) {
      std::uint64_t indices = 0;
      for (std::uint32_t i = 0; i < 16; ++i) {
        const auto share = [&](std::uint32_t at) { return (static_cast<float>(at) + 0.5f) / static_cast<float>(edge); };
        const auto d = format::cubeDirection(
            {b / (blocks * blocks), share(b % blocks * 4 + i % 4), share(b / blocks % blocks * 4 + i / 4)});
        const float size = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / 3;
        const float value = format::erosionNoise(d[0] / size + 9, d[1] / size + 9, d[2] / size + 9, seed);
        const auto step = static_cast<std::uint64_t>(std::lround((1 - value) * 7));  // 0: 1, 7: 0
        indices |= (step == 0 ? 0 : step == 7 ? 1 : step + 1) << (3 * i);
      }
      const std::size_t at = format::cubeLevelOffset(level) + std::size_t{b} * format::kBc4Bytes;
      map.blocks[at] = std::byte{255};
      map.blocks[at + 1] = std::byte{0};
      for (std::size_t i = 0; i < 6; ++i) map.blocks[at + 2 + i] = static_cast<std::byte>(indices >> (8 * i) & 0xff);
    }
  }
  return map;
}

format::EffectTables dustTables() {
  format::EffectTables tables;
  tables.materials = {{.profile = format::kProfileRadial,
                       .profileRow = format::kNoRow,
                       .diffuseRamp = format::kNoRow,
                       .emissionRamp = format::kNoRow,
                       .erosion = 0,
                       .erosionFrequency = 1,
                       .occlusion = 0.5f,
                       .softness = 0.25f}};
  for (std::uint32_t seed = 1; seed <= 4; ++seed) tables.maps.push_back(noiseMap(seed));
  return tables;
}

// Displaced spheres of 8 to 30 voxels in a flat box around `center`.
std::vector<format::Particle> dust(const Scene& scene, const std::array<double, 3>& center, double voxel) {
  std::mt19937 random(5);
  const auto number = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 8) / 16777216.0;
  };
  std::vector<format::Particle> particles(scene.spheres);
  for (std::uint32_t i = 0; i < scene.spheres; ++i) {
    format::Particle& particle = particles[i];
    const double reach[3] = {scene.spread, scene.spread, 80};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      particle.center[axis] = static_cast<float>(center[axis] + number(-reach[axis], reach[axis]) * voxel);
    }
    particle.radius = static_cast<float>(number(8, 30) * voxel);
    particle.rotation[3] = 1;
    particle.displacement = 0.6f;
    const float brown[3] = {0.8f, 0.7f, 0.6f};
    std::copy(brown, brown + 3, particle.diffuse);
    particle.extinction = static_cast<float>(0.08 / voxel);
    particle.map = i % 4;
    particle.seed = i;
  }
  return particles;
}

// An effect of about 15 000 particles that are alive at any time, with all that the closed form and looks can have.
format::EffectTables effectTables() {
  format::EffectTables tables = dustTables();
  for (std::uint32_t row = 0; row < 8; ++row) {
    format::CurveRow& curve = tables.curves.emplace_back();
    for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
      curve.values[i] = 0.5f + 0.4f * std::sin(static_cast<float>(i * (row + 1)) * 0.05f);
    }
  }
  format::EffectRecord effect{};
  effect.emitterCount = 1;
  effect.flags = format::kEffectLoop | format::kEffectPrewarm;
  effect.duration = 4;
  tables.effects.push_back(effect);
  format::EmitterRecord emitter{};
  emitter.spanCount = 1;
  emitter.shape = format::kShapeSphere;
  emitter.extent[0] = 1;
  emitter.positionRow = 0;
  emitter.lifetime[0] = 2;
  emitter.lifetime[1] = 4;
  emitter.direction[1] = 1;
  emitter.spreadCosine = 0.5f;
  emitter.speed[1] = 3;
  emitter.gravity[1] = -1;
  emitter.drag = 0.4f;
  emitter.radius[0] = emitter.radius[1] = 0.1f;
  emitter.radiusRow = 3;
  emitter.extinction = 1;
  emitter.opacityRow = 4;
  std::fill_n(emitter.diffuse, 3, 0.5f);
  emitter.diffuseRow = 5;
  emitter.emissionRow = emitter.displacementRow = format::kNoRow;
  emitter.rotationRow = 6;
  emitter.mapCount = 4;
  emitter.mapsPerSecond = 2;
  emitter.track = format::kNoTrack;
  tables.emitters.push_back(emitter);
  tables.spans.push_back({0, 4, 0, 20000});
  return tables;
}

template <class Rows>
double median(const Rows& rows, std::size_t from, std::size_t to) {
  std::vector<double> values;
  for (const headless::PassTimes& row : rows) {
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += row[i];
    values.push_back(sum);
  }
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void writePicture(const std::string& path, const headless::Picture& picture) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail("cannot write " + path);
  fmt::print(file, "P6 {} {} 255\n", picture.width, picture.height);
  for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    const float value = std::clamp(std::pow(std::max(picture.rgba[i], 0.0f), 1 / 2.2f), 0.0f, 1.0f);
    std::fputc(static_cast<int>(value * 255 + 0.5f), file);
  }
  std::fclose(file);
}

// The velocity that the volume has, or a made one: of the values that its other grids have along each axis.
runtime::GridChoice carriedGrids(const format::Pack& pack, const format::VolumeRecord& volume,
                                 const runtime::GridChoice& grids) {
  runtime::GridChoice choice = runtime::withVelocity(pack, volume, grids);
  const std::uint32_t other = grids.temperature != format::kNone ? grids.temperature : grids.extinction;
  for (std::uint32_t* axis : {&choice.velocityX, &choice.velocityY, &choice.velocityZ}) {
    if (*axis == format::kNone) *axis = other;
  }
  return choice;
}

// World units a second that a velocity's 1 must be for `voxels` voxels a second where it is largest.
float velocityScale(const format::Pack& pack, const format::VolumeRecord& volume, const runtime::GridChoice& grids,
                    std::uint32_t frame, double voxels) {
  const format::GridFrame& grid = pack.gridFrame(volume, frame, grids.velocityX);
  const float most = std::max(std::abs(grid.valueMin), std::abs(grid.valueMax));
  return static_cast<float>(voxels * std::abs(grid.indexToWorld[0])) / std::max(most, 1e-6f);
}

void measure(headless::Headless& gpu, const format::Pack& pack, const Options& options, const Scene& scene,
             const format::EffectTables& tables) {
  const format::VolumeRecord& volume = pack.volumes()[0];
  const runtime::GridChoice grids = runtime::chooseGrids(pack, volume);
  const auto renderer = valueOf(runtime::Renderer::create(gpu.host(), {.gpuBudget = std::uint64_t{8} << 30}));
  const std::uint32_t frameIndex = options.frame != format::kNone ? options.frame : volume.frameCount / 2;
  const runtime::GridChoice uploaded = scene.carried ? carriedGrids(pack, volume, grids) : grids;
  std::vector<std::unique_ptr<runtime::Frame>> frames;
  std::vector<runtime::Layer> layers;
  for (std::uint32_t i = 0; i < scene.layers; ++i) {
    const std::uint32_t index = std::min(frameIndex + i, volume.frameCount - 1);
    frames.push_back(valueOf(renderer->upload(pack, 0, index, {.grids = uploaded})));
    const float share = 1 / static_cast<float>(scene.layers);
    layers.push_back({frames.back().get(), share, scene.carried ? 0.5f - static_cast<float>(i) : 0});
  }
  const runtime::MetavoxelConfig config{.metavoxels = scene.metavoxels,
                                        .memoryBudget = scene.budget,
                                        .maxMetavoxels = 6144,
                                        .maxListEntries = 1u << 20,
                                        .lightField = scene.lightField,
                                        .keepFilled = scene.kept,
                                        .tables = &tables};
  const auto metavoxels = valueOf(runtime::Metavoxels::create(*renderer, config));
  const runtime::WorldBox box = runtime::worldBox(pack, volume, grids, frameIndex, frameIndex);
  const format::GridFrame& grid =
      pack.gridFrame(volume, frameIndex, grids.extinction != format::kNone ? grids.extinction : grids.temperature);
  runtime::MetavoxelDraw draw;
  draw.voxelSize = static_cast<float>(std::abs(grid.indexToWorld[0]));
  const double voxel = double{draw.voxelSize};
  std::array<double, 3> eye{};
  const double towards[3] = {0.55, -0.75, 0.35};
  for (std::size_t i = 0; i < 3; ++i) {
    draw.center[i] = (box.min[i] + box.max[i]) / 2;
    eye[i] = draw.center[i] + towards[i] * 1100 * voxel;
  }
  draw.view = runtime::lookAt(eye, draw.center, {0, 0, 1}, 35);
  draw.sun.direction = {-0.6f, -0.4f, 0.7f};
  draw.width = options.width;
  draw.height = options.height;
  const std::vector<runtime::MetavoxelVolume> volumes{
      {.layers = layers,
       .velocityScale = scene.carried ? velocityScale(pack, volume, uploaded, frameIndex, 6) : 1,
       .look = valueOf(runtime::suggestLook(pack, volume, grids))}};
  if (scene.volume) draw.volumes = volumes;
  if (scene.kept) draw.refill = runtime::Refill::changed;
  std::vector<format::Particle> particles = dust(scene, draw.center, voxel);
  draw.particles = particles;
  // The first draws build the pipelines, and the clocks of a device that was idle take a while to rise.
  const auto begin = std::chrono::steady_clock::now();
  do {
    valueOf(gpu.time(*renderer, *metavoxels, draw, std::min(options.draws, 5u)));
  } while (std::chrono::steady_clock::now() - begin < options.warmUp);
  std::vector<headless::PassTimes> rows;
  for (std::uint32_t i = 0; i < options.draws; ++i) {
    for (std::uint32_t k = 0; k < scene.moving; ++k) particles[k].center[2] += static_cast<float>(voxel / 4);
    rows.push_back(valueOf(gpu.time(*renderer, *metavoxels, draw, 1))[0]);
  }
  const runtime::MetavoxelStats stats = metavoxels->stats();
  fmt::print("{:<26} {:>6} {:>6} {:>6} {:>8} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.1f}\n",
             scene.name, metavoxels->poolSlots(), stats.occupied, stats.filled, stats.listEntries, median(rows, 0, 1),
             median(rows, 1, 2), median(rows, 2, 3), median(rows, 3, 4), median(rows, 4, 5), median(rows, 0, 5),
             static_cast<double>(metavoxels->bytesAllocated()) / 1e6);
  std::fflush(stdout);
  if (scene.spheres == 1000 && !options.picture.empty() && scene.spread > 250) {
    writePicture(options.picture, valueOf(gpu.render(*renderer, *metavoxels, draw, {})));
  }
  gpu.waitIdle();
}

double secondsOf(const auto& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// An effect outside of the space, so that the first stage of a draw is the copying and evaluating of particles alone.
void measureEffect(headless::Headless& gpu, const Options& options) {
  const format::EffectTables tables = effectTables();
  constexpr double kTime = 10;
  const auto renderer = valueOf(runtime::Renderer::create(gpu.host(), {}));
  const auto metavoxels = valueOf(runtime::Metavoxels::create(
      *renderer, {.metavoxels = 8, .maxMetavoxels = 512, .maxParticles = 32768, .tables = &tables}));
  std::vector<format::Particle> particles = format::particlesAt(tables, 0, kTime);
  const double cpu = secondsOf([&] { particles = format::particlesAt(tables, 0, kTime); });
  std::size_t candidates = 0;
  const double plan = secondsOf([&] {
    for (const auto& some : format::candidatesAt(tables, 0, kTime)) candidates += some.last - some.first;
  });
  const runtime::MetavoxelEffect effect{.time = kTime, .objectToWorld = {1, 0, 0, 1e4, 0, 1, 0, 0, 0, 0, 1, 0}};
  for (format::Particle& particle : particles) particle.center[0] += 1e4f;
  runtime::MetavoxelDraw draw;
  draw.view = runtime::lookAt({0, 0, 50}, {0, 0, 0}, {0, 1, 0}, 35);
  draw.width = draw.height = 64;
  const auto firstStage = [&] {
    valueOf(gpu.time(*renderer, *metavoxels, draw, std::min(options.draws, 5u)));
    return median(valueOf(gpu.time(*renderer, *metavoxels, draw, options.draws)), 0, 1);
  };
  const double nothing = firstStage();
  draw.particles = particles;
  const double copied = firstStage();
  draw.particles = {};
  draw.effects = {&effect, 1};
  const double evaluated = firstStage();
  fmt::print("effect: {} particles alive of {} candidates\n", particles.size(), candidates);
  fmt::print("  CPU {:.3f} ms, {:.1f} million a second; candidates alone {:.3f} ms\n", cpu * 1e3,
             static_cast<double>(particles.size()) / cpu * 1e-6, plan * 1e3);
  fmt::print("  first stage: {:.3f} ms without particles, {:.3f} copied, {:.3f} evaluated: {:.1f} million a second\n",
             nothing, copied, evaluated, static_cast<double>(particles.size()) / (evaluated - nothing) * 1e-3);
  gpu.waitIdle();
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const auto gpu = valueOf(headless::Headless::create(options.device));
  fmt::print("{}, median of {} draws\n", gpu->deviceName(), options.draws);
  measureEffect(*gpu, options);
  if (options.pack.empty()) return 0;
  const format::Pack pack = valueOf(format::Pack::openFile(options.pack));
  if (pack.volumes().empty()) fail("the pack has no volume");
  const format::EffectTables tables = dustTables();
  fmt::print("{} on {}, {}x{}, median of {} draws, milliseconds\n", options.pack, gpu->deviceName(), options.width,
             options.height, options.draws);
  fmt::print("{:<26} {:>6} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "scene", "slots", "occup.",
             "filled", "entries", "bin", "fill", "light", "march", "rounds", "all", "MB");
  for (const Scene& scene : kScenes) measure(*gpu, pack, options, scene, tables);
  return 0;
}
