#include "recorder.h"

#include <algorithm>
#include <cstddef>

#include "debug.h"

namespace billow::runtime {

std::uint64_t spawnJobsAt(const MetavoxelUpload& upload, const MetavoxelDraw& draw) {
  static_assert(sizeof(gpu::SpawnJob) <= sizeof(format::Particle));
  return upload.particles + draw.particles.size_bytes();
}

void DrawRecorder::record(const MetavoxelDraw& draw, const DrawSteps& steps, bool first, bool keepFilled) {
  const DebugLabel label(device_.api, commands_, "billow metavoxels");
  stamp(draw, 0);
  begin(draw, steps, first);
  bin(steps, keepFilled);
  stamp(draw, 1);
  rounds(draw, steps);
  if (resources_.sizes().rounds > 1) {
    dispatch(steps.finish, {}, {(draw.width + 7) / 8, (draw.height + 7) / 8, 1});
  }
  const MetavoxelRegions& regions = resources_.sizes().regions;
  const std::uint64_t size = sizeof(gpu::MetavoxelCounters);
  const VkBufferCopy copy{regions.counters, inFlight_ * size, size};
  device_.api.vkCmdCopyBuffer(commands_, resources_.arrays.handle(), resources_.counters.handle(), 1, &copy);
  stamp(draw, 5);
}

void DrawRecorder::begin(const MetavoxelDraw& draw, const DrawSteps& steps, bool first) {
  const DebugLabel label(device_.api, commands_, "billow begin, spawn");
  const MetavoxelRegions& regions = resources_.sizes().regions;
  const VkBuffer arrays = resources_.arrays.handle();
  barrier();  // after the draw before
  if (first) {
    resources_.recordFirst(commands_);
    barrier();
  }
  pipelines_.bindView(commands_, inFlight_);
  indirect(steps.reset, {}, regions.counters + offsetof(gpu::MetavoxelCounters, reset));
  barrier();
  device_.api.vkCmdFillBuffer(commands_, arrays, regions.counters, sizeof(gpu::MetavoxelCounters), 0);
  const std::uint32_t groups = (resources_.sizes().shadowEdge() + 15) / 16;
  dispatch(steps.clear, {}, {groups, groups, 1});
  if (!draw.particles.empty()) {
    const VkBufferCopy copy{resources_.uploadOf(inFlight_).particles, regions.particles, draw.particles.size_bytes()};
    device_.api.vkCmdCopyBuffer(commands_, resources_.uploads.handle(), arrays, 1, &copy);
  }
  if (!steps.spawns.jobs.empty()) {
    const VkBufferCopy copy{spawnJobsAt(resources_.uploadOf(inFlight_), draw), regions.jobs,
                            steps.spawns.jobs.size() * sizeof(gpu::SpawnJob)};
    device_.api.vkCmdCopyBuffer(commands_, resources_.uploads.handle(), arrays, 1, &copy);
  }
  barrier();
  if (steps.spawns.jobs.empty()) return;
  dispatch(steps.spawn, {}, {(steps.spawns.candidates + 63) / 64, 1, 1});
  barrier();
}

void DrawRecorder::bin(const DrawSteps& steps, bool keepFilled) {
  const DebugLabel label(device_.api, commands_, "billow bin");
  const std::uint32_t particles = steps.particles;
  const std::array<std::uint32_t, 3> groups{std::min(particles, gpu::kBinRow),
                                            (particles + gpu::kBinRow - 1) / gpu::kBinRow, 1};
  const std::uint64_t rank = resources_.sizes().regions.counters + offsetof(gpu::MetavoxelCounters, rank);
  if (particles != 0) dispatch(steps.binCount, {}, groups);
  for (std::uint32_t i = 0; i < steps.layers.size(); ++i) {
    const LayerSteps& layer = steps.layers[i];
    const auto& first = layer.placed.cells->first;
    pipelines_.bindLayer(commands_, inFlight_, i);
    dispatch(layer.bin, {.volume = layer.volume, .box = {first[0], first[1], first[2], 0}}, layer.placed.cells->count);
  }
  pipelines_.bindView(commands_, inFlight_);
  barrier();
  dispatch(steps.plan, {}, {1, 1, 1});
  barrier();
  if (keepFilled) keep(steps, rank);
  indirect(steps.rank, {}, rank);
  barrier();
  if (particles != 0) dispatch(steps.binWrite, {}, groups);
  barrier();
  if (!keepFilled) return;
  const std::uint64_t counters = resources_.sizes().regions.counters;
  indirect(steps.compare, {}, counters + offsetof(gpu::MetavoxelCounters, check));
  barrier();
}

// Which slots stay their cells', and which may be given away.
void DrawRecorder::keep(const DrawSteps& steps, std::uint64_t rank) {
  const MetavoxelSizes& sizes = resources_.sizes();
  indirect(steps.keep, {}, rank);
  barrier();
  dispatch(steps.spare, {}, {(std::min(sizes.slots(), sizes.most) + 255) / 256, 1, 1});
  barrier();
}

// Light from matter to matter needs all of it before any is lit: then all rounds are filled twice, unless there is
// but one.
void DrawRecorder::rounds(const MetavoxelDraw& draw, const DrawSteps& steps) {
  const std::uint32_t count = resources_.sizes().rounds;
  const bool shining = fieldDrawn(draw, resources_.sizes());
  for (std::uint32_t round = 0; round < count && shining; ++round) {
    fill(draw, steps, round, round == 0);
    indirect(steps.inject, {.round = round}, roundAt(round) + offsetof(gpu::MetavoxelRound, columns));
    barrier();
  }
  if (shining) field(draw, steps);
  if (shining && count > 1) {  // what there is to fill is counted anew
    dispatch(steps.plan, {.round = 1}, {1, 1, 1});
    barrier();
  }
  for (std::uint32_t round = 0; round < count; ++round) {
    if (!shining || count > 1) fill(draw, steps, round, round == 0 && !shining);
    light(draw, steps, {.round = round, .finish = count == 1 ? 1u : 0u});
  }
}

std::uint64_t DrawRecorder::roundAt(std::uint32_t round) const {
  return resources_.sizes().regions.rounds + round * sizeof(gpu::MetavoxelRound);
}

// Fills a round's metavoxels and sums their columns.
void DrawRecorder::fill(const MetavoxelDraw& draw, const DrawSteps& steps, std::uint32_t round, bool first) {
  const DebugLabel label(device_.api, commands_, "billow fill");
  const std::uint64_t at = roundAt(round);
  PassPush push{.round = round};
  indirect(steps.blocks, push, at + offsetof(gpu::MetavoxelRound, blocks));
  barrier();
  for (std::uint32_t i = 0; i < steps.layers.size(); ++i) {
    pipelines_.bindLayer(commands_, inFlight_, i);
    push.volume = steps.layers[i].volume;
    push.level = steps.layers[i].layer;
    indirect(steps.layers[i].fill, push, at + offsetof(gpu::MetavoxelRound, volumes));
    barrier();
  }
  push.level = 0;
  pipelines_.bindView(commands_, inFlight_);
  indirect(steps.fill, push, at + offsetof(gpu::MetavoxelRound, fill));
  barrier();
  if (first) stamp(draw, 2);
  indirect(steps.sum, push, roundAt(round) + offsetof(gpu::MetavoxelRound, columns));
  barrier();
}

// Once all rounds are injected: what shines, level by level, then who gets how much of it; once a bounce.
void DrawRecorder::field(const MetavoxelDraw& draw, const DrawSteps& steps) {
  const DebugLabel label(device_.api, commands_, "billow light field");
  const FieldSizes& sizes = resources_.sizes().field;
  const auto over = [&](VkPipeline pipeline, const PassPush& push, std::uint32_t edge) {
    const std::uint32_t groups = (edge + 3) / 4;
    dispatch(pipeline, push, {groups, groups, groups});
    barrier();
  };
  for (std::uint32_t bounce = 0; bounce < draw.scattering.bounces; ++bounce) {
    for (std::uint32_t level = 0; level < sizes.levels; ++level) {
      over(steps.pyramid, {.round = bounce, .level = level}, sizes.level[level][3]);
    }
    over(steps.gather, {.round = bounce}, sizes.edge);
  }
}

void DrawRecorder::light(const MetavoxelDraw& draw, const DrawSteps& steps, const PassPush& push) {
  const DebugLabel label(device_.api, commands_, "billow light, march");
  const std::uint64_t columns = roundAt(push.round) + offsetof(gpu::MetavoxelRound, columns);
  indirect(steps.light, push, columns);
  barrier();
  if (push.round == 0) stamp(draw, 3);
  indirect(steps.march, push, roundAt(push.round) + offsetof(gpu::MetavoxelRound, march));
  indirect(steps.shadow, push, columns);
  barrier();
  if (push.round == 0) stamp(draw, 4);
}

void DrawRecorder::dispatch(VkPipeline pipeline, const PassPush& push, const std::array<std::uint32_t, 3>& groups) {
  device_.api.vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  pipelines_.push(commands_, push);
  device_.api.vkCmdDispatch(commands_, groups[0], groups[1], groups[2]);
}

void DrawRecorder::indirect(VkPipeline pipeline, const PassPush& push, std::uint64_t offset) {
  device_.api.vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  pipelines_.push(commands_, push);
  device_.api.vkCmdDispatchIndirect(commands_, resources_.arrays.handle(), offset);
}

// All that was written is there for all that follows.
void DrawRecorder::barrier() {
  auto memory = runtime::begin<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  memory.srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT |
                        VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT;
  memory.srcAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT;
  memory.dstStageMask = memory.srcStageMask;
  memory.dstAccessMask = VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_TRANSFER_READ_BIT |
                         VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT;
  auto info = runtime::begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.memoryBarrierCount = 1;
  info.pMemoryBarriers = &memory;
  device_.api.vkCmdPipelineBarrier2(commands_, &info);
}

void DrawRecorder::stamp(const MetavoxelDraw& draw, std::uint32_t number) {
  if (draw.timestamps == VK_NULL_HANDLE) return;
  device_.api.vkCmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, draw.timestamps,
                                   draw.firstTimestamp + number);
}

}  // namespace billow::runtime
