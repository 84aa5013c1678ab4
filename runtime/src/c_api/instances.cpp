#include <cmath>

#include "c_api/context.h"
#include "c_api/convert.h"

namespace billow::c_api {
namespace {

// Of a context that may be const.
template <class Context>
auto known(Context& context, BillowInstance instance) -> Outcome<decltype(&context.instances.begin()->second)> {
  const auto found = context.instances.find(instance.id);
  if (found == context.instances.end()) return badArgument("there is no instance " + std::to_string(instance.id));
  return &found->second;
}

const char* badNumber(const runtime::InstanceInfo& info) {
  if (!std::isfinite(info.time)) return "BillowInstanceInfo::time";
  if (!soundTransform(info.objectToWorld)) return "BillowInstanceInfo::objectToWorld";
  return std::isfinite(info.priority) && info.priority >= 0 ? nullptr : "BillowInstanceInfo::priority";
}

Outcome<std::optional<runtime::Look>> lookOrNone(const BillowLook* look) {
  if (look == nullptr) return std::optional<runtime::Look>();
  return lookOf(look).map([](const runtime::Look& value) { return std::optional(value); });
}

Outcome<PlacedInstance> placedOf(const BillowInstanceInfo* info) {
  const auto i = given(info);
  if (!i) return tl::unexpected(i.error());
  const auto playback = playbackOf(i->playback);
  if (!playback) return tl::unexpected(playback.error());
  const auto look = lookOrNone(i->look);
  if (!look) return tl::unexpected(look.error());
  PlacedInstance placed;
  placed.pack = i->pack.id;
  placed.volume = i->volume;
  placed.look = *look;
  placed.info = {.asset = {.value = i->pack.id},
                 .time = i->time,
                 .playback = *playback,
                 .objectToWorld = arrayOf(i->objectToWorld),
                 .priority = i->priority};
  if (const char* field = badNumber(placed.info)) return badArgument(std::string(field) + " is outside of its range");
  return placed;
}

Outcome<void> add(BillowContext& context, const BillowInstanceInfo* info, BillowInstance* into) {
  if (into == nullptr) return badArgument("instance is NULL");
  auto placed = placedOf(info);
  if (!placed) return tl::unexpected(placed.error());
  const auto pack = context.packs.find(placed->pack);
  if (pack == context.packs.end()) return badArgument("there is no pack " + std::to_string(placed->pack));
  if (pack->second.ready) {
    if (auto started = startInstance(context, *placed); !started) return started;
  }
  into->id = ++context.lastInstance;
  context.instances.emplace(into->id, std::move(*placed));
  return {};
}

// Changes what the host wants of an instance, and tells the streamer where it knows it already.
template <class Change, class Tell>
Outcome<void> change(BillowContext& context, BillowInstance instance, const Change& doIt, const Tell& tell) {
  const auto placed = known(context, instance);
  if (!placed) return tl::unexpected(placed.error());
  runtime::InstanceInfo info = (*placed)->info;
  doIt(info);
  if (const char* field = badNumber(info)) return badArgument(std::string(field) + " is outside of its range");
  (*placed)->info = info;
  if ((*placed)->stream.value != 0) tell(*context.streamer, (*placed)->stream, info);
  return {};
}

Outcome<void> setLook(BillowContext& context, BillowInstance instance, const BillowLook* look) {
  const auto placed = known(context, instance);
  if (!placed) return tl::unexpected(placed.error());
  const auto value = lookOrNone(look);
  if (!value) return tl::unexpected(value.error());
  (*placed)->look = *value;
  return {};
}

Outcome<void> stateOf(const BillowContext& context, BillowInstance instance, BillowInstanceState* into) {
  const auto placed = known(context, instance);
  if (!placed) return tl::unexpected(placed.error());
  BillowInstanceState state = BILLOW_INSTANCE_STATE_DEFAULT;
  if ((*placed)->stream.value != 0) {
    const runtime::Drawable drawable = context.streamer->drawable((*placed)->stream);
    state.drawable = drawable.count > 0 ? 1 : 0;
    state.held = drawable.held ? 1 : 0;
    state.coarse = drawable.coarse ? 1 : 0;
    state.time = drawable.time;
  }
  return answer(state, into);
}

}  // namespace

Outcome<void> startInstance(BillowContext& context, PlacedInstance& instance) {
  const auto volume = volumeOf(context, {instance.pack}, instance.volume);
  if (!volume) return tl::unexpected(volume.error());
  instance.info.volume = (*volume)->number;
  const auto added = context.streamer->addInstance(instance.info);
  if (!added) return problem(added.error());
  instance.stream = *added;
  return {};
}

}  // namespace billow::c_api

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)
using billow::runtime::InstanceId;
using billow::runtime::InstanceInfo;
using billow::runtime::Streamer;

BillowResult billowAddInstance(BillowContext* context, const BillowInstanceInfo* info, BillowInstance* instance,
                               BillowError* error) {
  return answering(error, [&] { return add(*context, info, instance); });
}

void billowRemoveInstance(BillowContext* context, BillowInstance instance) {
  quietly([&] {
    const auto found = context->instances.find(instance.id);
    if (found == context->instances.end()) return;
    if (found->second.stream.value != 0) context->streamer->removeInstance(found->second.stream);
    context->instances.erase(found);
  });
}

BillowResult billowSetPlayback(BillowContext* context, BillowInstance instance, const BillowPlayback* playback,
                               BillowError* error) {
  return answering(error, [&]() -> Outcome<void> {
    const auto value = given(playback).and_then([](const BillowPlayback& p) { return playbackOf(&p); });
    if (!value) return tl::unexpected(value.error());
    return change(
        *context, instance, [&](InstanceInfo& info) { info.playback = *value; },
        [](Streamer& s, InstanceId id, const InstanceInfo& info) { s.setPlayback(id, info.playback); });
  });
}

BillowResult billowSetTransform(BillowContext* context, BillowInstance instance, const double objectToWorld[12],
                                BillowError* error) {
  return answering(error, [&] {
    return change(
        *context, instance,
        [&](InstanceInfo& info) { std::copy(objectToWorld, objectToWorld + 12, info.objectToWorld.begin()); },
        [](Streamer& s, InstanceId id, const InstanceInfo& info) { s.setTransform(id, info.objectToWorld); });
  });
}

BillowResult billowSetPriority(BillowContext* context, BillowInstance instance, float priority, BillowError* error) {
  return answering(error, [&] {
    return change(
        *context, instance, [&](InstanceInfo& info) { info.priority = priority; },
        [](Streamer& s, InstanceId id, const InstanceInfo& info) { s.setPriority(id, info.priority); });
  });
}

BillowResult billowSeek(BillowContext* context, BillowInstance instance, double time, BillowError* error) {
  return answering(error, [&] {
    return change(
        *context, instance, [&](InstanceInfo& info) { info.time = time; },
        [](Streamer& s, InstanceId id, const InstanceInfo& info) { s.seek(id, info.time); });
  });
}

BillowResult billowSetLook(BillowContext* context, BillowInstance instance, const BillowLook* look,
                           BillowError* error) {
  return answering(error, [&] { return setLook(*context, instance, look); });
}

BillowResult billowInstanceState(const BillowContext* context, BillowInstance instance, BillowInstanceState* state,
                                 BillowError* error) {
  return answering(error, [&] { return stateOf(*context, instance, state); });
}

}  // extern "C"
