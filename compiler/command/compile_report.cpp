#include "compile_report.h"

#include <fmt/format.h>

#include <cmath>

#include "encoding_keys.h"

namespace billow::command {
namespace {

using compiler::EncodingTally;
using compiler::GridReport;
using Json = nlohmann::ordered_json;

std::string psnrText(double psnr) {
  return std::isfinite(psnr) ? fmt::format("{:.2f} dB", psnr) : "exact";
}

std::string size(std::uint64_t bytes) {
  const auto value = static_cast<double>(bytes);
  if (value < 1e6) return fmt::format("{:.1f} kB", value * 1e-3);
  return fmt::format("{:.2f} MB", value * 1e-6);
}

double rmse(const EncodingTally& tally) {
  return tally.activeVoxels == 0 ? 0 : std::sqrt(tally.squaredError / static_cast<double>(tally.activeVoxels));
}

void printGrid(const GridReport& grid) {
  fmt::print(
      "\n{}{}{}: {} frame{}, {} active voxels, worst PSNR {}, largest error {:.4g}, at most {} on the GPU a frame\n",
      grid.volume, grid.volume.empty() ? "" : "/", grid.grid, grid.frames, grid.frames == 1 ? "" : "s",
      grid.activeVoxels, psnrText(grid.worstPsnr), grid.maxError, size(grid.largestFrameGpuBytes));
  if (grid.level != 0) {
    fmt::print("  in place of the full volume: worst PSNR {}, largest error {:.4g}\n", psnrText(grid.levelPsnr),
               grid.levelMaxError);
  }
  bool header = false;
  for (std::size_t e = 0; e < grid.encodings.size(); ++e) {
    const EncodingTally& tally = grid.encodings[e];
    if (tally.bricks == 0) continue;
    if (!header) fmt::print("  {:<10} {:>9} {:>9} {:>10} {:>11}\n", "encoding", "bricks", "reused", "stored", "rmse");
    header = true;
    fmt::print("  {:<10} {:>9} {:>9} {:>10} {:>11.4g}\n", kEncodingKeys[e], tally.bricks, tally.reused,
               size(tally.bytes), rmse(tally));
  }
}

Json toJson(const GridReport& grid) {
  Json row;
  row["volume"] = grid.volume;
  row["grid"] = grid.grid;
  if (grid.level != 0) row["factor"] = 1u << grid.level;
  row["frames"] = grid.frames;
  row["activeVoxels"] = grid.activeVoxels;
  row["worstPsnr"] = std::isfinite(grid.worstPsnr) ? Json(grid.worstPsnr) : Json(nullptr);
  row["maxError"] = grid.maxError;
  if (grid.level != 0) {
    row["inPlaceOfFull"]["worstPsnr"] = std::isfinite(grid.levelPsnr) ? Json(grid.levelPsnr) : Json(nullptr);
    row["inPlaceOfFull"]["maxError"] = grid.levelMaxError;
  }
  row["largestFrameGpuBytes"] = grid.largestFrameGpuBytes;
  for (std::size_t e = 0; e < grid.encodings.size(); ++e) {
    const EncodingTally& tally = grid.encodings[e];
    row["bricks"][kEncodingKeys[e]] = tally.bricks;
    if (tally.bricks == 0) continue;
    Json& chosen = row["encodings"][kEncodingKeys[e]];
    chosen["bricks"] = tally.bricks;
    chosen["reused"] = tally.reused;
    chosen["storedBytes"] = tally.bytes;
    chosen["activeVoxels"] = tally.activeVoxels;
    chosen["squaredError"] = tally.squaredError;
    chosen["rmse"] = rmse(tally);
  }
  return row;
}

}  // namespace

void printReport(const compiler::CompileReport& report, const std::string& output) {
  fmt::print("{}: {} frame{}, {} on disk, {} on the GPU with all frames resident\n", output, report.frames,
             report.frames == 1 ? "" : "s", size(report.fileBytes), size(report.gpuBytes));
  for (const GridReport& grid : report.grids) printGrid(grid);
  for (const compiler::EffectReport& effect : report.effects) {
    fmt::print("\n{}: effect of {} emitter{}, at most {} particles alive\n", effect.name, effect.emitters,
               effect.emitters == 1 ? "" : "s", effect.mostAlive);
  }
  if (!report.effects.empty())
    fmt::print("Effects take {} on disk, {} on the GPU\n", size(report.effectBytes), size(report.effectGpuBytes));
}

nlohmann::ordered_json reportJson(const compiler::CompileReport& report, const std::string& output) {
  Json json;
  json["output"] = output;
  json["frames"] = report.frames;
  json["fileBytes"] = report.fileBytes;
  json["gpuBytes"] = report.gpuBytes;
  json["grids"] = Json::array();
  for (const GridReport& grid : report.grids) json["grids"].push_back(toJson(grid));
  json["effectBytes"] = report.effectBytes;
  json["effectGpuBytes"] = report.effectGpuBytes;
  json["effects"] = Json::array();
  for (const compiler::EffectReport& effect : report.effects) {
    json["effects"].push_back({{"name", effect.name}, {"emitters", effect.emitters}, {"mostAlive", effect.mostAlive}});
  }
  return json;
}

}  // namespace billow::command
