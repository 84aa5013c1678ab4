#include "c_api/shown.h"

namespace billow::c_api {
namespace {

void addShown(const BillowContext& context, const PlacedInstance& instance, std::vector<Shown>& all) {
  if (instance.stream.value == 0) return;
  Shown shown;
  shown.drawable = context.streamer->drawable(instance.stream);
  const auto facts = volumeOf(context, {instance.pack}, instance.volume);
  if (shown.drawable.count == 0 || !facts) return;
  shown.instance = &instance;
  shown.facts = *facts;
  shown.look = instance.look ? *instance.look : (*facts)->look;
  all.push_back(shown);
}

}  // namespace

Outcome<std::vector<Shown>> shownBy(const BillowContext& context, const BillowDrawInfo& draw) {
  std::vector<Shown> all;
  if (draw.instances == nullptr) {
    for (const auto& [id, instance] : context.instances) addShown(context, instance, all);
    return all;
  }
  for (std::uint32_t i = 0; i < draw.instanceCount; ++i) {
    const auto found = context.instances.find(draw.instances[i].id);
    if (found == context.instances.end()) {
      return badArgument("BillowDrawInfo: there is no instance " + std::to_string(draw.instances[i].id));
    }
    addShown(context, found->second, all);
  }
  return all;
}

Outcome<Seen> seenOf(const BillowDrawInfo& draw) {
  const auto view = viewOf(draw.view);
  if (!view) return tl::unexpected(view.error());
  const auto sun = sunOf(draw.sun);
  if (!sun) return tl::unexpected(sun.error());
  const auto quality = qualityOf(draw.quality);
  if (!quality) return tl::unexpected(quality.error());
  const auto background = backgroundOf(draw.background);
  if (!background) return tl::unexpected(background.error());
  const auto format = colorFormatOf(draw.colorFormat, "BillowDrawInfo::colorFormat");
  if (!format) return tl::unexpected(format.error());
  return Seen{*view, *sun, *quality, *background, *format};
}

}  // namespace billow::c_api
