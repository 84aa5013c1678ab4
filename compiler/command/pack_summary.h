// What `billow info` says of a pack, gathered before it is printed as text or JSON.
#ifndef BILLOW_COMMAND_PACK_SUMMARY_H
#define BILLOW_COMMAND_PACK_SUMMARY_H

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "billow/format/gpu_size.h"
#include "billow/format/pack.h"

namespace billow::command {

struct GridFrameSummary {
  std::int32_t frame = 0;  // the source's number
  bool present = false;
  std::uint64_t activeVoxels = 0;
  std::optional<double> psnr;  // decibels; absent where the reconstruction is exact or nothing is active
  double maxError = 0;
  double sourceMin = 0, sourceMax = 0;
  std::uint64_t bricks = 0;  // Node3s, constants included
  format::GpuBytes gpu;
  // Of a level, drawn in the full volume's place, against its source; absent where exact, as above.
  std::optional<double> levelPsnr;
  double levelMaxError = 0;
};

struct GridSummary {
  std::string name;
  std::string role;
  std::string sourceType;
  std::vector<GridFrameSummary> frames;
};

struct VolumeSummary {
  std::string name;
  double framesPerSecond = 0;
  std::vector<format::FrameRecord> frames;
  std::vector<GridSummary> grids;
  std::uint32_t level = 0;  // its voxels are 2^level times as long as those of the volume that it is a level of
  std::vector<VolumeSummary> levels;
};

struct EmitterSummary {
  std::string name;
  std::uint64_t born = 0;  // in one run of the effect
  std::uint64_t mostAlive = 0;
};

struct EffectSummary {
  std::string name;
  double duration = 0;  // seconds
  bool loop = false;
  std::uint64_t mostAlive = 0;
  std::vector<EmitterSummary> emitters;
};

struct PackSummary {
  std::string path;
  std::uint64_t fileBytes = 0;
  std::uint64_t tableBytes = 0;  // header, contents, tables, padding
  std::uint64_t storedPageBytes = 0;
  std::uint64_t rawPageBytes = 0;
  std::uint64_t pageCount = 0;
  std::array<std::uint64_t, format::kStreamCount> rawByStream{};
  std::array<std::uint64_t, 3> pagesByCodec{};
  std::array<std::uint64_t, format::kEncodingCount> encodings{};  // stored Node3s by encoding
  std::string infoJson;
  std::vector<VolumeSummary> volumes;
  std::vector<EffectSummary> effects;
  std::uint64_t effectBytes = 0;  // of all tables of effects; part of tableBytes
  format::EffectGpuBytes effectGpu;
  std::uint64_t volumeGpuBytes = 0;  // of all frames and grids, what they share counted once
  std::uint64_t gpuBytes() const { return volumeGpuBytes + effectGpu.total(); }
};

// Reads every page, to count encodings.
format::Result<PackSummary> summarise(const std::string& path);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_PACK_SUMMARY_H
