#include "c_api/context.h"
#include "c_api/convert.h"

namespace billow::c_api {
namespace {

Outcome<void> create(BillowContext& context, std::uint32_t drawsInFlight, BillowCompositor** into) {
  if (into == nullptr) return badArgument("compositor is NULL");
  auto compositor = std::make_unique<BillowCompositor>();
  compositor->context = &context;
  compositor->drawsInFlight = drawsInFlight;
  if (auto made = compositor->make(); !made) return made;
  context.compositors.push_back(compositor.get());
  *into = compositor.release();
  return {};
}

Outcome<void> composite(const BillowCompositor& compositor, VkCommandBuffer commands, const BillowCompositeInfo* info) {
  if (compositor.compositor == nullptr) return notReady("the context is detached");
  if (commands == VK_NULL_HANDLE) return badArgument("commands is NULL");
  const auto i = given(info);
  if (!i) return tl::unexpected(i.error());
  const auto format = colorFormatOf(i->colorFormat, "BillowCompositeInfo::colorFormat");
  if (!format) return tl::unexpected(format.error());
  const auto targetFormat = colorFormatOf(i->targetFormat, "BillowCompositeInfo::targetFormat");
  if (!targetFormat) return tl::unexpected(targetFormat.error());
  const auto recorded = compositor.compositor->record(commands, {.width = i->width,
                                                                 .height = i->height,
                                                                 .colorFormat = *format,
                                                                 .color = i->color,
                                                                 .depth = i->depth,
                                                                 .sceneDepth = i->sceneDepth,
                                                                 .targetWidth = i->targetWidth,
                                                                 .targetHeight = i->targetHeight,
                                                                 .targetFormat = *targetFormat,
                                                                 .target = i->target,
                                                                 .targetDepth = i->targetDepth});
  if (!recorded) return problem(recorded.error());
  return {};
}

}  // namespace
}  // namespace billow::c_api

billow::c_api::Outcome<void> BillowCompositor::make() {
  if (context->renderer == nullptr) return billow::c_api::notReady("the context is detached");
  auto made = billow::runtime::Compositor::create(*context->renderer, drawsInFlight);
  if (!made) return billow::c_api::problem(made.error());
  compositor = std::move(*made);
  return {};
}

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowCreateCompositor(BillowContext* context, uint32_t drawsInFlight, BillowCompositor** compositor,
                                    BillowError* error) {
  return answering(error, [&] { return create(*context, drawsInFlight, compositor); });
}

void billowDestroyCompositor(BillowCompositor* compositor) {
  if (compositor == nullptr) return;
  std::erase(compositor->context->compositors, compositor);
  delete compositor;
}

BillowResult billowComposite(BillowCompositor* compositor, VkCommandBuffer commands, const BillowCompositeInfo* info,
                             BillowError* error) {
  return answering(error, [&] { return composite(*compositor, commands, info); });
}

}  // extern "C"
