#include "pack_summary.h"

#include <cstring>
#include <limits>
#include <span>

#include "billow/format/brick.h"
#include "billow/format/psnr.h"

namespace billow::command {
namespace {

constexpr const char* kRoleNames[format::kRoleCount] = {"none",       "extinction", "temperature", "flames",
                                                        "velocity x", "velocity y", "velocity z",  "colour r",
                                                        "colour g",   "colour b",   "fuel"};
constexpr const char* kTypeNames[format::kSourceTypeCount] = {"float", "half", "double", "int32", "int64",
                                                              "bool",  "mask", "vec3f",  "vec3d", "vec3i"};

GridFrameSummary summariseFrame(const format::GridFrame& frame, std::int32_t number) {
  GridFrameSummary summary;
  summary.frame = number;
  summary.present = (frame.flags & format::kGridPresent) != 0;
  summary.activeVoxels = frame.activeVoxels;
  const double psnr = format::psnr(frame);
  if (psnr < std::numeric_limits<double>::infinity()) summary.psnr = psnr;
  summary.maxError = static_cast<double>(frame.maxError);
  summary.sourceMin = static_cast<double>(frame.sourceMin);
  summary.sourceMax = static_cast<double>(frame.sourceMax);
  summary.bricks = frame.node3Count;
  summary.gpu = format::gpuBytes(frame);
  return summary;
}

VolumeSummary summariseVolume(const format::Pack& pack, const format::VolumeRecord& volume) {
  VolumeSummary summary;
  summary.name = pack.string(volume.name);
  summary.framesPerSecond = static_cast<double>(volume.framesPerSecond);
  const auto frames = pack.framesOf(volume);
  summary.frames.assign(frames.begin(), frames.end());
  for (std::uint32_t g = 0; g < volume.gridCount; ++g) {
    const format::GridRecord& record = pack.gridsOf(volume)[g];
    GridSummary grid;
    grid.name = pack.string(record.name);
    grid.role = kRoleNames[record.role];
    grid.sourceType = kTypeNames[record.sourceType];
    for (std::uint32_t f = 0; f < volume.frameCount; ++f) {
      grid.frames.push_back(summariseFrame(pack.gridFrame(volume, f, g), frames[f].number));
    }
    summary.grids.push_back(std::move(grid));
  }
  return summary;
}

VolumeSummary summariseLevel(const format::Pack& pack, const format::LevelRecord& level) {
  const format::VolumeRecord& full = pack.volumes()[level.volume];
  VolumeSummary summary = summariseVolume(pack, pack.volumes()[level.level]);
  summary.level = level.log2;
  for (std::uint32_t g = 0; g < full.gridCount; ++g) {
    for (std::uint32_t f = 0; f < full.frameCount; ++f) {
      const format::GridFrame& source = pack.gridFrame(full, f, g);
      const format::LevelError& error = pack.levelError(level, f, g);
      const double range = static_cast<double>(source.sourceMax) - static_cast<double>(source.sourceMin);
      const double psnr = format::psnr(range, error.squaredError, source.activeVoxels);
      GridFrameSummary& frame = summary.grids[g].frames[f];
      if (psnr < std::numeric_limits<double>::infinity()) frame.levelPsnr = psnr;
      frame.levelMaxError = static_cast<double>(error.maxError);
    }
  }
  return summary;
}

EffectSummary summariseEffect(const format::Pack& pack, const format::EffectRecord& effect) {
  const format::EffectTables& tables = pack.effects();
  EffectSummary summary;
  summary.name = pack.string(effect.name);
  summary.duration = static_cast<double>(effect.duration);
  summary.loop = (effect.flags & format::kEffectLoop) != 0;
  summary.mostAlive = format::mostAlive(tables, effect);
  for (std::uint32_t e = 0; e < effect.emitterCount; ++e) {
    const format::EmitterRecord& emitter = tables.emitters[effect.firstEmitter + e];
    const auto spans = std::span(tables.spans).subspan(emitter.firstSpan, emitter.spanCount);
    const std::uint64_t born = spans.empty() ? emitter.givenCount : spans.back().first + spans.back().count;
    summary.emitters.push_back({std::string(pack.string(emitter.name)), born, format::mostAlive(tables, effect, e)});
  }
  return summary;
}

// Items of each stream: the last page's end.
std::array<std::uint64_t, format::kStreamCount> itemCounts(const format::Pack& pack) {
  std::array<std::uint64_t, format::kStreamCount> counts{};
  if (pack.pages().empty()) return counts;
  for (std::uint32_t s = 0; s < format::kStreamCount; ++s) {
    const format::StreamRange& range = pack.pages().back().streams[s];
    counts[s] = std::uint64_t{range.first} + range.count;
  }
  return counts;
}

std::optional<format::Issue> countEncodings(const format::Pack& pack, PackSummary& summary) {
  for (std::uint32_t p = 0; p < pack.pages().size(); ++p) {
    const format::PageRecord& record = pack.pages()[p];
    if (record.streams[static_cast<std::uint32_t>(format::Stream::node3)].count == 0) continue;
    const format::Result<format::Page> page = pack.readPage(p);
    if (!page) return page.error();
    const auto bytes = page->stream(record, format::Stream::node3);
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(format::Node3)) {
      format::Node3 node;
      std::memcpy(&node, bytes.data() + at, sizeof node);
      if (format::encodingOf(node) < format::kEncodingCount) ++summary.encodings[format::encodingOf(node)];
    }
  }
  return std::nullopt;
}

}  // namespace

format::Result<PackSummary> summarise(const std::string& path) {
  const format::Result<format::Pack> pack = format::Pack::openFile(path);
  if (!pack) return tl::make_unexpected(pack.error());
  PackSummary summary;
  summary.path = path;
  summary.fileBytes = pack->fileSize();
  summary.pageCount = pack->pages().size();
  for (const format::PageRecord& page : pack->pages()) {
    summary.storedPageBytes += page.storedSize;
    summary.rawPageBytes += page.rawSize;
    ++summary.pagesByCodec.at(page.codec);  // an open pack has no codec that is not known
    for (std::uint32_t s = 0; s < format::kStreamCount; ++s) {
      summary.rawByStream[s] += std::uint64_t{page.streams[s].count} * format::kStreamItemBytes[s];
    }
  }
  summary.tableBytes = summary.fileBytes - summary.storedPageBytes;
  if (std::optional<format::Issue> issue = countEncodings(*pack, summary)) return tl::make_unexpected(*issue);
  format::Result<std::string> info = pack->infoJson();
  if (!info) return tl::make_unexpected(info.error());
  summary.infoJson = std::move(*info);
  for (std::uint32_t v = 0; v < pack->volumes().size(); ++v) {
    if (pack->isLevel(v)) continue;
    summary.volumes.push_back(summariseVolume(*pack, pack->volumes()[v]));
    for (const format::LevelRecord& level : pack->levelsOf(v)) {
      summary.volumes.back().levels.push_back(summariseLevel(*pack, level));
    }
  }
  for (const format::EffectRecord& effect : pack->effects().effects) {
    summary.effects.push_back(summariseEffect(*pack, effect));
  }
  summary.effectBytes = format::effectBytes(pack->effects());
  summary.effectGpu = format::effectGpuBytes(pack->effects());
  summary.volumeGpuBytes = format::packGpuBytes(pack->gridFrames(), itemCounts(*pack));
  return summary;
}

}  // namespace billow::command
