// What the handles of billow.h stand for.
#ifndef BILLOW_RUNTIME_C_API_CONTEXT_H
#define BILLOW_RUNTIME_C_API_CONTEXT_H

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "billow/format/gather_effects.h"
#include "billow/runtime/composite.h"
#include "billow/runtime/metavoxel.h"
#include "billow/runtime/stream.h"
#include "c_api/look_fit.h"
#include "c_api/problem.h"
#include "c_api/volume_facts.h"

namespace billow::c_api {

struct OpenedPack {
  bool fitLooks = true;
  const format::Pack* facted = nullptr;  // of which `volumes` tells; null before
  std::vector<VolumeFacts> volumes;      // those that can be played
  std::shared_ptr<LookFit> fit;          // of the pack as it is, or will be after a reload; null: there is none
  bool awaitsLooks = false;              // `fit` is of the pack as it is
  bool ready = false;                    // has been ready to be drawn
};

struct PlacedInstance {
  std::uint32_t pack = 0;
  std::uint32_t volume = 0;           // among those that can be played
  std::optional<runtime::Look> look;  // none: the suggested one
  runtime::InstanceId stream;         // none while the pack opens
  runtime::InstanceInfo info;         // as the host wants it; with it the streamer is asked then
};

}  // namespace billow::c_api

struct BillowContext {
  billow::runtime::Config rendererConfig;
  std::uint64_t stagingBytes = 0;
  std::unique_ptr<billow::runtime::Renderer> renderer;  // null while detached
  std::unique_ptr<billow::runtime::Streamer> streamer;
  std::map<std::uint32_t, billow::c_api::OpenedPack> packs;          // by BillowPack::id, which is the AssetId
  std::map<std::uint32_t, billow::c_api::PlacedInstance> instances;  // by BillowInstance::id
  std::uint32_t lastInstance = 0;
  billow::c_api::LookFitter fitter;
  std::vector<billow::c_api::Problem> late;  // for billowTakeError(), the oldest first
  BillowLog log = BILLOW_LOG_DEFAULT;
  std::vector<BillowSpace*> spaces;
  std::vector<BillowCompositor*> compositors;

  ~BillowContext();
};

struct BillowSpace {
  BillowContext* context = nullptr;
  billow::runtime::MetavoxelConfig config;  // its tables are those of `effects`
  billow::format::GatheredEffects effects;
  std::map<std::uint32_t, std::vector<std::uint32_t>> effectNumbers;  // by pack: each one's number in the tables
  std::vector<billow::runtime::WorldBox> effectBoxes;                 // by number in the tables
  std::unique_ptr<billow::runtime::Metavoxels> metavoxels;            // null while detached

  billow::c_api::Outcome<void> make();
};

struct BillowCompositor {
  BillowContext* context = nullptr;
  std::uint32_t drawsInFlight = 1;
  std::unique_ptr<billow::runtime::Compositor> compositor;  // null while detached

  billow::c_api::Outcome<void> make();
};

namespace billow::c_api {

// The volume, or what hinders: no such pack or volume, or the pack still opens.
Outcome<const VolumeFacts*> volumeOf(const BillowContext& context, BillowPack pack, std::uint32_t volume);
// The open pack, likewise.
Outcome<const format::Pack*> packOf(const BillowContext& context, BillowPack pack);
// Takes note of what has become ready since: facts of volumes, looks, instances that waited. After open and update.
void takeIn(BillowContext& context);
void takeIn(BillowContext& context, std::uint32_t pack);
// Asks the streamer for an instance that waited for its pack.
Outcome<void> startInstance(BillowContext& context, PlacedInstance& instance);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_CONTEXT_H
