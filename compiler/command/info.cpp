#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "command.h"
#include "encoding_keys.h"
#include "pack_summary.h"

namespace billow::command {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCodecNames[] = {"raw", "zstd", "model"};
constexpr const char* kStreamNames[format::kStreamCount] = {"bricks", "masks", "node5", "node4", "node3", "children"};
constexpr const char* kClassNames[format::kBrickClassCount] = {"bc7", "uniform", "local", "coarse"};

Json toJson(const format::GpuBytes& gpu) {
  Json json;
  json["indexKind"] = gpu.index == format::GpuIndex::flat ? "flat" : "tree";
  json["index"] = gpu.indexBytes;
  json["records"] = gpu.recordBytes;
  json["masks"] = gpu.maskBytes;
  for (std::uint32_t i = 0; i < format::kBrickClassCount; ++i) json[kClassNames[i]] = gpu.classBytes[i];
  json["total"] = gpu.total();
  return json;
}

Json toJson(const GridFrameSummary& frame, bool level) {
  Json json;
  json["frame"] = frame.frame;
  json["present"] = frame.present;
  json["activeVoxels"] = frame.activeVoxels;
  json["bricks"] = frame.bricks;
  json["psnr"] = frame.psnr ? Json(*frame.psnr) : Json(nullptr);  // null: exact, or nothing is active
  json["maxError"] = frame.maxError;
  json["sourceMin"] = frame.sourceMin;
  json["sourceMax"] = frame.sourceMax;
  json["gpuBytes"] = toJson(frame.gpu);
  if (level) {
    json["inPlaceOfFull"]["psnr"] = frame.levelPsnr ? Json(*frame.levelPsnr) : Json(nullptr);
    json["inPlaceOfFull"]["maxError"] = frame.levelMaxError;
  }
  return json;
}

Json toJson(const VolumeSummary& volume) {
  Json json;
  json["name"] = volume.name;
  if (volume.level != 0) json["factor"] = 1u << volume.level;
  json["framesPerSecond"] = volume.framesPerSecond;
  json["frames"] = Json::array();
  for (const format::FrameRecord& frame : volume.frames) {
    Json row;
    row["frame"] = frame.number;
    row["seconds"] = frame.time;
    if ((frame.flags & format::kFrameHeld) != 0) row["missing"] = "held";
    if ((frame.flags & format::kFrameBlank) != 0) row["missing"] = "blank";
    json["frames"].push_back(row);
  }
  json["grids"] = Json::array();
  for (const GridSummary& grid : volume.grids) {
    Json row;
    row["name"] = grid.name;
    row["role"] = grid.role;
    row["sourceType"] = grid.sourceType;
    row["frames"] = Json::array();
    for (const GridFrameSummary& frame : grid.frames) row["frames"].push_back(toJson(frame, volume.level != 0));
    json["grids"].push_back(row);
  }
  if (volume.level == 0) json["levels"] = Json::array();
  for (const VolumeSummary& level : volume.levels) json["levels"].push_back(toJson(level));
  return json;
}

Json toJson(const EffectSummary& effect) {
  Json json;
  json["name"] = effect.name;
  json["seconds"] = effect.duration;
  json["loop"] = effect.loop;
  json["mostAlive"] = effect.mostAlive;
  json["emitters"] = Json::array();
  for (const EmitterSummary& emitter : effect.emitters) {
    json["emitters"].push_back({{"name", emitter.name}, {"born", emitter.born}, {"mostAlive", emitter.mostAlive}});
  }
  return json;
}

// What effects put on the GPU, by kind.
constexpr std::pair<const char*, std::uint64_t format::EffectGpuBytes::*> kEffectKinds[] = {
    {"materials", &format::EffectGpuBytes::materials}, {"curves", &format::EffectGpuBytes::curves},
    {"ramps", &format::EffectGpuBytes::ramps},         {"maps", &format::EffectGpuBytes::maps},
    {"surfaces", &format::EffectGpuBytes::surfaces},   {"emitters", &format::EffectGpuBytes::emitters},
    {"given", &format::EffectGpuBytes::given},         {"tracks", &format::EffectGpuBytes::tracks},
    {"particles", &format::EffectGpuBytes::particles}};

Json toJson(const PackSummary& pack) {
  Json json;
  json["pack"] = pack.path;
  json["fileBytes"] = pack.fileBytes;
  json["disk"]["tables"] = pack.tableBytes;
  json["disk"]["effects"] = pack.effectBytes;  // part of the tables
  json["disk"]["pages"] = pack.storedPageBytes;
  json["pages"]["count"] = pack.pageCount;
  json["pages"]["rawBytes"] = pack.rawPageBytes;
  json["gpu"]["volumes"] = pack.volumeGpuBytes;  // all frames resident
  for (const auto& [name, bytes] : kEffectKinds) json["gpu"]["effects"][name] = pack.effectGpu.*bytes;
  json["gpu"]["effects"]["total"] = pack.effectGpu.total();
  json["gpu"]["total"] = pack.gpuBytes();
  for (std::size_t i = 0; i < pack.pagesByCodec.size(); ++i)
    json["pages"]["codecs"][kCodecNames[i]] = pack.pagesByCodec[i];
  for (std::uint32_t i = 0; i < format::kStreamCount; ++i) json["pages"][kStreamNames[i]] = pack.rawByStream[i];
  for (std::uint32_t i = 0; i < format::kEncodingCount; ++i) json["encodings"][kEncodingKeys[i]] = pack.encodings[i];
  const Json info = Json::parse(pack.infoJson, nullptr, false);
  json["info"] = pack.infoJson.empty() ? Json(nullptr) : info.is_discarded() ? Json(pack.infoJson) : info;
  json["volumes"] = Json::array();
  for (const VolumeSummary& volume : pack.volumes) json["volumes"].push_back(toJson(volume));
  json["effects"] = Json::array();
  for (const EffectSummary& effect : pack.effects) json["effects"].push_back(toJson(effect));
  return json;
}

std::string size(std::uint64_t bytes) {
  const auto value = static_cast<double>(bytes);
  if (value < 1e3) return fmt::format("{} B", bytes);
  if (value < 1e6) return fmt::format("{:.1f} kB", value * 1e-3);
  if (value < 1e9) return fmt::format("{:.2f} MB", value * 1e-6);
  return fmt::format("{:.2f} GB", value * 1e-9);
}

std::string psnrText(const GridFrameSummary& frame, const std::optional<double>& psnr) {
  if (psnr) return fmt::format("{:.2f} dB", *psnr);
  return frame.activeVoxels > 0 ? "exact" : "-";
}

std::string frameText(const VolumeSummary& volume) {
  if (volume.frames.empty()) return "no frames";
  const auto count = [&](std::uint32_t flag) {
    return std::count_if(volume.frames.begin(), volume.frames.end(),
                         [&](const format::FrameRecord& frame) { return (frame.flags & flag) != 0; });
  };
  std::string text =
      fmt::format("{} frame{} ({} to {}) at {:g} a second", volume.frames.size(), volume.frames.size() == 1 ? "" : "s",
                  volume.frames.front().number, volume.frames.back().number, volume.framesPerSecond);
  if (const auto held = count(format::kFrameHeld)) text += fmt::format(", {} missing and held", held);
  if (const auto blank = count(format::kFrameBlank)) text += fmt::format(", {} missing and blank", blank);
  return text;
}

void printGrid(const GridSummary& grid) {
  fmt::print("\n  {} ({}), used as {}\n", grid.name, grid.sourceType, grid.role);
  fmt::print("  {:>8} {:>13} {:>9} {:>9} {:>11} {:>11} {:>23}\n", "frame", "active voxels", "bricks", "PSNR",
             "max error", "on the GPU", "source values");
  for (const GridFrameSummary& frame : grid.frames) {
    if (!frame.present) {
      fmt::print("  {:>8} {:>13}\n", frame.frame, "not there");
      continue;
    }
    fmt::print("  {:>8} {:>13} {:>9} {:>9} {:>11.4g} {:>11} {:>23}\n", frame.frame, frame.activeVoxels, frame.bricks,
               psnrText(frame, frame.psnr), frame.maxError, size(frame.gpu.total()),
               fmt::format("{:.4g} to {:.4g}", frame.sourceMin, frame.sourceMax));
  }
}

// What drawing a level in the full volume's place costs and loses.
void printLevelGrid(const GridSummary& grid) {
  fmt::print("\n  {}, in the full volume's place\n", grid.name);
  fmt::print("  {:>8} {:>13} {:>9} {:>9} {:>11} {:>11}\n", "frame", "active voxels", "bricks", "PSNR", "max error",
             "on the GPU");
  for (const GridFrameSummary& frame : grid.frames) {
    if (!frame.present) continue;
    fmt::print("  {:>8} {:>13} {:>9} {:>9} {:>11.4g} {:>11}\n", frame.frame, frame.activeVoxels, frame.bricks,
               psnrText(frame, frame.levelPsnr), frame.levelMaxError, size(frame.gpu.total()));
  }
}

// The frame that needs the most memory, by kind.
void printLargestFrame(const VolumeSummary& volume) {
  format::GpuBytes largest;
  std::int32_t number = 0;
  for (std::size_t f = 0; f < volume.frames.size(); ++f) {
    format::GpuBytes sum;
    for (const GridSummary& grid : volume.grids) {
      sum.indexBytes += grid.frames[f].gpu.indexBytes;
      sum.recordBytes += grid.frames[f].gpu.recordBytes;
      sum.maskBytes += grid.frames[f].gpu.maskBytes;
      sum.brickBytes += grid.frames[f].gpu.brickBytes;
      for (std::uint32_t i = 0; i < format::kBrickClassCount; ++i)
        sum.classBytes[i] += grid.frames[f].gpu.classBytes[i];
    }
    if (sum.total() < largest.total()) continue;
    largest = sum;
    number = volume.frames[f].number;
  }
  if (largest.total() == 0) return;
  std::string kinds = fmt::format("index {}, brick headers {}, masks {}", size(largest.indexBytes),
                                  size(largest.recordBytes), size(largest.maskBytes));
  for (std::uint32_t i = 0; i < format::kBrickClassCount; ++i) {
    if (largest.classBytes[i] > 0) kinds += fmt::format(", {} {}", kClassNames[i], size(largest.classBytes[i]));
  }
  fmt::print("\n  Largest frame on the GPU: {}, {} ({})\n", number, size(largest.total()), kinds);
}

void printEffect(const EffectSummary& effect) {
  fmt::print("\n{}: effect of {:g} s{}, at most {} particles alive\n", effect.name, effect.duration,
             effect.loop ? ", again and again" : "", effect.mostAlive);
  for (const EmitterSummary& emitter : effect.emitters) {
    fmt::print("  {}: {} particles in a run, at most {} alive\n", emitter.name, emitter.born, emitter.mostAlive);
  }
}

void printEffectBytes(const PackSummary& pack) {
  std::string kinds;
  for (const auto& [name, bytes] : kEffectKinds) {
    const std::uint64_t count = pack.effectGpu.*bytes;
    if (count > 0) kinds += fmt::format("{}{} {}", kinds.empty() ? "" : ", ", name, size(count));
  }
  fmt::print("\nEffects: {} on disk, {} on the GPU ({})\n", size(pack.effectBytes), size(pack.effectGpu.total()),
             kinds);
}

void printText(const PackSummary& pack) {
  fmt::print("{}: {} (pages {}, {} when unpacked; tables {})\n", pack.path, size(pack.fileBytes),
             size(pack.storedPageBytes), size(pack.rawPageBytes), size(pack.tableBytes));
  std::string codecs;
  for (std::size_t i = 0; i < pack.pagesByCodec.size(); ++i) {
    if (pack.pagesByCodec[i] > 0) codecs += fmt::format("  {} {}", kCodecNames[i], pack.pagesByCodec[i]);
  }
  if (!codecs.empty()) fmt::print("Pages by codec:{}\n", codecs);
  std::string encodings;
  for (std::uint32_t i = 0; i < format::kEncodingCount; ++i) {
    if (pack.encodings[i] > 0) encodings += fmt::format("  {} {}", kEncodingKeys[i], pack.encodings[i]);
  }
  if (!encodings.empty()) fmt::print("Bricks by encoding, over all frames:{}\n", encodings);
  for (const VolumeSummary& volume : pack.volumes) {
    fmt::print("\n{}: {}\n", volume.name, frameText(volume));
    for (const GridSummary& grid : volume.grids) printGrid(grid);
    printLargestFrame(volume);
    for (const VolumeSummary& level : volume.levels) {
      fmt::print("\n{}: level of voxels {} times as long\n", level.name, 1u << level.level);
      for (const GridSummary& grid : level.grids) printLevelGrid(grid);
      printLargestFrame(level);
    }
  }
  for (const EffectSummary& effect : pack.effects) printEffect(effect);
  if (!pack.effects.empty()) printEffectBytes(pack);
  fmt::print("\nAll of it on the GPU: {}\n", size(pack.gpuBytes()));
}

int runInfo(const std::string& path, bool json) {
  const format::Result<PackSummary> pack = summarise(path);
  if (!pack) return reportIssue(path, pack.error());
  if (json) {
    fmt::print("{}\n", toJson(*pack).dump(2, ' ', false, Json::error_handler_t::replace));
  } else {
    printText(*pack);
  }
  return kDone;
}

}  // namespace

void addInfo(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("info", "Say what is in a pack: grids, frames, error, bytes on disk and GPU");
  struct Arguments {
    std::string pack;
    bool json = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("PACK", arguments->pack, "The .blw file")->required();
  command->add_flag("--json", arguments->json, "One JSON object on stdout, and nothing else");
  command->footer(
      "On the GPU are all frames and effects at once, what they share counted once; of particles, as many as may be "
      "alive.\n"
      "A level in its volume's place: errors of all voxels, linear between its own, as if in the active ones.\n"
      "PSNR is 20 log10(range / rmse) over active voxels, range that of the source's values and background.\n"
      "Exit codes: 0 done, 1 command line, 2 the file cannot be read, 3 it is no sound pack.");
  command->callback([&run, arguments] { run = [arguments] { return runInfo(arguments->pack, arguments->json); }; });
}

}  // namespace billow::command
