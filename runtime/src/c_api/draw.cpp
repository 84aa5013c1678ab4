#include <algorithm>
#include <cmath>

#include "c_api/context.h"
#include "c_api/convert.h"
#include "c_api/shown.h"
#include "c_api/space_draw.h"

namespace billow::c_api {
namespace {

constexpr double kRigid = 1e-4;

// What turns the scene so that the instance's own world is upright: its transform turned round, if it only turns and
// moves.
class Upright {
 public:
  static Outcome<Upright> of(const std::array<double, 12>& m) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j) {
        double dot = 0;
        for (std::size_t k = 0; k < 3; ++k) dot += m[k * 4 + i] * m[k * 4 + j];
        if (std::abs(dot - (i == j ? 1 : 0)) <= kRigid) continue;
        return badArgument("a draw without a space takes an instance that is turned and moved, but not scaled");
      }
    }
    return Upright(m);
  }

  template <class Number>
  std::array<Number, 3> way(const std::array<Number, 3>& world) const {
    std::array<Number, 3> own{};
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += m_[k * 4 + i] * double{world[k]};
      own[i] = static_cast<Number>(sum);
    }
    return own;
  }

  std::array<double, 3> point(const std::array<double, 3>& world) const {
    return way<double>({world[0] - m_[3], world[1] - m_[7], world[2] - m_[11]});
  }

 private:
  explicit Upright(const std::array<double, 12>& m) : m_(m) {}
  std::array<double, 12> m_;
};

Outcome<runtime::DrawInfo> directDraw(const BillowDrawInfo& draw, const Shown& shown) {
  const auto upright = Upright::of(shown.instance->info.objectToWorld);
  if (!upright) return tl::unexpected(upright.error());
  const auto seen = seenOf(draw);
  if (!seen) return tl::unexpected(seen.error());
  runtime::DrawInfo info{.layers = std::span(shown.drawable.layers).first(shown.drawable.count),
                         .view = seen->view,
                         .sun = seen->sun,
                         .look = shown.look,
                         .quality = seen->quality,
                         .background = seen->background,
                         .width = draw.width,
                         .height = draw.height,
                         .colorFormat = seen->colorFormat,
                         .color = draw.color,
                         .depth = draw.depth};
  info.view.eye = upright->point(info.view.eye);
  info.view.right = upright->way(info.view.right);
  info.view.up = upright->way(info.view.up);
  info.view.forward = upright->way(info.view.forward);
  info.sun.direction = upright->way(info.sun.direction);
  return info;
}

Outcome<void> drawDirect(BillowContext& context, VkCommandBuffer commands, const BillowDrawInfo& draw) {
  if (draw.effectCount > 0) return badArgument("BillowDrawInfo: effects are drawn in a space alone");
  if (draw.instances != nullptr ? draw.instanceCount != 1 : context.instances.size() != 1) {
    return badArgument("BillowDrawInfo: a draw without a space is of one instance");
  }
  const auto shown = shownBy(context, draw);
  if (!shown) return tl::unexpected(shown.error());
  if (shown->empty()) return notReady("nothing of the instance is resident yet");
  const auto info = directDraw(draw, shown->front());
  if (!info) return tl::unexpected(info.error());
  const auto recorded = context.renderer->record(commands, *info);
  if (!recorded) return problem(recorded.error());
  return {};
}

Outcome<void> draw(BillowContext& context, VkCommandBuffer commands, const BillowDrawInfo* info) {
  const auto draw = given(info);
  if (!draw) return tl::unexpected(draw.error());
  if (commands == VK_NULL_HANDLE) return badArgument("commands is NULL");
  if (context.renderer == nullptr) return notReady("the context is detached");
  if (draw->space == nullptr) return drawDirect(context, commands, *draw);
  if (draw->space->context != &context) return badArgument("BillowDrawInfo::space is another context's");
  return drawInSpace(*draw->space, commands, *draw);
}

Outcome<void> prepare(BillowContext& context, BillowPack pack, std::uint32_t volume, const BillowQuality* quality,
                      BillowColorFormat colorFormat) {
  if (context.renderer == nullptr) return notReady("the context is detached");
  const auto facts = volumeOf(context, pack, volume);
  if (!facts) return tl::unexpected(facts.error());
  const auto q = qualityOf(quality);
  if (!q) return tl::unexpected(q.error());
  const auto format = colorFormatOf(colorFormat, "colorFormat");
  if (!format) return tl::unexpected(format.error());
  const auto made = context.renderer->prepare(*context.packs.at(pack.id).facted, (*facts)->number,
                                              {.grids = (*facts)->grids}, *q, *format);
  if (!made) return problem(made.error());
  return {};
}

}  // namespace
}  // namespace billow::c_api

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowDraw(BillowContext* context, VkCommandBuffer commands, const BillowDrawInfo* info,
                        BillowError* error) {
  return answering(error, [&] { return draw(*context, commands, info); });
}

BillowResult billowPrepare(BillowContext* context, BillowPack pack, uint32_t volume, const BillowQuality* quality,
                           BillowColorFormat colorFormat, BillowError* error) {
  return answering(error, [&] { return prepare(*context, pack, volume, quality, colorFormat); });
}

}  // extern "C"
