#include "painter.h"

#include <algorithm>

#include "command.h"

namespace billow::viewer {
namespace {

using command::Refusal;
using command::toRefusal;
using headless::begin;

constexpr std::uint32_t kBegin = runtime::kMetavoxelTimestamps, kEnd = kBegin + 1, kQueries = kEnd + 1;  // of a slot

}  // namespace

Painter::Painter(headless::Headless& gpu, std::uint64_t gpuBudget, const StreamBudgets& budgets)
    : gpu_(gpu), gpuBudget_(gpuBudget), budgets_(budgets) {
  // One more for pictures that go to a file.
  renderer_ =
      valueOf(runtime::Renderer::create(gpu.host(), {.gpuBudget = gpuBudget, .recordsInFlight = kFramesInFlight + 1}));
  auto info = begin<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  info.queryType = VK_QUERY_TYPE_TIMESTAMP;
  info.queryCount = kQueries * kFramesInFlight;
  queries_ = makeOwned<QueryPool>(device(), vkCreateQueryPool, "vkCreateQueryPool", info);
}

Painter::~Painter() {
  vkDeviceWaitIdle(device());
}

Checked<void> Painter::show(const Document& document) {
  check(vkDeviceWaitIdle(device()), "vkDeviceWaitIdle");
  metavoxels_.reset();
  if (player_) budgets_ = player_->budgets();
  player_.reset();
  document_ = &document;
  auto player = Player::make(*renderer_, document.contents(), document.request, budgets_, kFramesInFlight);
  if (player) player_ = std::move(*player);
  auto made = remakeSpace(document);
  if (!player) return tl::unexpected(player.error());
  return made;
}

Checked<void> Painter::remakeSpace(const Document& document) {
  check(vkDeviceWaitIdle(device()), "vkDeviceWaitIdle");
  metavoxels_.reset();
  timed_ = {};
  times_.reset();
  command::SpaceNeeds needs = document.needs();
  needs.recordsInFlight = kFramesInFlight + 1;
  const command::RenderRequest& request = document.request;
  if (request.voxelSize) needs.lattice.edge = *request.voxelSize;
  // The other half is for the frames.
  auto made = command::MetavoxelPainter::make(*renderer_, document.contents().tables(), needs, gpuBudget_ / 2,
                                              {request.surroundings, request.bounces});
  if (!made) return tl::unexpected(toRefusal(made.error(), ""));
  metavoxels_ = std::move(*made);
  return {};
}

void Painter::update(double seconds, const Seen& seen) {
  if (player_) player_->update(*document_->timeline, seconds, seen);
}

command::Shown Painter::shownIn(runtime::DrawInfo& draw) const {
  command::Shown shown;
  for (std::size_t i = 0; player_ && i < player_->drawables().size(); ++i) {
    const runtime::Drawable& drawable = player_->drawables()[i];
    if (drawable.count == 0) continue;
    const command::PlacedVolume& volume = document_->contents().volumes()[i];
    const std::span<const runtime::Layer> layers(drawable.layers.data(), drawable.count);
    shown.volumes.push_back(command::placed(document_->request, volume, layers, draw.look));
  }
  shown.effects = document_->contents().effectsAt(document_->timeline->time());
  if (direct(shown)) {
    const auto& layers = shown.volumes[0].layers;
    const auto most = std::max_element(layers.begin(), layers.end(),
                                       [](const auto& a, const auto& b) { return a.weight < b.weight; });
    draw.frame = most->frame;
    draw.look = shown.volumes[0].look;
  }
  return shown;
}

// Where no frame shows, the other method draws the background.
bool Painter::direct(const command::Shown& shown) const {
  return document_->request.method == command::Method::direct && !shown.volumes.empty();
}

runtime::Result<void> Painter::record(VkCommandBuffer commands, runtime::DrawInfo& draw, std::uint32_t slot) {
  const command::Shown shown = shownIn(draw);
  if (direct(shown)) return renderer_->record(commands, draw);
  runtime::MetavoxelDraw info = metavoxels_->describe(draw, shown);
  info.timestamps = queries_.get();
  info.firstTimestamp = slot * kQueries;
  auto done = metavoxels_->metavoxels().record(commands, info);
  passes_[slot] = done.has_value();
  return done;
}

Checked<void> Painter::paint(VkCommandBuffer commands, const Canvas& canvas, runtime::DrawInfo draw,
                             std::uint32_t slot) {
  draw.width = canvas.size().width;
  draw.height = canvas.size().height;
  draw.color = canvas.color();
  draw.depth = canvas.depth();
  draw.colorFormat = runtime::ColorFormat::single;
  if (!metavoxels_) return tl::unexpected(Refusal{command::kGpu, "nothing is drawn: there is no room for its voxels"});
  const std::uint32_t first = slot * kQueries;
  vkCmdResetQueryPool(commands, queries_.get(), first, kQueries);
  vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_.get(), first + kBegin);
  canvas.recordBegin(commands);
  passes_[slot] = false;
  if (auto done = record(commands, draw, slot); !done) return tl::unexpected(toRefusal(done.error(), ""));
  canvas.recordEnd(commands, document_->request.exposure);
  vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_.get(), first + kEnd);
  timed_[slot] = true;
  return {};
}

SemaphoreWait Painter::wait() const {
  if (!player_) return {};
  const runtime::UploadWait wait = player_->wait();
  return {wait.semaphore, wait.value};
}

void Painter::readTimes(std::uint32_t slot) {
  if (!timed_[slot]) return;
  timed_[slot] = false;
  std::array<std::uint64_t, kQueries> ticks{};
  const std::uint32_t first = passes_[slot] ? 0 : kBegin;
  const VkResult result = vkGetQueryPoolResults(device(), queries_.get(), slot * kQueries + first, kQueries - first,
                                                (kQueries - first) * sizeof(ticks[0]), &ticks[first], sizeof(ticks[0]),
                                                VK_QUERY_RESULT_64_BIT);
  if (result != VK_SUCCESS) return;
  const auto milliseconds = [&](std::uint32_t from, std::uint32_t to) {
    return static_cast<double>(ticks[to] - ticks[from]) * double{gpu_.device().timestampPeriod} * 1e-6;
  };
  PassTimes times;
  for (std::uint32_t i = 0; passes_[slot] && i < times.passes.size(); ++i) times.passes[i] = milliseconds(i, i + 1);
  times.total = milliseconds(kBegin, kEnd);
  times_ = times;
}

Checked<headless::Picture> Painter::picture(runtime::DrawInfo draw) {
  if (!metavoxels_) return tl::unexpected(Refusal{command::kGpu, "there is no room for the picture's voxels"});
  draw.colorFormat = runtime::ColorFormat::single;
  const command::Shown shown = shownIn(draw);
  check(vkDeviceWaitIdle(device()), "vkDeviceWaitIdle");
  auto picture = direct(shown) ? gpu_.render(*renderer_, draw) : metavoxels_->render(gpu_, *renderer_, draw, shown);
  gpu_.waitIdle();
  if (!picture) return tl::unexpected(toRefusal(picture.error(), ""));
  return std::move(*picture);
}

std::string Painter::lacking() const {
  if (!metavoxels_ || document_->request.method == command::Method::direct) return "";
  const auto room = metavoxels_->checkRoom();
  return room ? "" : room.error().message;
}

}  // namespace billow::viewer
