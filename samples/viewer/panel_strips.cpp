// The panels that draw themselves: the time line, where the bytes are, and what the passes take.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "panels.h"

namespace billow::viewer {
namespace {

constexpr ImU32 kAbsent = IM_COL32(52, 53, 58, 255), kResident = IM_COL32(86, 132, 94, 255);
constexpr ImU32 kHead = IM_COL32(250, 153, 66, 255);
constexpr std::array<ImU32, runtime::kMetavoxelTimestamps - 1> kPassColors = {
    IM_COL32(110, 130, 170, 255), IM_COL32(196, 122, 74, 255), IM_COL32(222, 190, 92, 255),
    IM_COL32(100, 160, 130, 255), IM_COL32(150, 110, 160, 255)};
constexpr std::array<const char*, runtime::kMetavoxelTimestamps - 1> kPassNames = {"bin", "fill", "light", "march",
                                                                                   "more rounds"};

// A box of the whole width; gives its corner.
ImVec2 box(const char* name, float height, ImVec2& size) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  size = {std::max(ImGui::GetContentRegionAvail().x, 1.0f), std::max(height, 1.0f)};
  ImGui::InvisibleButton(name, size);
  return corner;
}

std::string megabytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
}

// Cells of frames, each as wide as a pixel or more.
void drawCells(ImVec2 corner, ImVec2 size, std::size_t count, const std::vector<bool>& resident) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const auto columns = static_cast<std::size_t>(std::clamp(size.x, 1.0f, static_cast<float>(count)));
  const float width = size.x / static_cast<float>(columns);
  const float gap = width > 4 ? 1 : 0;
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t first = column * count / columns, last = (column + 1) * count / columns;
    bool all = resident.size() == count;
    for (std::size_t frame = first; frame < last && all; ++frame) all = resident[frame];
    const float x = corner.x + width * static_cast<float>(column);
    list.AddRectFilled({x, corner.y}, {x + width - gap, corner.y + size.y}, all ? kResident : kAbsent);
  }
}

}  // namespace

bool drawTimeStrip(const Timeline& timeline, const std::vector<bool>& resident, float height, double& time) {
  ImVec2 size;
  const ImVec2 corner = box("time", height, size);
  const double length = timeline.end() - timeline.begin();
  drawCells(corner, size, timeline.ticks().size(), resident);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const auto share = static_cast<float>((timeline.time() - timeline.begin()) / length);
  const float x = corner.x + share * size.x;
  list.AddRectFilled({x - 1.5f, corner.y - 2}, {x + 1.5f, corner.y + size.y + 2}, kHead);
  if (!ImGui::IsItemActive()) return false;
  const float at = std::clamp((ImGui::GetIO().MousePos.x - corner.x) / size.x, 0.0f, 1.0f);
  time = timeline.begin() + double{at} * length;
  return true;
}

void drawResidency(const Report& report) {
  const Residency& residency = report.residency;
  ImVec2 size;
  const ImVec2 corner = box("frames", 10, size);
  if (!residency.frames.empty()) drawCells(corner, size, residency.frames.size(), residency.frames);
  ImGui::Text("%u frames, %s", residency.resident, megabytes(residency.bytes).c_str());
  ImGui::SameLine(0, 12);
  ImGui::Text("late %llu", static_cast<unsigned long long>(residency.late));
  const float share =
      static_cast<float>(report.bytesInUse) / static_cast<float>(std::max<std::uint64_t>(report.budget, 1));
  const std::string text = megabytes(report.bytesInUse) + " of " + megabytes(report.budget);
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, kResident);
  ImGui::ProgressBar(share, {-1, 0}, text.c_str());
  ImGui::PopStyleColor();
}

void drawTimes(const Report& report) {
  if (report.times) {
    ImVec2 size;
    const ImVec2 corner = box("passes", 10, size);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    double sum = 1e-9, from = 0;
    for (const double pass : report.times->passes) sum += pass;
    sum = std::max(sum, report.times->total);
    list.AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, kAbsent);
    for (std::size_t i = 0; i < kPassNames.size(); ++i) {
      const double to = from + report.times->passes[i];
      const auto x = [&](double at) { return corner.x + size.x * static_cast<float>(at / sum); };
      list.AddRectFilled({x(from), corner.y}, {x(to), corner.y + size.y}, kPassColors[i]);
      from = to;
    }
    for (std::size_t i = 0; i < kPassNames.size(); ++i) {
      if (report.times->passes[i] < 0.005) continue;
      const ImVec2 at = ImGui::GetCursorScreenPos();
      list.AddRectFilled({at.x, at.y + 3}, {at.x + 8, at.y + 11}, kPassColors[i]);
      ImGui::SetCursorScreenPos({at.x + 14, at.y});
      ImGui::Text("%-12s %8.2f ms", kPassNames[i], report.times->passes[i]);
    }
    ImGui::Text("  %-12s %8.2f ms", "GPU, all", report.times->total);
  }
  if (report.pictureMilliseconds > 0) {
    ImGui::Text("  %-12s %8.2f ms", "a picture", report.pictureMilliseconds);
  }
}

}  // namespace billow::viewer
