#include "billow/format/gpu_size.h"

#include <unordered_set>

#include "billow/format/brick.h"

namespace billow::format {
namespace {

// A rank (u16) for each mask word lets a child be found with one popcount.
constexpr std::uint64_t kNode5IndexBytes = sizeof(Node5) + 1024 * sizeof(std::uint16_t);
constexpr std::uint64_t kNode4IndexBytes = sizeof(Node4) + 128 * sizeof(std::uint16_t);

}  // namespace

std::uint64_t GpuBytes::total() const {
  return indexBytes + recordBytes + maskBytes + brickBytes;
}

CellBox cellBox(const GridFrame& gridFrame) {
  CellBox box{};
  for (int axis = 0; axis < 3; ++axis) {
    if (gridFrame.activeMin[axis] > gridFrame.activeMax[axis]) return CellBox{};
    box.min[axis] = static_cast<std::uint32_t>(gridFrame.activeMin[axis]) >> kNode3SpanLog2;
    box.dim[axis] = (static_cast<std::uint32_t>(gridFrame.activeMax[axis]) >> kNode3SpanLog2) - box.min[axis] + 1;
  }
  return box;
}

GpuBytes gpuBytes(const GridFrame& gridFrame) {
  GpuBytes bytes;
  if (gridFrame.node5 == kNone) return bytes;
  bytes.recordBytes = (std::uint64_t{gridFrame.node3Count} + gridFrame.tileCount) * kGpuRecordBytes;
  bytes.maskBytes = std::uint64_t{gridFrame.maskCount} * sizeof(Mask3);
  for (std::uint32_t i = 0; i < kBrickClassCount; ++i) {
    bytes.classBytes[i] = std::uint64_t{gridFrame.brickUnits[i]} * kBrickUnitBytes;
    bytes.brickBytes += bytes.classBytes[i];
  }
  const std::uint64_t payload = bytes.recordBytes + bytes.brickBytes;
  const std::uint64_t flat = cellBox(gridFrame).count() * sizeof(std::uint32_t);
  const std::uint64_t tree = kNode5IndexBytes + gridFrame.node4Count * kNode4IndexBytes +
                             std::uint64_t{gridFrame.childCount} * sizeof(std::uint32_t);
  // A flat table costs one load a sample where the tree costs four, so it may be somewhat larger.
  bytes.index = flat <= tree + payload / 4 ? GpuIndex::flat : GpuIndex::tree;
  bytes.indexBytes = bytes.index == GpuIndex::flat ? flat : tree;
  return bytes;
}

std::uint64_t packGpuBytes(std::span<const GridFrame> gridFrames,
                           const std::array<std::uint64_t, kStreamCount>& stored) {
  const auto items = [&](Stream stream) { return stored[static_cast<std::size_t>(stream)]; };
  std::uint64_t bytes = items(Stream::node3) * kGpuRecordBytes + items(Stream::mask) * sizeof(Mask3) +
                        items(Stream::unit) * kBrickUnitBytes;
  std::unordered_set<std::uint32_t> roots;  // grid frames of one root have one index
  for (const GridFrame& gridFrame : gridFrames) {
    if (gridFrame.node5 == kNone || !roots.insert(gridFrame.node5).second) continue;
    bytes += gpuBytes(gridFrame).indexBytes + gridFrame.tileCount * kGpuRecordBytes;
  }
  return bytes;
}

std::uint64_t EffectGpuBytes::total() const {
  return materials + curves + ramps + maps + surfaces + emitters + given + tracks + particles;
}

EffectGpuBytes effectGpuBytes(const EffectTables& tables) {
  const auto bytesOf = [](const auto& records) { return std::as_bytes(std::span(records)).size(); };
  EffectGpuBytes bytes;
  bytes.materials = bytesOf(tables.materials);
  bytes.curves = bytesOf(tables.curves);
  bytes.ramps = bytesOf(tables.ramps);
  bytes.maps = tables.maps.size() * kGpuCubeBytes;
  bytes.surfaces = bytesOf(tables.surfacePoints);
  bytes.emitters = bytesOf(tables.emitters);
  bytes.given = bytesOf(tables.given);
  const std::uint64_t pointBytes = sizeof(TrackPoint) + (haveRadii(tables.tracks) ? sizeof(float) : 0);
  for (const TrackFrame& frame : tables.trackFrames) bytes.tracks += frame.count * pointBytes;
  for (const EffectRecord& effect : tables.effects) bytes.particles += mostAlive(tables, effect) * sizeof(Particle);
  return bytes;
}

void countBrick(GridFrame& gridFrame, std::uint32_t encoding) {
  if (encoding == kEncodingConstant) return;
  const auto which = static_cast<std::uint32_t>(brickClass(encoding));
  ++gridFrame.brickCount[which];
  gridFrame.brickUnits[which] += brickUnits(encoding);
}

}  // namespace billow::format
