// billow.h for C++20: handles that clean up after themselves, values that begin with their defaults, results that carry
// their error. Header only; billow.h is the manual, and all that it says of a function holds for the one here.
//
//   auto context = billow::Context::create(device, config);
//   if (!context) return fail(context.error().message);
//   auto pack = context->open("fire.blw");
//   if (!pack) return fail(pack.error().message);
//   auto fire = context->addInstance(pack->id());
//   if (!fire) return fail(fire.error().message);
//   auto space = context->createSpace({});
//   if (!space) return fail(space.error().message);
//   ...
//   if (auto done = context->update(moment); !done) warn(done.error().message);
//   while (auto error = context->takeError()) warn(error->message);
//   if (auto done = context->draw(commands, draw); !done) warn(done.error().message);
//   // `commands` are submitted with a wait for context->wait()
//
// Handles are moved, not copied. What a Context made must be gone before it. Nothing here throws.
#ifndef BILLOW_BILLOW_HPP
#define BILLOW_BILLOW_HPP

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "billow/billow.h"

namespace billow {

// Structs of billow.h, with their defaults: billow::Config is a BillowConfig.
#define BILLOW_DEFAULTED(Name, WORDS)                                                          \
  struct Name : Billow##Name {                                                                 \
    Name() : Billow##Name(BILLOW_##WORDS##_DEFAULT) {}                                         \
    Name(const Billow##Name& c) : Billow##Name(c) {} /* NOLINT(google-explicit-constructor) */ \
  }
BILLOW_DEFAULTED(Allocator, ALLOCATOR);
BILLOW_DEFAULTED(Background, BACKGROUND);
BILLOW_DEFAULTED(CompositeInfo, COMPOSITE_INFO);
BILLOW_DEFAULTED(Config, CONFIG);
BILLOW_DEFAULTED(Device, DEVICE);
BILLOW_DEFAULTED(DrawInfo, DRAW_INFO);
BILLOW_DEFAULTED(Effect, EFFECT);
BILLOW_DEFAULTED(EffectInfo, EFFECT_INFO);
BILLOW_DEFAULTED(Error, ERROR);
BILLOW_DEFAULTED(File, FILE);
BILLOW_DEFAULTED(InstanceInfo, INSTANCE_INFO);
BILLOW_DEFAULTED(InstanceState, INSTANCE_STATE);
BILLOW_DEFAULTED(Jobs, JOBS);
BILLOW_DEFAULTED(Log, LOG);
BILLOW_DEFAULTED(Look, LOOK);
BILLOW_DEFAULTED(OpenInfo, OPEN_INFO);
BILLOW_DEFAULTED(PackInfo, PACK_INFO);
BILLOW_DEFAULTED(Playback, PLAYBACK);
BILLOW_DEFAULTED(Quality, QUALITY);
BILLOW_DEFAULTED(Scattering, SCATTERING);
BILLOW_DEFAULTED(ShadowMap, SHADOW_MAP);
BILLOW_DEFAULTED(SpaceInfo, SPACE_INFO);
BILLOW_DEFAULTED(SpaceShadow, SPACE_SHADOW);
BILLOW_DEFAULTED(SpaceStats, SPACE_STATS);
BILLOW_DEFAULTED(Stats, STATS);
BILLOW_DEFAULTED(Sun, SUN);
BILLOW_DEFAULTED(UpdateInfo, UPDATE_INFO);
BILLOW_DEFAULTED(View, VIEW);
BILLOW_DEFAULTED(VolumeInfo, VOLUME_INFO);
BILLOW_DEFAULTED(Wait, WAIT);
#undef BILLOW_DEFAULTED

// A value, or the error in its place (also BILLOW_NOT_READY, which is none).
template <class T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) : value_(std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Expected(const Error& error) : error_(error) {}  // NOLINT(google-explicit-constructor)
  explicit operator bool() const { return value_.has_value(); }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }
  const Error& error() const { return error_; }

 private:
  std::optional<T> value_;
  Error error_;
};

// Done, or the error.
template <>
class [[nodiscard]] Expected<void> {
 public:
  Expected() = default;
  Expected(const Error& error) : error_(error) {}  // NOLINT(google-explicit-constructor)
  explicit operator bool() const { return error_.code == BILLOW_OK; }
  const Error& error() const { return error_; }

 private:
  Error error_;
};

using Transform = std::array<double, 12>;  // row-major 3x4

// What fill(&value, &error) fills.
template <class T, class Fill>
Expected<T> filled(const Fill& fill) {
  T value{};
  Error error;
  if (fill(&value, &error) == BILLOW_OK) return value;
  return error;
}

template <class Call>
Expected<void> done(const Call& call) {
  Error error;
  if (call(&error) == BILLOW_OK) return {};
  return error;
}

inline View lookAt(const std::array<double, 3>& eye, const std::array<double, 3>& target,
                   const std::array<double, 3>& up, float fieldOfView) {
  View view;
  billowLookAt(eye.data(), target.data(), up.data(), fieldOfView, &view);
  return view;
}

// A handle that release() gives back.
template <class Handle, class Owner, void (*release)(Owner, Handle)>
class Owned {
 public:
  Owned(Owner owner, Handle handle) : owner_(owner), handle_(handle) {}
  Owned(Owned&& other) noexcept : owner_(std::exchange(other.owner_, Owner{})), handle_(other.handle_) {}
  Owned& operator=(Owned&& other) noexcept {
    if (this == &other) return *this;
    reset();
    owner_ = std::exchange(other.owner_, Owner{});
    handle_ = other.handle_;
    return *this;
  }
  ~Owned() { reset(); }

  void reset() {
    if (owner_ != Owner{}) release(owner_, handle_);
    owner_ = {};
  }

 protected:
  Owner owner() const { return owner_; }
  Handle handle() const { return handle_; }

 private:
  Owner owner_{};
  Handle handle_{};
};

class Pack : public Owned<BillowPack, BillowContext*, billowClose> {
 public:
  using Owned::Owned;
  BillowPack id() const { return handle(); }
  BillowPackState state() const { return billowPackState(owner(), id()); }
  Expected<void> reload(const char* path) {
    OpenInfo info;
    info.path = path;
    return reload(info);
  }
  Expected<void> reload(const OpenInfo& info) {
    return done([&](BillowError* e) { return billowReload(owner(), id(), &info, e); });
  }
  Expected<PackInfo> info() const {
    return filled<PackInfo>([&](PackInfo* i, BillowError* e) { return billowPackInfo(owner(), id(), i, e); });
  }
  Expected<VolumeInfo> volume(std::uint32_t volume) const {
    return filled<VolumeInfo>(
        [&](VolumeInfo* i, BillowError* e) { return billowVolumeInfo(owner(), id(), volume, i, e); });
  }
  Expected<EffectInfo> effect(std::uint32_t effect) const {
    return filled<EffectInfo>(
        [&](EffectInfo* i, BillowError* e) { return billowEffectInfo(owner(), id(), effect, i, e); });
  }
  Expected<Look> suggestLook(std::uint32_t volume) const {
    return filled<Look>([&](Look* l, BillowError* e) { return billowSuggestLook(owner(), id(), volume, l, e); });
  }
  Expected<void> prepare(std::uint32_t volume, const BillowQuality* quality, BillowColorFormat format) {
    return done([&](BillowError* e) { return billowPrepare(owner(), id(), volume, quality, format, e); });
  }
};

class Instance : public Owned<BillowInstance, BillowContext*, billowRemoveInstance> {
 public:
  using Owned::Owned;
  BillowInstance id() const { return handle(); }
  Expected<void> setPlayback(const Playback& playback) {
    return done([&](BillowError* e) { return billowSetPlayback(owner(), id(), &playback, e); });
  }
  Expected<void> setTransform(const Transform& objectToWorld) {
    return done([&](BillowError* e) { return billowSetTransform(owner(), id(), objectToWorld.data(), e); });
  }
  Expected<void> setPriority(float priority) {
    return done([&](BillowError* e) { return billowSetPriority(owner(), id(), priority, e); });
  }
  Expected<void> seek(double time) {
    return done([&](BillowError* e) { return billowSeek(owner(), id(), time, e); });
  }
  Expected<void> setLook(const BillowLook* look) {
    return done([&](BillowError* e) { return billowSetLook(owner(), id(), look, e); });
  }
  Expected<InstanceState> state() const {
    return filled<InstanceState>(
        [&](InstanceState* s, BillowError* e) { return billowInstanceState(owner(), id(), s, e); });
  }
};

// The context is part of the handle.
namespace detail {
inline void destroyContext(BillowContext* context, BillowContext*) {
  billowDestroy(context);
}
inline void destroySpace(BillowSpace* space, BillowSpace*) {
  billowDestroySpace(space);
}
inline void destroyCompositor(BillowCompositor* compositor, BillowCompositor*) {
  billowDestroyCompositor(compositor);
}
}  // namespace detail

class Space : public Owned<BillowSpace*, BillowSpace*, detail::destroySpace> {
 public:
  explicit Space(BillowSpace* space) : Owned(space, space) {}
  BillowSpace* get() const { return owner(); }
  SpaceStats stats() const {
    SpaceStats stats;
    billowSpaceStats(get(), &stats);
    return stats;
  }
  SpaceShadow shadow() const {
    SpaceShadow shadow;
    billowSpaceShadow(get(), &shadow);
    return shadow;
  }
};

class Compositor : public Owned<BillowCompositor*, BillowCompositor*, detail::destroyCompositor> {
 public:
  explicit Compositor(BillowCompositor* compositor) : Owned(compositor, compositor) {}
  BillowCompositor* get() const { return owner(); }
  Expected<void> record(VkCommandBuffer commands, const CompositeInfo& info) {
    return done([&](BillowError* e) { return billowComposite(get(), commands, &info, e); });
  }
};

class Context : public Owned<BillowContext*, BillowContext*, detail::destroyContext> {
 public:
  explicit Context(BillowContext* context) : Owned(context, context) {}
  BillowContext* get() const { return owner(); }

  static Expected<Context> create(const Device& device, const Config& config) {
    BillowContext* context = nullptr;
    Error error;
    if (billowCreate(&device, &config, &context, &error) == BILLOW_OK) return Context(context);
    return error;
  }
  Expected<void> setBudget(std::uint64_t gpuBytes, std::uint64_t cpuBytes) {
    return done([&](BillowError* e) { return billowSetBudget(get(), gpuBytes, cpuBytes, e); });
  }
  void detach() { billowDetach(get()); }
  Expected<void> attach(const Device& device) {
    return done([&](BillowError* e) { return billowAttach(get(), &device, e); });
  }

  Expected<Pack> open(const char* path) {
    OpenInfo info;
    info.path = path;
    return open(info);
  }
  Expected<Pack> open(const OpenInfo& info) { return openBy(billowOpen, info); }
  Expected<Pack> openLater(const OpenInfo& info) { return openBy(billowOpenLater, info); }

  Expected<Instance> addInstance(BillowPack pack) {
    InstanceInfo info;
    info.pack = pack;
    return addInstance(info);
  }
  Expected<Instance> addInstance(const InstanceInfo& info) {
    const auto instance = filled<BillowInstance>(
        [&](BillowInstance* i, BillowError* e) { return billowAddInstance(get(), &info, i, e); });
    if (instance) return Instance(get(), *instance);
    return instance.error();
  }
  Expected<Space> createSpace(const SpaceInfo& info, std::span<const BillowPack> packs = {}) {
    SpaceInfo with = info;
    if (!packs.empty()) {
      with.packs = packs.data();
      with.packCount = static_cast<std::uint32_t>(packs.size());
    }
    const auto space =
        filled<BillowSpace*>([&](BillowSpace** s, BillowError* e) { return billowCreateSpace(get(), &with, s, e); });
    if (space) return Space(*space);
    return space.error();
  }
  Expected<Compositor> createCompositor(std::uint32_t drawsInFlight) {
    const auto compositor = filled<BillowCompositor*>(
        [&](BillowCompositor** c, BillowError* e) { return billowCreateCompositor(get(), drawsInFlight, c, e); });
    if (compositor) return Compositor(*compositor);
    return compositor.error();
  }

  Expected<void> update(const UpdateInfo& info) {
    return done([&](BillowError* e) { return billowUpdate(get(), &info, e); });
  }
  Wait wait() const {
    Wait wait;
    billowUpdateWait(get(), &wait);
    return wait;
  }
  Stats stats() const {
    Stats stats;
    billowStats(get(), &stats);
    return stats;
  }
  // The oldest error of billow's threads, each once.
  std::optional<Error> takeError() {
    Error error;
    if (billowTakeError(get(), &error) != BILLOW_OK) return std::nullopt;
    return error;
  }
  // The given instances and effects in place of those of `info`, where there are some.
  Expected<void> draw(VkCommandBuffer commands, const DrawInfo& info, std::span<const BillowInstance> instances = {},
                      std::span<const Effect> effects = {}) {
    DrawInfo with = info;
    if (!instances.empty()) {
      with.instances = instances.data();
      with.instanceCount = static_cast<std::uint32_t>(instances.size());
    }
    if (!effects.empty()) {
      with.effects = effects.data();
      with.effectCount = static_cast<std::uint32_t>(effects.size());
    }
    return done([&](BillowError* e) { return billowDraw(get(), commands, &with, e); });
  }

 private:
  using Open = BillowResult (*)(BillowContext*, const BillowOpenInfo*, BillowPack*, BillowError*);
  Expected<Pack> openBy(Open how, const OpenInfo& info) {
    const auto pack = filled<BillowPack>([&](BillowPack* p, BillowError* e) { return how(get(), &info, p, e); });
    if (pack) return Pack(get(), *pack);
    return pack.error();
  }
};

}  // namespace billow

#endif  // BILLOW_BILLOW_HPP
