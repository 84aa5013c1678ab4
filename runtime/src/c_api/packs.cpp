#include <algorithm>

#include "c_api/context.h"
#include "c_api/convert.h"
#include "c_api/file.h"

namespace billow::c_api {
namespace {

runtime::AssetId assetOf(std::uint32_t pack) {
  return {.value = pack};
}

Outcome<OpenedPack*> known(BillowContext& context, BillowPack pack) {
  const auto found = context.packs.find(pack.id);
  if (found == context.packs.end()) return badArgument("there is no pack " + std::to_string(pack.id));
  return &found->second;
}

// A fit that is under way ends by itself, and nobody waits for it here.
void abandon(OpenedPack& pack) {
  if (pack.fit != nullptr) pack.fit->abandon();
  pack.fit.reset();
  pack.awaitsLooks = false;
}

// What could not be measured is drawn plainly.
void setLooks(const Looks& looks, OpenedPack& pack) {
  for (VolumeFacts& volume : pack.volumes) {
    if (volume.number < looks.size() && looks[volume.number]) volume.look = *looks[volume.number];
  }
}

// Facts of the pack as it is now. Until new looks are fitted the old ones stay.
void takeFacts(const format::Pack& now, OpenedPack& pack) {
  std::vector<VolumeFacts> facts = volumeFacts(now);
  for (std::size_t i = 0; i < facts.size() && pack.fitLooks; ++i) {
    if (i < pack.volumes.size()) facts[i].look = pack.volumes[i].look;
  }
  pack.volumes = std::move(facts);
  pack.facted = &now;
  pack.awaitsLooks = pack.fit != nullptr;
}

void becomeReady(BillowContext& context, std::uint32_t id, OpenedPack& pack) {
  pack.ready = true;
  for (auto& [number, instance] : context.instances) {
    if (instance.pack != id || instance.stream.value != 0) continue;
    if (auto started = startInstance(context, instance); !started) {
      Problem& problem = context.late.emplace_back(std::move(started.error()));
      problem.pack = id;
      problem.volume = instance.volume;
    }
  }
}

Outcome<BillowOpenInfo> openInfo(const BillowOpenInfo* info, runtime::PackSource& source) {
  auto taken = given(info);
  if (!taken) return taken;
  auto from = sourceOf(*taken);
  if (!from) return tl::unexpected(from.error());
  source = std::move(*from);
  return taken;
}

Outcome<void> open(BillowContext& context, const BillowOpenInfo* info, BillowPack* into, bool later) {
  if (into == nullptr) return badArgument("pack is NULL");
  runtime::PackSource source;
  const auto taken = openInfo(info, source);
  if (!taken) return tl::unexpected(taken.error());
  OpenedPack pack;
  pack.fitLooks = taken->noLooks == 0;
  if (pack.fitLooks) pack.fit = std::make_shared<LookFit>(source);
  const auto asset = later ? context.streamer->openLater(source) : context.streamer->open(source);
  if (!asset) return problem(asset.error());
  try {
    const auto fit = context.packs.emplace(asset->value, std::move(pack)).first->second.fit;
    if (fit != nullptr && later) context.fitter.add(fit);
    if (fit != nullptr && !later) fit->run();
    takeIn(context, asset->value);
  } catch (...) {
    context.packs.erase(asset->value);
    context.streamer->close(*asset);
    throw;
  }
  takeFile(source);
  into->id = asset->value;
  return {};
}

Outcome<void> reload(BillowContext& context, BillowPack pack, const BillowOpenInfo* info) {
  const auto entry = known(context, pack);
  if (!entry) return tl::unexpected(entry.error());
  runtime::PackSource source;
  const auto taken = openInfo(info, source);
  if (!taken) return tl::unexpected(taken.error());
  auto fit = taken->noLooks == 0 ? std::make_shared<LookFit>(source) : nullptr;
  if (auto done = context.streamer->reload(assetOf(pack.id), source); !done) return problem(done.error());
  takeFile(source);
  abandon(**entry);
  (*entry)->fitLooks = taken->noLooks == 0;
  // Without a thread the old looks stay: the reload is under way.
  quietly([&] {
    if (fit != nullptr) context.fitter.add(fit);
    (*entry)->fit = std::move(fit);
  });
  return {};
}

void close(BillowContext& context, BillowPack pack) {
  const auto found = context.packs.find(pack.id);
  if (found == context.packs.end()) return;
  abandon(found->second);
  context.packs.erase(found);
  std::erase_if(context.instances, [&](const auto& entry) { return entry.second.pack == pack.id; });
  context.streamer->close(assetOf(pack.id));
}

}  // namespace

void takeIn(BillowContext& context, std::uint32_t id) {
  const auto found = context.packs.find(id);
  if (found == context.packs.end()) return;
  OpenedPack& pack = found->second;
  const format::Pack* now = context.streamer->pack(assetOf(id));
  if (now == nullptr) return;
  if (now != pack.facted) takeFacts(*now, pack);
  if (pack.awaitsLooks && pack.fit->looks() != nullptr) {
    setLooks(*pack.fit->looks(), pack);
    pack.fit.reset();
    pack.awaitsLooks = false;
  }
  if (!pack.ready) becomeReady(context, id, pack);
}

void takeIn(BillowContext& context) {
  for (const auto& [id, pack] : context.packs) takeIn(context, id);
}

Outcome<const format::Pack*> packOf(const BillowContext& context, BillowPack pack) {
  const auto found = context.packs.find(pack.id);
  if (found == context.packs.end()) return badArgument("there is no pack " + std::to_string(pack.id));
  if (found->second.ready) return found->second.facted;
  if (context.streamer->state(assetOf(pack.id)) == runtime::Streamer::AssetState::failed) {
    return tl::unexpected(Problem{.result = BILLOW_ERROR_PACK, .message = "the pack could not be opened"});
  }
  return notReady("the pack still opens");
}

Outcome<const VolumeFacts*> volumeOf(const BillowContext& context, BillowPack pack, std::uint32_t volume) {
  if (const auto open = packOf(context, pack); !open) return tl::unexpected(open.error());
  const std::vector<VolumeFacts>& volumes = context.packs.at(pack.id).volumes;
  if (volume >= volumes.size()) {
    return badArgument("the pack has no volume " + std::to_string(volume) + "; it has " +
                       std::to_string(volumes.size()));
  }
  return &volumes[volume];
}

}  // namespace billow::c_api

extern "C" {

using namespace billow;         // NOLINT(google-build-using-namespace)
using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowOpen(BillowContext* context, const BillowOpenInfo* info, BillowPack* pack, BillowError* error) {
  return answering(error, [&] { return open(*context, info, pack, false); });
}

BillowResult billowOpenLater(BillowContext* context, const BillowOpenInfo* info, BillowPack* pack, BillowError* error) {
  return answering(error, [&] { return open(*context, info, pack, true); });
}

BillowPackState billowPackState(BillowContext* context, BillowPack pack) {
  const auto found = context->packs.find(pack.id);
  if (found == context->packs.end()) return BILLOW_PACK_UNKNOWN;
  quietly([&] { takeIn(*context, pack.id); });
  if (found->second.ready) return BILLOW_PACK_READY;
  const bool failed = context->streamer->state(assetOf(pack.id)) == runtime::Streamer::AssetState::failed;
  return failed ? BILLOW_PACK_FAILED : BILLOW_PACK_OPENING;
}

BillowResult billowReload(BillowContext* context, BillowPack pack, const BillowOpenInfo* info, BillowError* error) {
  return answering(error, [&] { return reload(*context, pack, info); });
}

void billowClose(BillowContext* context, BillowPack pack) {
  quietly([&] { close(*context, pack); });
}

}  // extern "C"
