#include <algorithm>

#include "c_api/context.h"
#include "c_api/convert.h"
#include "c_api/effect_box.h"

namespace billow::c_api {
namespace {

// All effects of the packs, under the numbers that they have in the space.
Outcome<void> gatherEffects(const BillowContext& context, const BillowSpaceInfo& info, BillowSpace& space) {
  if (info.packCount > 0 && info.packs == nullptr) return badArgument("BillowSpaceInfo::packs is NULL");
  for (std::uint32_t i = 0; i < info.packCount; ++i) {
    const auto pack = packOf(context, info.packs[i]);
    if (!pack) return tl::unexpected(pack.error());
    std::vector<std::uint32_t>& numbers = space.effectNumbers[info.packs[i].id];
    if (!numbers.empty()) continue;
    const format::EffectTables& tables = (*pack)->effects();
    for (std::uint32_t effect = 0; effect < tables.effects.size(); ++effect) {
      numbers.push_back(space.effects.add(tables, effect));
      space.effectBoxes.resize(std::max<std::size_t>(space.effectBoxes.size(), numbers.back() + 1));
      space.effectBoxes[numbers.back()] = effectBox(tables, effect);
    }
  }
  return {};
}

runtime::MetavoxelConfig configOf(const BillowSpaceInfo& info) {
  return {.edge = info.edge,
          .metavoxels = info.metavoxels,
          .memoryBudget = info.memoryBudget,
          .maxMetavoxels = info.maxMetavoxels,
          .maxParticles = info.maxParticles,
          .maxListEntries = info.maxListEntries,
          .maxVolumes = info.maxVolumes,
          .lightField = info.lightField,
          .recordsInFlight = info.drawsInFlight,
          .keepFilled = info.keepFilled != 0};
}

Outcome<void> create(BillowContext& context, const BillowSpaceInfo* info, BillowSpace** into) {
  if (into == nullptr) return badArgument("space is NULL");
  const auto i = given(info);
  if (!i) return tl::unexpected(i.error());
  auto space = std::make_unique<BillowSpace>();
  space->context = &context;
  space->config = configOf(*i);
  if (auto gathered = gatherEffects(context, *i, *space); !gathered) return gathered;
  if (auto made = space->make(); !made) return made;
  context.spaces.push_back(space.get());
  *into = space.release();
  return {};
}

BillowSpaceStats statsOf(const BillowSpace& space) {
  BillowSpaceStats stats = BILLOW_SPACE_STATS_DEFAULT;
  if (space.metavoxels == nullptr) return stats;
  const runtime::MetavoxelStats from = space.metavoxels->stats();
  stats.draw = from.draw;
  stats.occupied = from.occupied;
  stats.drawn = from.drawn;
  stats.filled = from.filled;
  stats.listEntries = from.listEntries;
  stats.poolSlots = space.metavoxels->poolSlots();
  stats.bytes = space.metavoxels->bytesAllocated();
  return stats;
}

BillowSpaceShadow shadowOf(const BillowSpace& space) {
  BillowSpaceShadow shadow = BILLOW_SPACE_SHADOW_DEFAULT;
  if (space.metavoxels == nullptr) return shadow;
  const runtime::MetavoxelShadow from = space.metavoxels->shadow();
  shadow.texels = from.size;
  shadow.image = from.image;
  shadow.view = from.view;
  std::copy(from.toTexel[0].begin(), from.toTexel[0].end(), shadow.toTexel);
  std::copy(from.toTexel[1].begin(), from.toTexel[1].end(), shadow.toTexel + 4);
  return shadow;
}

}  // namespace
}  // namespace billow::c_api

billow::c_api::Outcome<void> BillowSpace::make() {
  if (context->renderer == nullptr) return billow::c_api::notReady("the context is detached");
  config.tables = &effects.tables();
  auto made = billow::runtime::Metavoxels::create(*context->renderer, config);
  if (!made) return billow::c_api::problem(made.error());
  metavoxels = std::move(*made);
  return {};
}

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowCreateSpace(BillowContext* context, const BillowSpaceInfo* info, BillowSpace** space,
                               BillowError* error) {
  return answering(error, [&] { return create(*context, info, space); });
}

void billowDestroySpace(BillowSpace* space) {
  if (space == nullptr) return;
  std::erase(space->context->spaces, space);
  delete space;
}

void billowSpaceStats(const BillowSpace* space, BillowSpaceStats* stats) {
  giveBack(statsOf(*space), stats);
}

void billowSpaceShadow(const BillowSpace* space, BillowSpaceShadow* shadow) {
  giveBack(shadowOf(*space), shadow);
}

}  // extern "C"
