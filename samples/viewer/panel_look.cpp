// The panels that change how a document looks and how it is drawn.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "billow/format/look.h"
#include "panels.h"

namespace billow::viewer {
namespace {

constexpr ImGuiSliderFlags kLogarithmic = ImGuiSliderFlags_Logarithmic;
constexpr ImGuiSliderFlags kClamped = ImGuiSliderFlags_AlwaysClamp;
constexpr float kDegree = std::numbers::pi_v<float> / 180;

bool factor(const char* label, float& value) {
  return ImGui::SliderFloat(label, &value, 0, 100, "%.3g", kLogarithmic | kClamped);
}

// A field of a look that is 0 or more: a hundredth to a hundredfold of what fits.
bool scale(const char* label, float fitting, float& value) {
  const float middle = fitting > 0 && fitting < 1e30f ? fitting : 1;
  return ImGui::SliderFloat(label, &value, middle / 100, middle * 100, "%.3g", kLogarithmic);
}

// The field as its record now has it.
void store(format::LookRecord& record, std::uint32_t field, const float* values) {
  const format::LookField& bounds = format::kLookFields[field];
  float held[3] = {};
  for (std::size_t i = 0; i < bounds.count; ++i) {
    held[i] = std::isfinite(values[i]) ? std::clamp(values[i], bounds.low, bounds.high) : bounds.low;
  }
  format::setLook(record, field, {held, bounds.count});
}

// Direction to the sun by angles about the upward axis and above the horizon, degrees.
struct Angles {
  float azimuth, elevation;
};

Angles anglesOf(const command::Triple& d, char up) {
  const float height = up == 'y' ? d[1] : d[2], side = d[0], front = up == 'y' ? d[2] : -d[1];
  return {std::atan2(side, front) / kDegree, std::atan2(height, std::hypot(side, front)) / kDegree};
}

command::Triple directionOf(const Angles& angles, char up) {
  const float azimuth = angles.azimuth * kDegree, elevation = angles.elevation * kDegree;
  const float side = std::cos(elevation) * std::sin(azimuth), front = std::cos(elevation) * std::cos(azimuth);
  return up == 'y' ? command::Triple{side, std::sin(elevation), front}
                   : command::Triple{side, -front, std::sin(elevation)};
}

// What is a volume's own.
bool drawOwn(Document& document, std::size_t volume) {
  command::LookRequest& own = document.request.volumes[volume].look;
  const runtime::Look& fitting = document.contents().volumes()[volume].suggested;
  runtime::Look look = document.lookOf(volume);
  bool changed = factor("density", own.density);
  if (fitting.emissionScale > 0) changed |= factor("fire", own.fire);
  const auto field = [&](bool edited, std::uint32_t number, const float* values) {
    if (!edited) return;
    store(own.record, number, values);
    changed = true;
  };
  field(scale("extinction", fitting.extinctionScale, look.extinctionScale), format::kLookExtinctionScale,
        &look.extinctionScale);
  field(ImGui::ColorEdit3("albedo", look.albedo.data(), ImGuiColorEditFlags_Float), format::kLookAlbedo,
        look.albedo.data());
  if (!(fitting.emissionScale > 0)) return changed;
  field(scale("emission", fitting.emissionScale, look.emissionScale), format::kLookEmissionScale, &look.emissionScale);
  field(ImGui::DragFloat("kelvin/value", &look.temperatureScale, std::abs(look.temperatureScale) * 0.005f + 0.001f, 0,
                         0, "%.4g"),
        format::kLookTemperatureScale, &look.temperatureScale);
  field(ImGui::DragFloat("kelvin at 0", &look.temperatureOffset, 2, 0, 0, "%.4g"), format::kLookTemperatureOffset,
        &look.temperatureOffset);
  return changed;
}

// How all matter scatters.
bool drawShared(Document& document) {
  command::LookRequest& shared = document.request.look;
  runtime::Look look = document.describe(true).look;
  bool changed = false;
  if (ImGui::SliderFloat("anisotropy", &look.anisotropy, -0.95f, 0.95f, "%.2f", kClamped)) {
    store(shared.record, format::kLookAnisotropy, &look.anisotropy);
    changed = true;
  }
  if (ImGui::ColorEdit3("ambient", look.ambient.data(), ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR)) {
    store(shared.record, format::kLookAmbient, look.ambient.data());
    changed = true;
  }
  auto orders = static_cast<int>(look.scatteringOrders);
  if (ImGui::SliderInt("orders", &orders, 1, 8, "%d", kClamped)) {
    shared.scatteringOrders = static_cast<std::uint32_t>(orders);
    changed = true;
  }
  return changed;
}

}  // namespace

void Panels::drawLook(Document& document, Asked& asked) {
  const auto& volumes = document.contents().volumes();
  volume_ = std::clamp(volume_, 0, std::max(static_cast<int>(volumes.size()) - 1, 0));
  if (volumes.size() > 1) {
    ImGui::SliderInt("volume", &volume_, 0, static_cast<int>(volumes.size()) - 1, "%d", kClamped);
  }
  if (!volumes.empty()) asked.redraw |= drawOwn(document, static_cast<std::size_t>(volume_));
  asked.redraw |= drawShared(document);
  if (ImGui::Button("Reset")) {
    asked.remakeSpace = document.request.surroundings > 0;
    document.resetLook();
    asked.redraw = true;
  }
  ImGui::SameLine();
  if (ImGui::Button("Copy as JSON")) {
    ImGui::SetClipboardText(sceneMembers(document, static_cast<std::size_t>(volume_)).c_str());
    tell("Members of a scene file are in the clipboard", ImGui::GetTime());
  }
}

// Which of the volume's grids are its matter, its heat and its flames.
void Panels::drawGrids(Document& document, Asked& asked) {
  const auto& volumes = document.contents().volumes();
  if (volumes.empty()) return;
  const auto number = static_cast<std::size_t>(volume_);
  const command::PlacedVolume& volume = volumes[number];
  if (volume.record().gridCount < 2 || !ImGui::CollapsingHeader("Grids")) return;
  command::GridNames& names = document.request.volumes[number].grids;
  const auto choose = [&](const char* label, std::uint32_t drawn, std::optional<std::string>& name) {
    const auto grids = volume.pack->gridsOf(volume.record());
    const std::string now(drawn == format::kNone ? "none" : volume.pack->string(grids[drawn].name));
    if (!ImGui::BeginCombo(label, now.c_str())) return;
    const auto offer = [&](const std::string& other) {
      if (!ImGui::Selectable(other.c_str(), other == now) || other == now) return;
      name = other;
      asked.regrid = number;
    };
    offer("none");
    for (const format::GridRecord& grid : grids) offer(std::string(volume.pack->string(grid.name)));
    ImGui::EndCombo();
  };
  choose("matter", volume.grids.extinction, names.extinction);
  choose("heat", volume.grids.temperature, names.temperature);
  choose("flames", volume.grids.flames, names.flames);
}

void Panels::drawLight(Document& document, Asked& asked) {
  command::RenderRequest& request = document.request;
  const char up = request.up.value_or(document.stage().up);
  command::SunChoice sun = command::sunOf(request, up, document.stage().burning);
  Angles angles = anglesOf(sun.direction, up);
  const bool turned = ImGui::SliderFloat("sun around", &angles.azimuth, -180, 180, "%.0f deg", kClamped);
  if (ImGui::SliderFloat("sun above", &angles.elevation, -90, 90, "%.0f deg", kClamped) || turned) {
    request.sunDirection = directionOf(angles, up);
    asked.redraw = true;
  }
  if (ImGui::SliderFloat("strength", &sun.intensity, 0, 100, "%.3g", kLogarithmic | kClamped)) {
    request.sunIntensity = sun.intensity;
    asked.redraw = true;
  }
  if (ImGui::ColorEdit3("color", sun.color.data(), ImGuiColorEditFlags_Float)) {
    for (float& channel : sun.color) channel = std::clamp(channel, 0.0f, 1.0f);
    request.sunColor = sun.color;
    asked.redraw = true;
  }
  asked.redraw |= ImGui::SliderFloat("exposure", &request.exposure, -8, 8, "%.1f stops", kClamped);
}

void Panels::drawDrawing(Document& document, const Report& report, Asked& asked) {
  command::RenderRequest& request = document.request;
  const std::string why = document.whyNotDirect();
  int method = request.method == command::Method::direct ? 1 : 0;
  ImGui::RadioButton("metavoxels", &method, 0);
  ImGui::SameLine();
  ImGui::BeginDisabled(!why.empty());
  ImGui::RadioButton("direct", &method, 1);
  ImGui::EndDisabled();
  if (!why.empty() && ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) ImGui::SetTooltip("%s", why.c_str());
  const auto chosen = method == 1 && why.empty() ? command::Method::direct : command::Method::metavoxel;
  asked.redraw |= chosen != request.method;
  request.method = chosen;
  if (chosen == command::Method::metavoxel) {
    if (!ImGui::IsAnyItemActive() || voxelSize_ <= 0) voxelSize_ = report.voxelSize;
    const auto finest = static_cast<float>(document.needs().lattice.edge);
    const float middle = finest > 0 ? finest : std::max(report.voxelSize, 1e-9f);
    ImGui::SliderFloat("voxel size", &voxelSize_, middle / 2, middle * 8, "%.3g", kLogarithmic | kClamped);
    if (ImGui::IsItemDeactivatedAfterEdit()) {
      request.voxelSize = double{voxelSize_};
      asked.remakeSpace = true;
    }
    const bool lit = request.surroundings > 0;
    if (ImGui::SliderFloat("surroundings", &request.surroundings, 0, 1, "%.2f", kClamped)) {
      asked.remakeSpace |= lit != (request.surroundings > 0);
      asked.redraw = true;
    }
  }
  asked.redraw |= ImGui::SliderFloat("step", &request.step, 0.25f, 4, "%.2f voxels", kLogarithmic | kClamped);
  int filter = request.filter == runtime::Filter::nearest ? 0 : 1;
  if (ImGui::Combo("filter", &filter, "nearest\0trilinear\0")) {
    request.filter = filter == 0 ? runtime::Filter::nearest : runtime::Filter::trilinear;
    asked.redraw = true;
  }
  float percent = resolution_ * 100;
  if (ImGui::SliderFloat("resolution", &percent, 10, 100, "%.0f %%", kClamped)) {
    resolution_ = percent / 100;
    asked.redraw = true;
  }
}

}  // namespace billow::viewer
