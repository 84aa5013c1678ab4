// The panels that draw themselves: the time line, where the bytes are, and what the passes take.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "panels.h"

namespace billow::viewer {
namespace {

constexpr ImU32 kAbsent = IM_COL32(52, 53, 58, 255);
// By how much coarser they are: 2^n.
constexpr std::array<ImU32, 4> kResident = {IM_COL32(86, 132, 94, 255), IM_COL32(122, 138, 82, 255),
                                            IM_COL32(146, 130, 74, 255), IM_COL32(138, 100, 66, 255)};
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

ImU32 colorOf(std::uint8_t level) {
  return level == runtime::kNotResident ? kAbsent : kResident[std::min<std::size_t>(level, kResident.size() - 1)];
}

// Cells of frames, each as wide as a pixel or more; of several the coarsest.
void drawCells(ImVec2 corner, ImVec2 size, std::size_t count, const std::vector<std::uint8_t>& residency) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const auto columns = static_cast<std::size_t>(std::clamp(size.x, 1.0f, static_cast<float>(count)));
  const float width = size.x / static_cast<float>(columns);
  const float gap = width > 4 ? 1 : 0;
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t first = column * count / columns, last = (column + 1) * count / columns;
    std::uint8_t coarsest = residency.size() == count ? 0 : runtime::kNotResident;
    for (std::size_t frame = first; frame < last && residency.size() == count; ++frame) {
      coarsest = std::max(coarsest, residency[frame]);
    }
    const float x = corner.x + width * static_cast<float>(column);
    list.AddRectFilled({x, corner.y}, {x + width - gap, corner.y + size.y}, colorOf(coarsest));
  }
}

// A bar that is full where the budget is.
void drawShare(std::uint64_t bytes, std::uint64_t budget, const char* of) {
  const float share = static_cast<float>(bytes) / static_cast<float>(std::max<std::uint64_t>(budget, 1));
  const std::string text =
      fmt::format("{}: {} of {}", of, megabytes(static_cast<double>(bytes)), megabytes(static_cast<double>(budget)));
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, kResident[0]);
  ImGui::ProgressBar(share, {-1, 0}, text.c_str());
  ImGui::PopStyleColor();
}

}  // namespace

bool drawTimeStrip(const Timeline& timeline, const std::vector<std::uint8_t>& residency, float height, double& time) {
  ImVec2 size;
  const ImVec2 corner = box("time", height, size);
  const double length = timeline.end() - timeline.begin();
  drawCells(corner, size, timeline.ticks().size(), residency);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const auto share = static_cast<float>((timeline.time() - timeline.begin()) / length);
  const float x = corner.x + share * size.x;
  list.AddRectFilled({x - 1.5f, corner.y - 2}, {x + 1.5f, corner.y + size.y + 2}, kHead);
  const bool held = ImGui::IsItemActive() || ImGui::IsItemDeactivated();
  if (!held || !ImGui::IsMousePosValid()) return false;
  const float at = std::clamp((ImGui::GetIO().MousePos.x - corner.x) / size.x, 0.0f, 1.0f);
  time = timeline.begin() + double{at} * length;
  return true;
}

void drawFrames(const std::vector<std::uint8_t>& residency) {
  ImVec2 size;
  const ImVec2 corner = box("frames", 10, size);
  drawCells(corner, size, residency.size(), residency);
}

void drawResidency(const Report& report, Asked& asked) {
  drawShare(report.traffic.now().gpuAllocated, report.streaming.gpu, "frames");
  drawShare(report.bytesInUse, report.budget, "all");
  constexpr float kLeast = 1;
  const float most = static_cast<float>(report.budget) / (1 << 20);
  float budget = static_cast<float>(report.streaming.gpu) / (1 << 20);
  if (ImGui::SliderFloat("budget", &budget, kLeast, most, "%.1f MiB",
                         ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
    asked.streaming = static_cast<std::uint64_t>(double{std::clamp(budget, kLeast, most)} * (1 << 20));
  }
  ImGui::PushTextWrapPos(0);
  for (const std::string& line : linesOf(report.traffic)) ImGui::TextUnformatted(line.c_str());
  ImGui::PopTextWrapPos();
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
