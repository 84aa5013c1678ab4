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
      recordAll(commands, draw, *steps);
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
  struct VolumeSteps {
    std::optional<PlacedVolume> placed;
    VkPipeline bin = VK_NULL_HANDLE, fill = VK_NULL_HANDLE;
    bool drawn() const { return placed && placed->cells; }
  };
  struct Steps {  // a draw's pipelines and volumes, all made before anything is recorded
    Space space;
    std::vector<VolumeSteps> volumes;
    SpawnPlan spawns;
    std::uint32_t particles;  // the host's and the effects'
    VkPipeline clear, reset, spawn, binCount, binWrite, plan, rank, blocks, fill, sum, light, inject, pyramid, gather,
        shadow, march, finish, keep, spare, compare;
  };

  Result<Steps> prepare(const MetavoxelDraw& draw) {
    Steps steps{};
    steps.space = spaceOf(draw, resources_.sizes());
    auto spawns = planner_.plan(draw, steps.space.center, config_.maxParticles);
    if (!spawns) return tl::unexpected(spawns.error());
    steps.spawns = std::move(*spawns);
    steps.particles = static_cast<std::uint32_t>(draw.particles.size()) + steps.spawns.candidates;
    const bool half = draw.colorFormat == ColorFormat::half;
    const bool weighted = draw.blend == Blend::weighted;
    using enum MetavoxelPass;
    const std::pair<MetavoxelPass, VkPipeline*> wanted[] = {{clear, &steps.clear},
                                                            {reset, &steps.reset},
                                                            {spawn, &steps.spawn},
                                                            {binCount, &steps.binCount},
                                                            {binWrite, &steps.binWrite},
                                                            {plan, &steps.plan},
                                                            {rank, &steps.rank},
                                                            {blocks, &steps.blocks},
                                                            {weighted ? fillWeighted : fill, &steps.fill},
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
    if (auto made = makeAll(wanted); !made) return tl::unexpected(made.error());
    if (config_.keepFilled) {
      if (auto made = makeAll(kept); !made) return tl::unexpected(made.error());
    }
    for (std::size_t i = 0; i < draw.volumes.size(); ++i) {
      auto volume = prepareVolume(steps.space, draw, i);
      if (!volume) return tl::unexpected(volume.error());
      steps.volumes.push_back(*volume);
    }
    return steps;
  }

  Result<void> makeAll(std::span<const std::pair<MetavoxelPass, VkPipeline*>> wanted) {
    for (const auto& [pass, place] : wanted) {
      if (pass == MetavoxelPass::spawn && !planner_.hasEffects()) continue;
      const auto made = pipelines_.pipeline(pass);
      if (!made) return tl::unexpected(made.error());
      *place = *made;
    }
    return {};
  }

  Result<VolumeSteps> prepareVolume(const Space& space, const MetavoxelDraw& draw, std::size_t number) {
    const auto& frame = static_cast<const ResidentFrame&>(*draw.volumes[number].frame);
    VolumeSteps steps;
    if (frame.empty()) return steps;
    steps.placed = placeVolume(space, draw, draw.volumes[number]);
    if (!steps.placed) return badArgument("volumes[" + std::to_string(number) + "].objectToWorld");
    const auto bin = pipelines_.pipeline(MetavoxelPass::binVolume, frame.indices());
    if (!bin) return tl::unexpected(bin.error());
    const bool weighted = draw.blend == Blend::weighted;
    const auto fill =
        pipelines_.pipeline(weighted ? MetavoxelPass::fillVolumeWeighted : MetavoxelPass::fillVolume, frame.indices());
    if (!fill) return tl::unexpected(fill.error());
    steps.bin = *bin;
    steps.fill = *fill;
    return steps;
  }

  // What the host writes for a draw: parameters and particles.
  Result<void> write(const MetavoxelDraw& draw, const Steps& steps) {
    const MetavoxelUpload upload = resources_.uploadOf(next_);
    if (auto written = writeParticles(draw, steps.space, upload.particles); !written) return written;
    const std::vector<gpu::SpawnJob>& jobs = steps.spawns.jobs;
    for (std::size_t i = 0; i < jobs.size(); ++i) put(jobsAt(draw) + i * sizeof(gpu::SpawnJob), jobs[i]);
    const auto placed = paramsOf(steps.space, draw, config_, resources_.sizes(), draws_ + 1);
    if (!placed) return badArgument("sceneShadow.worldToMap");
    put(upload.view, viewOf(draw));
    for (std::size_t i = 0; i < steps.volumes.size(); ++i) {
      if (steps.volumes[i].drawn()) put(upload.volumes + i * kMarchStride, steps.volumes[i].placed->params);
    }
    gpu::MetavoxelParams params = *placed;
    resources_.addAddresses(params);
    params.limits.x = steps.particles;
    params.spawn.z = static_cast<std::uint32_t>(steps.spawns.jobs.size());
    params.spawn.w = steps.spawns.candidates;
    params.matter.z = hashOf(steps.space);
    for (std::size_t i = 0; i < steps.volumes.size(); ++i) {
      if (!steps.volumes[i].drawn()) continue;
      const auto hash = hashOf(*steps.volumes[i].placed, draw.volumes[i].frame->uploadValue());
      gpu::uvec4& two = params.contents[i / 2];
      (i % 2 == 0 ? two.x : two.z) = hash[0];
      (i % 2 == 0 ? two.y : two.w) = hash[1];
    }
    put(upload.space, params);
    pipelines_.write(resources_, next_, draw);
    return {};
  }

  template <class T>
  void put(std::uint64_t at, const T& value) {
    std::memcpy(resources_.uploads.mapped().subspan(at, sizeof(T)).data(), &value, sizeof(T));
  }

  // Offset of the jobs in the memory that the host writes. None is empty or larger than a particle, so there is room.
  std::uint64_t jobsAt(const MetavoxelDraw& draw) const {
    static_assert(sizeof(gpu::SpawnJob) <= sizeof(format::Particle));
    return resources_.uploadOf(next_).particles + draw.particles.size_bytes();
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

  void recordAll(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps) {
    const std::uint32_t rounds = resources_.sizes().rounds;
    stamp(commands, draw, 0);
    recordBegin(commands, draw, steps);
    recordBin(commands, steps);
    stamp(commands, draw, 1);
    recordRounds(commands, draw, steps, rounds);
    if (rounds > 1) {
      dispatch(commands, steps.finish, {}, {(draw.width + 7) / 8, (draw.height + 7) / 8, 1});
    }
    const MetavoxelRegions& regions = resources_.sizes().regions;
    const std::uint64_t size = sizeof(gpu::MetavoxelCounters);
    const VkBufferCopy copy{regions.counters, next_ * size, size};
    device_.api.vkCmdCopyBuffer(commands, resources_.arrays.handle(), resources_.counters.handle(), 1, &copy);
    stamp(commands, draw, 5);
  }

  void recordBegin(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps) {
    const MetavoxelRegions& regions = resources_.sizes().regions;
    const VkBuffer arrays = resources_.arrays.handle();
    barrier(commands);  // after the draw before
    if (draws_ == 0) {
      resources_.recordFirst(commands);
      barrier(commands);
    }
    pipelines_.bindView(commands, next_);
    indirect(commands, steps.reset, {}, regions.counters + offsetof(gpu::MetavoxelCounters, reset));
    barrier(commands);
    device_.api.vkCmdFillBuffer(commands, arrays, regions.counters, sizeof(gpu::MetavoxelCounters), 0);
    const std::uint32_t groups = (resources_.sizes().shadowEdge() + 15) / 16;
    dispatch(commands, steps.clear, {}, {groups, groups, 1});
    if (!draw.particles.empty()) {
      const VkBufferCopy copy{resources_.uploadOf(next_).particles, regions.particles, draw.particles.size_bytes()};
      device_.api.vkCmdCopyBuffer(commands, resources_.uploads.handle(), arrays, 1, &copy);
    }
    if (!steps.spawns.jobs.empty()) {
      const VkBufferCopy copy{jobsAt(draw), regions.jobs, steps.spawns.jobs.size() * sizeof(gpu::SpawnJob)};
      device_.api.vkCmdCopyBuffer(commands, resources_.uploads.handle(), arrays, 1, &copy);
    }
    barrier(commands);
    if (steps.spawns.jobs.empty()) return;
    dispatch(commands, steps.spawn, {}, {(steps.spawns.candidates + 63) / 64, 1, 1});
    barrier(commands);
  }

  void recordBin(VkCommandBuffer commands, const Steps& steps) {
    const std::uint32_t particles = steps.particles;
    const std::array<std::uint32_t, 3> groups{std::min(particles, gpu::kBinRow),
                                              (particles + gpu::kBinRow - 1) / gpu::kBinRow, 1};
    const std::uint64_t rank = resources_.sizes().regions.counters + offsetof(gpu::MetavoxelCounters, rank);
    if (particles != 0) dispatch(commands, steps.binCount, {}, groups);
    for (std::uint32_t i = 0; i < steps.volumes.size(); ++i) {
      const VolumeSteps& volume = steps.volumes[i];
      if (!volume.drawn()) continue;
      const auto& first = volume.placed->cells->first;
      pipelines_.bindVolume(commands, next_, i);
      dispatch(commands, volume.bin, {.volume = i, .box = {first[0], first[1], first[2], 0}},
               volume.placed->cells->count);
    }
    pipelines_.bindView(commands, next_);
    barrier(commands);
    dispatch(commands, steps.plan, {}, {1, 1, 1});
    barrier(commands);
    if (config_.keepFilled) recordKeep(commands, steps, rank);
    indirect(commands, steps.rank, {}, rank);
    barrier(commands);
    if (particles != 0) dispatch(commands, steps.binWrite, {}, groups);
    barrier(commands);
    if (!config_.keepFilled) return;
    const std::uint64_t counters = resources_.sizes().regions.counters;
    indirect(commands, steps.compare, {}, counters + offsetof(gpu::MetavoxelCounters, check));
    barrier(commands);
  }

  // Which slots stay their cells', and which may be given away.
  void recordKeep(VkCommandBuffer commands, const Steps& steps, std::uint64_t rank) {
    const MetavoxelSizes& sizes = resources_.sizes();
    indirect(commands, steps.keep, {}, rank);
    barrier(commands);
    dispatch(commands, steps.spare, {}, {(std::min(sizes.slots(), sizes.most) + 255) / 256, 1, 1});
    barrier(commands);
  }

  // Light from matter to matter needs all of it before any is lit: then all rounds are filled twice, unless there is
  // but one.
  void recordRounds(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps, std::uint32_t rounds) {
    const bool field = fieldDrawn(draw, resources_.sizes());
    for (std::uint32_t round = 0; round < rounds && field; ++round) {
      recordFill(commands, draw, steps, round, round == 0);
      indirect(commands, steps.inject, {.round = round}, roundAt(round) + offsetof(gpu::MetavoxelRound, columns));
      barrier(commands);
    }
    if (field) recordField(commands, draw, steps);
    if (field && rounds > 1) {  // what there is to fill is counted anew
      dispatch(commands, steps.plan, {}, {1, 1, 1});
      barrier(commands);
    }
    for (std::uint32_t round = 0; round < rounds; ++round) {
      if (!field || rounds > 1) recordFill(commands, draw, steps, round, round == 0 && !field);
      recordLight(commands, draw, steps, {.round = round, .finish = rounds == 1 ? 1u : 0u});
    }
  }

  std::uint64_t roundAt(std::uint32_t round) const {
    return resources_.sizes().regions.rounds + round * sizeof(gpu::MetavoxelRound);
  }

  // Fills a round's metavoxels and sums their columns.
  void recordFill(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps, std::uint32_t round,
                  bool first) {
    const std::uint64_t at = roundAt(round);
    PassPush push{.round = round};
    indirect(commands, steps.blocks, push, at + offsetof(gpu::MetavoxelRound, blocks));
    barrier(commands);
    for (std::uint32_t i = 0; i < steps.volumes.size(); ++i) {
      if (!steps.volumes[i].drawn()) continue;
      pipelines_.bindVolume(commands, next_, i);
      push.volume = i;
      indirect(commands, steps.volumes[i].fill, push, at + offsetof(gpu::MetavoxelRound, volumes));
      barrier(commands);
    }
    pipelines_.bindView(commands, next_);
    indirect(commands, steps.fill, push, at + offsetof(gpu::MetavoxelRound, fill));
    barrier(commands);
    if (first) stamp(commands, draw, 2);
    indirect(commands, steps.sum, push, roundAt(round) + offsetof(gpu::MetavoxelRound, columns));
    barrier(commands);
  }

  // Once all rounds are injected: what shines, level by level, then who gets how much of it; once a bounce.
  void recordField(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps) {
    const FieldSizes& field = resources_.sizes().field;
    const auto over = [&](VkPipeline pipeline, const PassPush& push, std::uint32_t edge) {
      const std::uint32_t groups = (edge + 3) / 4;
      dispatch(commands, pipeline, push, {groups, groups, groups});
      barrier(commands);
    };
    for (std::uint32_t bounce = 0; bounce < draw.scattering.bounces; ++bounce) {
      for (std::uint32_t level = 0; level < field.levels; ++level) {
        over(steps.pyramid, {.round = bounce, .level = level}, field.level[level][3]);
      }
      over(steps.gather, {.round = bounce}, field.edge);
    }
  }

  void recordLight(VkCommandBuffer commands, const MetavoxelDraw& draw, const Steps& steps, const PassPush& push) {
    const std::uint64_t columns = roundAt(push.round) + offsetof(gpu::MetavoxelRound, columns);
    indirect(commands, steps.light, push, columns);
    barrier(commands);
    if (push.round == 0) stamp(commands, draw, 3);
    indirect(commands, steps.march, push, roundAt(push.round) + offsetof(gpu::MetavoxelRound, march));
    indirect(commands, steps.shadow, push, columns);
    barrier(commands);
    if (push.round == 0) stamp(commands, draw, 4);
  }

  void dispatch(VkCommandBuffer commands, VkPipeline pipeline, const PassPush& push,
                const std::array<std::uint32_t, 3>& groups) {
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    pipelines_.push(commands, push);
    device_.api.vkCmdDispatch(commands, groups[0], groups[1], groups[2]);
  }

  void indirect(VkCommandBuffer commands, VkPipeline pipeline, const PassPush& push, std::uint64_t offset) {
    device_.api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    pipelines_.push(commands, push);
    device_.api.vkCmdDispatchIndirect(commands, resources_.arrays.handle(), offset);
  }

  // All that was written is there for all that follows.
  void barrier(VkCommandBuffer commands) {
    auto memory = begin<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
    memory.srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT |
                          VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT;
    memory.srcAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT;
    memory.dstStageMask = memory.srcStageMask;
    memory.dstAccessMask = VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_TRANSFER_READ_BIT |
                           VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT;
    auto info = begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
    info.memoryBarrierCount = 1;
    info.pMemoryBarriers = &memory;
    device_.api.vkCmdPipelineBarrier2(commands, &info);
  }

  void stamp(VkCommandBuffer commands, const MetavoxelDraw& draw, std::uint32_t number) {
    if (draw.timestamps == VK_NULL_HANDLE) return;
    device_.api.vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, draw.timestamps,
                                     draw.firstTimestamp + number);
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
