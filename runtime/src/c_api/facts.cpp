#include <cmath>

#include "c_api/context.h"
#include "c_api/convert.h"
#include "c_api/effect_box.h"

namespace billow::c_api {
namespace {

Outcome<void> packInfo(const BillowContext& context, BillowPack pack, BillowPackInfo* into) {
  const auto open = packOf(context, pack);
  if (!open) return tl::unexpected(open.error());
  BillowPackInfo info = BILLOW_PACK_INFO_DEFAULT;
  info.volumes = static_cast<std::uint32_t>(context.packs.at(pack.id).volumes.size());
  info.effects = static_cast<std::uint32_t>((*open)->effects().effects.size());
  return answer(info, into);
}

Outcome<void> volumeInfo(const BillowContext& context, BillowPack pack, std::uint32_t volume, BillowVolumeInfo* into) {
  const auto facts = volumeOf(context, pack, volume);
  if (!facts) return tl::unexpected(facts.error());
  const format::Pack& open = *context.packs.at(pack.id).facted;
  const format::VolumeRecord& record = open.volumes()[(*facts)->number];
  BillowVolumeInfo info = BILLOW_VOLUME_INFO_DEFAULT;
  info.frames = record.frameCount;
  info.seconds = secondsOf(open, record);
  info.framesPerSecond = double{record.framesPerSecond};
  copyArray((*facts)->box.min, info.min);
  copyArray((*facts)->box.max, info.max);
  info.voxelSize = (*facts)->voxelSize;
  info.velocity = (*facts)->velocity ? 1 : 0;
  const runtime::GridChoice& grids = (*facts)->grids;
  info.burning = grids.temperature != format::kNone || grids.flames != format::kNone ? 1 : 0;
  copyName(open.string(record.name), info.name);
  return answer(info, into);
}

Outcome<void> effectInfo(const BillowContext& context, BillowPack pack, std::uint32_t effect, BillowEffectInfo* into) {
  const auto open = packOf(context, pack);
  if (!open) return tl::unexpected(open.error());
  const format::EffectTables& tables = (*open)->effects();
  if (effect >= tables.effects.size()) {
    return badArgument("the pack has no effect " + std::to_string(effect) + "; it has " +
                       std::to_string(tables.effects.size()));
  }
  const format::EffectRecord& record = tables.effects[effect];
  const runtime::WorldBox box = effectBox(tables, effect);
  BillowEffectInfo info = BILLOW_EFFECT_INFO_DEFAULT;
  info.loop = (record.flags & format::kEffectLoop) != 0 ? 1 : 0;
  info.seconds = double{record.duration};
  copyArray(box.min, info.min);
  copyArray(box.max, info.max);
  copyName((*open)->string(record.name), info.name);
  return answer(info, into);
}

Outcome<void> suggestLook(const BillowContext& context, BillowPack pack, std::uint32_t volume, BillowLook* into) {
  const auto facts = volumeOf(context, pack, volume);
  if (!facts) return tl::unexpected(facts.error());
  if (context.packs.at(pack.id).awaitsLooks) return notReady("the look is still measured");
  return answer(lookOf((*facts)->look), into);
}

}  // namespace
}  // namespace billow::c_api

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowPackInfo(const BillowContext* context, BillowPack pack, BillowPackInfo* info, BillowError* error) {
  return answering(error, [&] { return packInfo(*context, pack, info); });
}

BillowResult billowVolumeInfo(const BillowContext* context, BillowPack pack, uint32_t volume, BillowVolumeInfo* info,
                              BillowError* error) {
  return answering(error, [&] { return volumeInfo(*context, pack, volume, info); });
}

BillowResult billowEffectInfo(const BillowContext* context, BillowPack pack, uint32_t effect, BillowEffectInfo* info,
                              BillowError* error) {
  return answering(error, [&] { return effectInfo(*context, pack, effect, info); });
}

BillowResult billowSuggestLook(const BillowContext* context, BillowPack pack, uint32_t volume, BillowLook* look,
                               BillowError* error) {
  return answering(error, [&] { return suggestLook(*context, pack, volume, look); });
}

}  // extern "C"
