#include "panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

namespace billow::viewer {
namespace {

constexpr float kSide = 300, kBelow = 78;  // sizes of the panels
constexpr float kLabel = 92;               // that a slider's name takes
constexpr std::size_t kMostErrors = 5;
constexpr double kMessageSeconds = 4;
constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoBringToFrontOnFocus;
constexpr ImGuiWindowFlags kFloating = kFixed | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoNav;

struct Key {
  const char* keys;
  const char* meaning;
};
constexpr Key kKeys[] = {{"drag", "turn about the target"},
                         {"Shift or middle drag", "move the target"},
                         {"wheel", "nearer, further"},
                         {"F", "everything in view"},
                         {"Home", "the first camera again"},
                         {"Space", "play, pause"},
                         {"Left, Right", "a frame back, forward"},
                         {"Page Up, Page Down", "faster, slower"},
                         {"Tab", "panels on, off"},
                         {"F12", "picture to a file"},
                         {"drop a file", "view that pack or scene"},
                         {"F1", "this list"},
                         {"Ctrl+Q", "quit"}};

void setStyle() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.FrameRounding = style.GrabRounding = style.PopupRounding = 3;
  style.WindowBorderSize = 0;
  style.FramePadding = {4, 2};
  style.ItemSpacing = {6, 4};
  style.Colors[ImGuiCol_WindowBg] = {0.10f, 0.10f, 0.11f, 1};
  style.Colors[ImGuiCol_FrameBg] = {0.18f, 0.18f, 0.20f, 1};
  style.Colors[ImGuiCol_FrameBgHovered] = {0.24f, 0.24f, 0.27f, 1};
  style.Colors[ImGuiCol_FrameBgActive] = {0.28f, 0.28f, 0.31f, 1};
  style.Colors[ImGuiCol_Header] = style.Colors[ImGuiCol_Button] = {0.20f, 0.21f, 0.24f, 1};
  style.Colors[ImGuiCol_HeaderHovered] = style.Colors[ImGuiCol_ButtonHovered] = {0.29f, 0.30f, 0.34f, 1};
  style.Colors[ImGuiCol_HeaderActive] = style.Colors[ImGuiCol_ButtonActive] = {0.86f, 0.47f, 0.16f, 1};
  style.Colors[ImGuiCol_SliderGrab] = style.Colors[ImGuiCol_CheckMark] = {0.86f, 0.47f, 0.16f, 1};
  style.Colors[ImGuiCol_SliderGrabActive] = {0.98f, 0.60f, 0.26f, 1};
}

const char* nameOf(Loop loop) {
  constexpr const char* kNames[] = {"once", "loop", "ping-pong"};
  return kNames[static_cast<int>(loop)];
}

}  // namespace

Panels::Panels(float scale) {
  setStyle();
  ImFontConfig font;
  font.SizePixels = std::max(13 * scale, 1.0f);
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->AddFontDefault(&font);
  io.FontGlobalScale = 1 / scale;
  io.IniFilename = nullptr;  // nothing is kept between runs
}

bool Panels::covered() const {
  return ImGui::GetIO().WantCaptureMouse;
}

bool Panels::typing() const {
  return ImGui::GetIO().WantTextInput;
}

void Panels::complain(const std::string& message) {
  if (std::find(errors_.begin(), errors_.end(), message) != errors_.end()) return;
  errors_.push_back(message);
  if (errors_.size() > kMostErrors) errors_.pop_front();
}

void Panels::tell(const std::string& message, double now) {
  message_ = message;
  messageEnd_ = now + kMessageSeconds;
}

const Area& Panels::arrange() {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float side = open_ ? std::min(kSide, size.x * 0.45f) : 0, below = open_ ? std::min(kBelow, size.y * 0.45f) : 0;
  picture_ = {0, 0, std::max(size.x - side, 1.0f), std::max(size.y - below, 1.0f)};
  return picture_;
}

Asked Panels::draw(Document& document, OrbitCamera& camera, const Report& report) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  arrange();
  Asked asked;
  if (open_) {
    ImGui::SetNextWindowPos({picture_.width, 0});
    ImGui::SetNextWindowSize({size.x - picture_.width, size.y});
    ImGui::Begin("Side", nullptr, kFixed);
    drawSide(document, camera, report, asked);
    ImGui::End();
    ImGui::SetNextWindowPos({0, picture_.height});
    ImGui::SetNextWindowSize({picture_.width, size.y - picture_.height});
    ImGui::Begin("Below", nullptr, kFixed | ImGuiWindowFlags_NoScrollbar);
    drawBelow(document, report, asked);
    ImGui::End();
  }
  drawErrors();
  drawMessage();
  if (help_) drawHelp();
  return asked;
}

void Panels::drawSide(Document& document, OrbitCamera& camera, const Report& report, Asked& asked) {
  const float room = ImGui::GetContentRegionAvail().x;
  ImGui::PushItemWidth(std::clamp(room - kLabel, room * 0.4f, room * 0.58f));
  const ImGuiTreeNodeFlags open = ImGuiTreeNodeFlags_DefaultOpen;
  if (document.choices().size() > 1) drawContents(document, asked);
  if (ImGui::CollapsingHeader("Look", open)) drawLook(document, asked);
  drawGrids(document, asked);
  if (ImGui::CollapsingHeader("Light", open)) drawLight(document, asked);
  if (ImGui::CollapsingHeader("Drawing", open)) drawDrawing(document, report, asked);
  if (ImGui::CollapsingHeader("Residency", open)) {
    // The time line of a scene is none of a volume's frames.
    if (document.request.scene && !report.residency.empty()) drawFrames(report.residency);
    drawResidency(report, asked);
  }
  if (ImGui::CollapsingHeader("Times", open)) drawTimes(report);
  if (ImGui::CollapsingHeader("Camera and picture")) drawCamera(camera, asked);
  ImGui::PopItemWidth();
  ImGui::Spacing();
  if (ImGui::SmallButton("Keys (F1)")) help_ = !help_;
  ImGui::SameLine();
  ImGui::TextDisabled("%s", report.deviceName.c_str());
}

void Panels::drawContents(Document& document, Asked& asked) {
  if (!ImGui::BeginCombo("shows", document.choice().name.c_str())) return;
  for (const Choice& choice : document.choices()) {
    const std::string label = (choice.effect ? "effect: " : "volume: ") + choice.name;
    const bool chosen = choice == document.choice();
    if (ImGui::Selectable(label.c_str(), chosen) && !chosen) asked.choice = choice;
  }
  ImGui::EndCombo();
}

void Panels::drawCamera(OrbitCamera& camera, Asked& asked) {
  float degrees = camera.fieldOfView();
  if (ImGui::SliderFloat("field of view", &degrees, 5, 120, "%.0f deg", ImGuiSliderFlags_AlwaysClamp)) {
    camera.setFieldOfView(degrees);
    asked.redraw = true;
  }
  if (ImGui::Button("Frame all (F)")) asked.frameAll = true;
  ImGui::SameLine();
  if (ImGui::Button("Reset (Home)")) asked.resetCamera = true;
  if (ImGui::Button("Picture (F12)")) asked.screenshot = true;
  ImGui::SameLine();
  int format = exr_ ? 1 : 0;
  ImGui::RadioButton("PNG", &format, 0);
  ImGui::SameLine();
  ImGui::RadioButton("EXR", &format, 1);
  exr_ = format == 1;
}

void Panels::drawInterpolation(Document& document, Asked& asked) {
  constexpr std::array kNames = {"hold", "blend", "advect"};
  constexpr std::array kWays = {Interpolation::hold, Interpolation::blend, Interpolation::advect};
  ImGui::SetNextItemWidth(80);
  if (!ImGui::BeginCombo("##between", kNames[static_cast<std::size_t>(document.request.interpolate)])) return;
  for (std::size_t i = 0; i < kWays.size(); ++i) {
    const bool possible = kWays[i] != Interpolation::advect || document.hasVelocity();
    const ImGuiSelectableFlags flags = possible ? ImGuiSelectableFlags_None : ImGuiSelectableFlags_Disabled;
    if (!ImGui::Selectable(kNames[i], kWays[i] == document.request.interpolate, flags)) continue;
    document.request.interpolate = kWays[i];
    asked.redraw = true;
  }
  ImGui::EndCombo();
}

void Panels::drawBelow(Document& document, const Report& report, Asked& asked) {
  Timeline& timeline = *document.timeline;
  const float width = ImGui::GetContentRegionAvail().x;
  if (ImGui::Button(timeline.playing() ? "Pause" : "Play", {52, 0})) {
    timeline.playing() ? timeline.pause() : timeline.play();
  }
  ImGui::SameLine();
  if (ImGui::Button("<")) timeline.step(-1);
  ImGui::SameLine();
  if (ImGui::Button(">")) timeline.step(1);
  ImGui::SameLine();
  ImGui::SetNextItemWidth(96);
  if (ImGui::BeginCombo("##loop", nameOf(timeline.loop()))) {
    for (const Loop loop : {Loop::loop, Loop::pingPong, Loop::once}) {
      if (ImGui::Selectable(nameOf(loop), loop == timeline.loop())) timeline.setLoop(loop);
    }
    ImGui::EndCombo();
  }
  ImGui::SameLine();
  drawInterpolation(document, asked);
  ImGui::SameLine();
  auto speed = static_cast<float>(timeline.speed());
  ImGui::SetNextItemWidth(std::clamp(width - 500, 60.0f, 200.0f));
  const auto most = static_cast<float>(kMostSpeed);
  if (ImGui::SliderFloat("##speed", &speed, -most, most, "%.2f x", ImGuiSliderFlags_AlwaysClamp)) {
    timeline.setSpeed(double{speed});
  }
  if (ImGui::IsItemClicked(ImGuiMouseButton_Right)) timeline.setSpeed(1);
  const Tick& tick = timeline.ticks()[timeline.tick()];
  const std::string text = fmt::format("frame {}   {:.2f} / {:.2f} s", tick.number, timeline.time(), timeline.end());
  const float room = width - ImGui::CalcTextSize(text.c_str()).x;
  if (width > 540) {
    ImGui::SameLine(std::max(room, 0.0f));
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text.c_str());
  }
  double time = 0;
  const std::vector<std::uint8_t> none;
  const auto& residency = document.request.scene ? none : report.residency;
  if (drawTimeStrip(timeline, residency, ImGui::GetContentRegionAvail().y, time)) timeline.seek(time);
  asked.redraw = asked.redraw || ImGui::IsItemActive();
}

void Panels::drawErrors() {
  if (errors_.empty()) return;
  ImGui::SetNextWindowPos({10, 10});
  ImGui::SetNextWindowSizeConstraints({0, 0}, {std::max(picture_.width - 20, 120.0f), picture_.height});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, {0.35f, 0.07f, 0.06f, 0.92f});
  ImGui::Begin("Errors", nullptr, kFloating);
  ImGui::PushTextWrapPos(std::max(picture_.width - 40, 100.0f));
  for (const std::string& error : errors_) ImGui::TextWrapped("%s", error.c_str());
  ImGui::PopTextWrapPos();
  if (ImGui::SmallButton("Dismiss")) errors_.clear();
  ImGui::End();
  ImGui::PopStyleColor();
}

void Panels::drawMessage() {
  if (message_.empty() || ImGui::GetTime() > messageEnd_) return;
  ImGui::SetNextWindowPos({10, picture_.height - 10}, ImGuiCond_Always, {0, 1});
  ImGui::SetNextWindowBgAlpha(0.8f);
  ImGui::Begin("Message", nullptr, kFloating | ImGuiWindowFlags_NoInputs);
  ImGui::TextUnformatted(message_.c_str());
  ImGui::End();
}

void Panels::drawHelp() {
  ImGui::SetNextWindowPos({picture_.width / 2, picture_.height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowBgAlpha(0.92f);
  ImGui::Begin("Keys", nullptr, kFloating);
  for (const Key& key : kKeys) {
    ImGui::TextColored({0.98f, 0.68f, 0.38f, 1}, "%s", key.keys);
    ImGui::SameLine(180);
    ImGui::TextUnformatted(key.meaning);
  }
  ImGui::End();
}

}  // namespace billow::viewer
