#include "viewer.h"

#include <fmt/format.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_vulkan.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include "command.h"
#include "orbit.h"
#include "painter.h"
#include "panels.h"
#include "screen.h"
#include "shots.h"
#include "window.h"

namespace billow::viewer {
namespace {

constexpr double kMostSeconds = 0.1;        // that pass between two pictures; a stall is no leap
constexpr double kIdleSeconds = 0.5;        // between looks at a window in which nothing happens
constexpr int kSettling = 3;                // pictures after an event until the panels have come to rest
constexpr double kTurn = std::numbers::pi;  // radians over the height of the picture
constexpr std::array kSpeeds = {-4.0, -2.0, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 2.0, 4.0};

// Dear ImGui and its hold on the window.
class Gui {
 public:
  explicit Gui(const Window& window) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui_ImplGlfw_InitForVulkan(window.get(), true);
  }
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;
  ~Gui() {
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
};

std::unique_ptr<headless::Headless> openDevice(const Window& window, std::optional<std::uint32_t> number) {
  headless::DeviceOptions options = window.deviceOptions();
  options.device = number;
  return valueOf(headless::Headless::create(options));
}

StreamBudgets budgetsOf(const ViewOptions& options) {
  return {.gpu = options.frameBudget.value_or(options.gpuBudget / 2), .cpu = options.cpuBudget};
}

class Viewer {
 public:
  Viewer(const ViewOptions& options, std::unique_ptr<Document> document)
      : options_(options),
        window_(document->name() + " - billow", options.width, options.height),
        gui_(window_),
        panels_(window_.scale()),
        gpu_(openDevice(window_, options.device)),
        screen_(gpu_->device(), window_.makeSurface(gpu_->host().instance)),
        canvas_(gpu_->device()),
        painter_(*gpu_, options.gpuBudget, budgetsOf(options)),
        shots_(options.screenshots) {
    take(std::move(document));
  }

  void run() {
    while (!window_.closing()) {
      window_.poll(idle() ? kIdleSeconds : 0);
      const VkExtent2D pixels = window_.pixels();
      if (pixels.width == 0 || pixels.height == 0) {
        window_.poll(kIdleSeconds);
        continue;
      }
      const Input input = window_.takeInput();
      if (input.any) settling_ = kSettling;
      settling_ = std::max(settling_ - 1, 0);
      const double now = glfwGetTime(), passed = now - last_;
      last_ = now;
      picture(pixels, input, passed);
    }
  }

 private:
  bool idle() const {
    const bool waiting = painter_.player() != nullptr && painter_.player()->waiting();
    return settling_ == 0 && !redraw_ && !shots_.asked() && !waiting && document_->timeline->velocity() == 0;
  }

  void take(std::unique_ptr<Document> document) {
    const auto done = painter_.show(*document);
    document_ = std::move(document);
    if (!done) panels_.complain(done.error().message);
    camera_.reset();
    redraw_ = true;
  }

  void open(const std::string& path, const std::optional<Choice>& choice) {
    auto document = Document::open(path, choice);
    if (!document) return panels_.complain(document.error().message);
    panels_.dismissErrors();
    take(std::move(*document));
  }

  // The first camera, as `billow render` has it for a picture of this shape.
  void resetCamera() {
    const runtime::View view = document_->describe(true).view;
    std::array<double, 3> target{};
    const command::CameraRequest& asked = document_->request.camera;
    const runtime::WorldBox& box = document_->stage().box;
    for (std::size_t i = 0; i < 3; ++i) {
      target[i] = asked.target ? (*asked.target)[i] : (box.min[i] + box.max[i]) / 2;
    }
    const char up = document_->request.up.value_or(document_->stage().up);
    camera_.emplace(view.eye, target, up, asked.fieldOfView);
    redraw_ = true;
  }

  void picture(VkExtent2D pixels, const Input& input, double passed) {
    ImGui_ImplVulkan_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    if (input.released) released_ = input.released;
    if (released_) {
      // While a slow picture was drawn the pointer has gone on: what it held was let go there.
      ImGui::GetIO().MousePos = {static_cast<float>((*released_)[0]), static_cast<float>((*released_)[1])};
    }
    ImGui::NewFrame();
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) released_.reset();
    if (!camera_) {
      place();
      resetCamera();
    }
    if (painter_.player() != nullptr && painter_.player()->takeRenewed()) renew();
    const std::uint32_t jumps = document_->timeline->jumps();
    take(input);
    // What stands may have waited for long; what plays makes no leap.
    const double seconds = document_->timeline->playing() ? std::clamp(passed, 0.0, kMostSeconds) : passed;
    document_->timeline->advance(seconds);
    unplayed_ += seconds;
    const Asked asked = panels_.draw(*document_, *camera_, report(passed));
    window_.setPicture(panels_.picture(), panels_.covered());
    window_.setTyping(panels_.typing());
    ImGui::Render();
    redraw_ |= asked.redraw || jumps != document_->timeline->jumps() || document_->timeline->velocity() != 0;
    obey(asked);
    if (camera_) paint(pixels);
  }

  // Where the picture lies, and its shape for the default camera.
  void place() {
    const Area& area = panels_.arrange();
    const double scale = double{window_.scale()};
    const auto edge = [&](float length) {
      return static_cast<std::uint32_t>(std::max(std::floor(double{length} * scale), 1.0));
    };
    document_->request.width = edge(area.width);
    document_->request.height = edge(area.height);
    place_ = {{static_cast<std::int32_t>(double{area.x} * scale), static_cast<std::int32_t>(double{area.y} * scale)},
              {document_->request.width, document_->request.height}};
  }

  Report report(double passed) const {
    Report report{.deviceName = gpu_->deviceName(),
                  .bytesInUse = painter_.bytesInUse(),
                  .budget = painter_.budget(),
                  .times = painter_.times(),
                  .pictureMilliseconds = idle() ? 0 : passed * 1000,
                  .voxelSize = painter_.voxelSize()};
    if (const Player* player = painter_.player()) {
      report.residency = player->residency();
      report.traffic = player->traffic();
      report.streaming = player->budgets();
    }
    return report;
  }

  void take(const Input& input) {
    const double height = std::max(double{panels_.picture().height}, 1.0);
    if (input.turnX != 0 || input.turnY != 0) {
      camera_->turn(-input.turnX / height * kTurn, input.turnY / height * kTurn);
    }
    if (input.panX != 0 || input.panY != 0) camera_->pan(input.panX / height, -input.panY / height);
    if (input.wheel != 0) camera_->zoom(input.wheel);
    redraw_ |= input.turnX != 0 || input.turnY != 0 || input.panX != 0 || input.panY != 0 || input.wheel != 0;
    for (const int key : input.keys) press(key);
    if (!input.dropped.empty()) open(input.dropped.back(), std::nullopt);
  }

  void press(int key) {
    Timeline& timeline = *document_->timeline;
    switch (key) {
      case GLFW_KEY_SPACE:
        return timeline.playing() ? timeline.pause() : timeline.play();
      case GLFW_KEY_LEFT:
        return timeline.step(-1);
      case GLFW_KEY_RIGHT:
        return timeline.step(1);
      case GLFW_KEY_PAGE_UP:
      case GLFW_KEY_PAGE_DOWN:
        return changeSpeed(key == GLFW_KEY_PAGE_UP);
      case GLFW_KEY_F:
        return obey({.frameAll = true});
      case GLFW_KEY_HOME:
        return obey({.resetCamera = true});
      case GLFW_KEY_TAB:
        panels_.toggle();
        redraw_ = true;
        return;
      case GLFW_KEY_F1:
        return panels_.toggleHelp();
      case GLFW_KEY_F12:
        return obey({.screenshot = true});
      default:
        return;
    }
  }

  void changeSpeed(bool faster) {
    Timeline& timeline = *document_->timeline;
    const double speed = timeline.speed();
    const auto next = faster ? std::upper_bound(kSpeeds.begin(), kSpeeds.end(), speed)
                             : std::lower_bound(kSpeeds.begin(), kSpeeds.end(), speed);
    if (faster && next != kSpeeds.end()) timeline.setSpeed(*next);
    if (!faster && next != kSpeeds.begin()) timeline.setSpeed(*(next - 1));
  }

  void obey(const Asked& asked) {
    if (asked.choice) return open(document_->path(), asked.choice);
    if (asked.regrid) regrid(*asked.regrid);
    if (asked.streaming && painter_.player() != nullptr) {
      painter_.player()->setBudgets({.gpu = *asked.streaming, .cpu = options_.cpuBudget});
    }
    if (asked.remakeSpace) remakeSpace();
    if (asked.frameAll) {
      camera_->frame(document_->stage().box, double{1} * document_->request.width / document_->request.height);
    }
    if (asked.resetCamera) resetCamera();
    if (asked.screenshot) shots_.ask(glfwGetTime());
    redraw_ |= asked.remakeSpace || asked.frameAll || asked.screenshot;
  }

  void remakeSpace() {
    if (const auto done = painter_.remakeSpace(*document_); !done) panels_.complain(done.error().message);
    redraw_ = true;
  }

  // Looks, extent and time line of the document, after its grids or its packs have become others.
  void renew() {
    if (const auto done = document_->renew(); !done) panels_.complain(done.error().message);
    remakeSpace();
  }

  void regrid(std::size_t volume) {
    renew();
    if (painter_.player() != nullptr) painter_.player()->regrid(volume);
  }

  // Goes on to the moment of the time line, with what has arrived.
  void stream() {
    painter_.update(std::exchange(unplayed_, 0), {.view = camera_->view(), .pixelsHigh = canvas_.size().height});
    Player* player = painter_.player();
    if (player == nullptr) return;
    redraw_ |= player->changed();
    while (const auto error = player->takeError()) panels_.complain(*error);
  }

  runtime::DrawInfo describe(bool opaque) const {
    runtime::DrawInfo draw = document_->describe(opaque);
    draw.view = camera_->view();
    return draw;
  }

  void paint(VkExtent2D pixels) {
    place();
    const auto texels = [&](std::uint32_t edge) {
      return std::max(static_cast<std::uint32_t>(std::lround(static_cast<float>(edge) * panels_.resolution())), 1u);
    };
    const VkExtent2D size{texels(place_.extent.width), texels(place_.extent.height)};
    if (size.width != canvas_.size().width || size.height != canvas_.size().height) {
      canvas_.resize(size);
      painted_ = false;
      redraw_ = true;
    }
    const VkCommandBuffer commands = screen_.begin(pixels);
    if (commands == VK_NULL_HANDLE) return;
    painter_.readTimes(screen_.slot());
    std::string& title = titles_[screen_.slot()];
    if (!title.empty()) window_.setTitle(title);
    stream();
    if (shots_.due(painter_.player(), glfwGetTime())) shoot();
    if (redraw_) {
      const auto done = painter_.paint(commands, canvas_, describe(true), screen_.slot());
      if (done) {
        painted_ = true;
      } else {
        panels_.complain(done.error().message);
      }
      if (const std::string lacking = painter_.lacking(); !lacking.empty()) panels_.complain(lacking);
    }
    redraw_ = false;
    const PictureSource source{painted_ ? canvas_.shown() : VK_NULL_HANDLE, canvas_.size(), place_};
    screen_.end(source, ImGui::GetDrawData(), painter_.wait());
    const Timeline& timeline = *document_->timeline;
    title = fmt::format("{} - frame {} - {} - billow", document_->name(), timeline.ticks()[timeline.tick()].number,
                        timeline.playing() ? "playing" : "paused");
  }

  // The picture without panels.
  void shoot() {
    const auto picture = painter_.picture(describe(!panels_.exr()));
    if (!picture) return panels_.complain(picture.error().message);
    const Timeline& timeline = *document_->timeline;
    const std::string stem = fmt::format("{}_{:04}", std::filesystem::path(document_->path()).stem().string(),
                                         timeline.ticks()[timeline.tick()].number);
    const auto path = shots_.write(*picture, stem, panels_.exr(), document_->request.exposure);
    if (!path) return panels_.complain(path.error().message);
    panels_.tell("Picture in " + *path, ImGui::GetTime());
  }

  const ViewOptions& options_;
  Window window_;
  Gui gui_;
  Panels panels_;
  std::unique_ptr<headless::Headless> gpu_;
  Screen screen_;
  Canvas canvas_;
  std::unique_ptr<Document> document_;
  Painter painter_;
  Shots shots_;
  std::optional<OrbitCamera> camera_;
  VkRect2D place_{};
  std::array<std::string, kFramesInFlight> titles_;  // of the pictures in flight: the window's tells what it shows
  std::optional<std::array<double, 2>> released_;
  double last_ = 0;
  double unplayed_ = 0;  // seconds that the time line has advanced since the last update of the frames
  int settling_ = kSettling;
  bool redraw_ = true;    // the picture does not show what it should
  bool painted_ = false;  // the canvas has one
};

}  // namespace

Checked<void> view(const ViewOptions& options) {
  auto document = Document::open(options.path, options.choice);
  if (!document) return tl::unexpected(document.error());
  try {
    Viewer(options, std::move(*document)).run();
  } catch (const GpuFailure& failure) {
    return tl::unexpected(command::Refusal{command::kGpu, failure.what()});
  }
  return {};
}

}  // namespace billow::viewer
