#include "billow/runtime/metavoxel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "checks.h"
#include "content.h"
#include "draw_checks.h"
#include "params.h"
#include "pipelines.h"
#include "recorder.h"
#include "resources.h"
#include "space.h"
#include "spawn.h"

namespace billow::runtime {
namespace {

class MetavoxelsImpl final : public Metavoxels {
 public:
  MetavoxelsImpl(Device& device, const MetavoxelConfig& config)
      : device_(device), config_(config), planner_(config.tables), resources_(device), pipelines_(device, config) {
    if (config.tables != nullptr) {
      materials_ = config.tables->materials.size();
      maps_ = config.tables->maps.size();
    }
    config_.tables = nullptr;
  }

  Result<void> initialise(const MetavoxelConfig& config) {
    if (auto made = resources_.create(config); !made) return made;
    return pipelines_.create();
  }

  Result<void> record(VkCommandBuffer commands, const MetavoxelDraw& draw) override {
    return guarded<void>([&]() -> Result<void> {
      if (auto fine = checkDraw(draw, config_); !fine) return fine;
      auto steps = prepare(draw);
      if (!steps) return tl::unexpected(steps.error());
      if (auto written = write(draw, *steps); !written) return written;
      DrawRecorder(device_, resources_, pipelines_, commands, next_)
          .record(draw, *steps, draws_ == 0, config_.keepFilled);
      next_ = (next_ + 1) % config_.recordsInFlight;
      ++draws_;
      space_ = steps->space;
      particles_ = steps->particles;
      return {};
    });
  }

  MetavoxelStats stats() const override {
    MetavoxelStats stats;
    for (std::uint32_t i = 0; i < config_.recordsInFlight; ++i) {
      gpu::MetavoxelCounters counters;
      const std::size_t at = i * sizeof(counters);
      std::memcpy(&counters, resources_.counters.mapped().subspan(at, sizeof(counters)).data(), sizeof(counters));
      if (counters.boxMax.w <= stats.draw) continue;
      stats = {.draw = counters.boxMax.w,
               .occupied = counters.wanted.x,
               .drawn = counters.wanted.z,
               .filled = counters.wanted.w,
               .listEntries = counters.wanted.y};
    }
    return stats;
  }

  MetavoxelShadow shadow() const override {
    MetavoxelShadow shadow{
        .image = resources_.shadow.handle(), .view = resources_.shadow.view(), .size = resources_.sizes().shadowEdge()};
    for (std::size_t row = 0; row < 2 && draws_ > 0; ++row) {
      double offset = space_.half;
      for (std::size_t i = 0; i < 3; ++i) {
        shadow.toTexel[row][i] = space_.axes[row][i] / space_.voxel;
        offset -= shadow.toTexel[row][i] * space_.center[i];
      }
      shadow.toTexel[row][3] = offset;
    }
    return shadow;
  }
  MetavoxelParticles particles() const override {
    return {.buffer = resources_.arrays.handle(),
            .offset = resources_.sizes().regions.particles,
            .count = particles_,
            .center = space_.center};
  }
  std::uint32_t poolSlots() const override { return resources_.sizes().slots(); }
  std::uint64_t bytesAllocated() const override { return resources_.bytes(); }

 private:
  Result<DrawSteps> prepare(const MetavoxelDraw& draw) {
    DrawSteps steps{};
    steps.space = spaceOf(draw, resources_.sizes());
    auto spawns = planner_.plan(draw, steps.space.center, config_.maxParticles);
    if (!spawns) return tl::unexpected(spawns.error());
    steps.spawns = std::move(*spawns);
    steps.particles = static_cast<std::uint32_t>(draw.particles.size()) + steps.spawns.candidates;
    const bool half = draw.colorFormat == ColorFormat::half;
    using enum MetavoxelPass;
    const std::pair<MetavoxelPass, VkPipeline*> wanted[] = {{clear, &steps.clear},
                                                            {reset, &steps.reset},
                                                            {spawn, &steps.spawn},
                                                            {binCount, &steps.binCount},
                                                            {binWrite, &steps.binWrite},
                                                            {plan, &steps.plan},
                                                            {rank, &steps.rank},
                                                            {blocks, &steps.blocks},
                                                            {fill, &steps.fill},
                                                            {sum, &steps.sum},
                                                            {light, &steps.light},
                                                            {inject, &steps.inject},
                                                            {pyramid, &steps.pyramid},
                                                            {gather, &steps.gather},
                                                            {MetavoxelPass::shadow, &steps.shadow},
                                                            {half ? marchHalf : marchSingle, &steps.march},
                                                            {half ? finishHalf : finishSingle, &steps.finish}};
    const std::pair<MetavoxelPass, VkPipeline*> kept[] = {
        {keep, &steps.keep}, {spare, &steps.spare}, {compare, &steps.compare}};
    if (auto made = makeAll(wanted, variantOf(draw)); !made) return tl::unexpected(made.error());
    if (config_.keepFilled) {
      if (auto made = makeAll(kept, {}); !made) return tl::unexpected(made.error());
    }
    for (std::uint32_t i = 0; i < draw.volumes.size(); ++i) {
      if (auto prepared = prepareVolume(draw, i, steps); !prepared) return tl::unexpected(prepared.error());
    }
    return steps;
  }

  static PassVariant variantOf(const MetavoxelDraw& draw) {
    return {.weighted = draw.blend == Blend::weighted, .sceneShadow = draw.sceneShadow.view != VK_NULL_HANDLE};
  }

  // Whether any draw may run the pass.
  bool needed(MetavoxelPass pass) const {
    using enum MetavoxelPass;
    if (pass == spawn) return planner_.hasEffects();
    return config_.lightField != 0 || (pass != inject && pass != pyramid && pass != gather);
  }

  Result<void> makeAll(std::span<const std::pair<MetavoxelPass, VkPipeline*>> wanted, const PassVariant& variant) {
    for (const auto& [pass, place] : wanted) {
      if (!needed(pass)) continue;
      const auto made = pipelines_.pipeline(pass, variant);
      if (!made) return tl::unexpected(made.error());
      *place = *made;
    }
    return {};
  }

  Result<void> prepareVolume(const MetavoxelDraw& draw, std::uint32_t number, DrawSteps& steps) {
    const MetavoxelVolume& volume = draw.volumes[number];
    std::uint32_t drawn = 0;
    for (const Layer& layer : layersOf(volume.frame, volume.layers)) {
      const auto placed = placeLayer(steps.space, draw, volume, layer);
      if (!placed) return badArgument("volumes[" + std::to_string(number) + "].objectToWorld");
      if (!placed->cells) continue;
      const FrameIndices indices = indicesOf(layer);
      const auto bin = pipelines_.pipeline(MetavoxelPass::binVolume, {}, indices);
      if (!bin) return tl::unexpected(bin.error());
      const auto fill = pipelines_.pipeline(MetavoxelPass::fillVolume, variantOf(draw), indices);
      if (!fill) return tl::unexpected(fill.error());
      steps.layers.push_back({.placed = *placed,
                              .frame = &frameOf(layer),
                              .volume = number,
                              .layer = drawn++,
                              .bin = *bin,
                              .fill = *fill});
    }
    return {};
  }

  // What the host writes for a draw: parameters and particles.
  Result<void> write(const MetavoxelDraw& draw, const DrawSteps& steps) {
    const MetavoxelUpload upload = resources_.uploadOf(next_);
    if (auto written = writeParticles(draw, steps.space, upload.particles); !written) return written;
    const std::vector<gpu::SpawnJob>& jobs = steps.spawns.jobs;
    for (std::size_t i = 0; i < jobs.size(); ++i) put(spawnJobsAt(upload, draw) + i * sizeof(gpu::SpawnJob), jobs[i]);
    const auto placed = paramsOf(steps.space, draw, config_, resources_.sizes(), draws_ + 1);
    if (!placed) return badArgument("sceneShadow.worldToMap");
    put(upload.view, viewOf(draw));
    for (std::size_t i = 0; i < steps.layers.size(); ++i) {
      put(upload.layers + i * kMarchStride, steps.layers[i].placed.params);
    }
    gpu::MetavoxelParams params = *placed;
    resources_.addAddresses(params);
    params.limits.x = steps.particles;
    params.spawn.z = static_cast<std::uint32_t>(steps.spawns.jobs.size());
    params.spawn.w = steps.spawns.candidates;
    params.matter.z = hashOf(steps.space);
    std::vector<VkImageView> atlases;
    for (const LayerSteps& layer : steps.layers) {
      const auto hash = hashOf(layer.placed, layer.frame->number_);
      gpu::uvec4& two = params.contents[layer.volume / 2];
      (layer.volume % 2 == 0 ? two.x : two.z) += hash[0];
      (layer.volume % 2 == 0 ? two.y : two.w) += hash[1];
      atlases.push_back(layer.frame->atlas_);
    }
    put(upload.space, params);
    pipelines_.write(resources_, next_, draw, atlases);
    return {};
  }

  template <class T>
  void put(std::uint64_t at, const T& value) {
    std::memcpy(resources_.uploads.mapped().subspan(at, sizeof(T)).data(), &value, sizeof(T));
  }

  Result<void> writeParticles(const MetavoxelDraw& draw, const Space& space, std::uint64_t at) {
    for (std::size_t i = 0; i < draw.particles.size(); ++i) {
      format::Particle particle = draw.particles[i];
      if (const char* field = badParticle(particle, materials_, maps_)) {
        return badArgument("particles[" + std::to_string(i) + "]." + field);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        particle.center[axis] = static_cast<float>(double{particle.center[axis]} - space.center[axis]);
      }
      put(at + i * sizeof(particle), particle);
    }
    return {};
  }

  Device& device_;
  MetavoxelConfig config_;
  std::size_t materials_ = 0, maps_ = 0;
  SpawnPlanner planner_;
  MetavoxelResources resources_;
  MetavoxelPipelines pipelines_;
  std::uint32_t next_ = 0;       // of the draws in flight
  std::uint32_t draws_ = 0;      // recorded so far
  Space space_{};                // of the last one
  std::uint32_t particles_ = 0;  // of the last one
};

}  // namespace

Result<std::unique_ptr<Metavoxels>> Metavoxels::create(Renderer& renderer, const MetavoxelConfig& config) {
  if (const char* field = badConfig(config)) {
    return failure(ErrorCode::argument, std::string("MetavoxelConfig: ") + field + " is outside of its range");
  }
  Device& device = renderer.device();
  return guarded<std::unique_ptr<Metavoxels>>([&]() -> Result<std::unique_ptr<Metavoxels>> {
    auto metavoxels = std::make_unique<MetavoxelsImpl>(device, config);
    if (auto ready = metavoxels->initialise(config); !ready) return tl::unexpected(ready.error());
    return std::unique_ptr<Metavoxels>(std::move(metavoxels));
  });
}

}  // namespace billow::runtime
