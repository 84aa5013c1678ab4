// Small packs for tests, built with PackWriter: any bricks at any cells.
#ifndef BILLOW_TESTS_SAMPLE_PACK_H
#define BILLOW_TESTS_SAMPLE_PACK_H

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "billow/format/brick.h"
#include "billow/format/children.h"
#include "billow/format/gpu_size.h"
#include "billow/format/writer.h"

namespace billow::tests {

inline std::vector<std::byte> randomBytes(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() & 0xff);
  return bytes;
}

// One grid in one frame, built brick by brick. Bricks that are added twice by number are shared.
class GridFrameBuilder {
 public:
  GridFrameBuilder(format::PackWriter& writer, float background) : writer_(writer) {
    frame_.flags = format::kGridPresent;
    frame_.background = frame_.valueMin = frame_.valueMax = background;
    frame_.node5 = format::kNone;
    for (int axis = 0; axis < 3; ++axis) {
      frame_.activeMin[axis] = format::kIndexSpan;
      frame_.activeMax[axis] = -1;
      frame_.indexToWorld[5 * axis] = 0.1;
    }
  }

  // A brick at a cell of 8^3 voxels. `mask` is used where node.mask is 0; brick unit, mask and mean are filled in.
  void brick(std::array<std::uint32_t, 3> cell, std::uint32_t encoding, std::span<const std::byte> bytes, float lo,
             float scale, std::uint32_t maskWord, const format::Mask3& mask = {}) {
    format::Node3 node{};
    node.lo = lo;
    node.scale = scale;
    node.brick = encoding << format::kEncodingShift;
    if (!bytes.empty()) {
      node.brick |= add(format::Stream::unit, bytes.data(), format::brickUnits(encoding));
      format::countBrick(frame_, encoding);
    }
    node.mask = maskWord;
    if (maskWord == 0) {
      node.mask = add(format::Stream::mask, &mask, 1);
      ++frame_.maskCount;
    }
    format::Values values;
    format::Mask3 active;
    format::decodeBrick(node, &mask, bytes, frame_.background, values, active);
    place(cell, finish(node, values), active);
  }

  // A Node4 that is one active tile; `at` counts 128 voxels.
  void tile(std::array<std::uint32_t, 3> at, float value) {
    format::Node4 node{};
    node.flags = format::kNodeTileActive;
    node.tile = node.min = node.max = node.mean = value;
    const std::uint32_t index = add(format::Stream::node4, &node, 1);
    ++frame_.node4Count;
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits != std::bit_cast<std::uint32_t>(frame_.background)) tileBits_.insert(bits);
    frame_.tileCount = static_cast<std::uint32_t>(tileBits_.size());
    frame_.activeVoxels += 128 * 128 * 128;
    for (int axis = 0; axis < 3; ++axis) {
      const auto low = static_cast<std::int32_t>(at[static_cast<std::size_t>(axis)] * 128);
      frame_.activeMin[axis] = std::min(frame_.activeMin[axis], low);
      frame_.activeMax[axis] = std::max(frame_.activeMax[axis], low + 127);
    }
    tiles_[at[0] << 10 | at[1] << 5 | at[2]] = {index, value, value, value};
  }

  format::GridFrame finish(format::PackTables& tables) {
    frame_.sourceMin = frame_.valueMin;
    frame_.sourceMax = frame_.valueMax;
    std::map<std::uint32_t, Child> children = tiles_;
    for (const auto& [bit, bricks] : nodes_) {
      children[bit] = upper<format::Node4>(bricks, format::Stream::node4);
      ++frame_.node4Count;
    }
    const Child root = upper<format::Node5>(children, format::Stream::node5);
    frame_.node5 = root.index;
    frame_.valueMin = frame_.sourceMin = std::min(root.min, frame_.background);
    frame_.valueMax = frame_.sourceMax = std::max(root.max, frame_.background);
    frame_.pageListBegin = static_cast<std::uint32_t>(tables.pageLists.size());
    frame_.pageListCount = static_cast<std::uint32_t>(pages_.size());
    tables.pageLists.insert(tables.pageLists.end(), pages_.begin(), pages_.end());
    return frame_;
  }

 private:
  struct Child {
    std::uint32_t index;
    float min, max, mean;
  };

  std::uint32_t add(format::Stream stream, const void* items, std::uint32_t count) {
    const std::uint32_t index = writer_.append(stream, items, count);
    pages_.insert(writer_.pageOf(stream, index));
    return index;
  }

  Child finish(format::Node3& node, const format::Values& values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    double sum = 0;
    for (const float value : values) sum += static_cast<double>(value);
    node.mean = std::clamp(static_cast<float>(sum / format::kBrickVoxels), *low, *high);
    ++frame_.node3Count;
    return {add(format::Stream::node3, &node, 1), *low, *high, node.mean};
  }

  void place(std::array<std::uint32_t, 3> cell, const Child& child, const format::Mask3& active) {
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (!format::maskBit(active, i)) continue;
      ++frame_.activeVoxels;
      const std::uint32_t voxel[3] = {cell[0] * 8 + (i >> 6), cell[1] * 8 + (i >> 3 & 7), cell[2] * 8 + (i & 7)};
      for (int axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<std::int32_t>(voxel[axis]);
        frame_.activeMin[axis] = std::min(frame_.activeMin[axis], at);
        frame_.activeMax[axis] = std::max(frame_.activeMax[axis], at);
      }
    }
    const std::array<std::uint32_t, 3> at{cell[0] * 8, cell[1] * 8, cell[2] * 8};
    nodes_[format::childBit(at, format::kNode5Log2, format::kNode4SpanLog2)]
          [format::childBit(at, format::kNode4Log2, format::kNode3SpanLog2)] = child;
  }

  template <class Node>
  Child upper(const std::map<std::uint32_t, Child>& children, format::Stream stream) {
    const auto node = std::make_unique<Node>();
    node->tile = node->min = node->max = frame_.background;
    if (children.size() == std::size(node->mask) * 32) node->min = node->max = children.begin()->second.min;
    std::vector<std::uint32_t> list;
    for (const auto& [bit, child] : children) {
      node->mask[bit >> 5] |= 1u << (bit & 31);
      node->min = std::min(node->min, child.min);
      node->max = std::max(node->max, child.max);
      list.push_back(child.index);
    }
    node->mean = std::clamp(children.empty() ? frame_.background : children.begin()->second.mean, node->min, node->max);
    node->childBegin = add(format::Stream::child, list.data(), static_cast<std::uint32_t>(list.size()));
    frame_.childCount += static_cast<std::uint32_t>(list.size());
    return {add(stream, node.get(), 1), node->min, node->max, node->mean};
  }

  format::PackWriter& writer_;
  format::GridFrame frame_{};
  std::map<std::uint32_t, std::map<std::uint32_t, Child>> nodes_;
  std::map<std::uint32_t, Child> tiles_;
  std::set<std::uint32_t> tileBits_;
  std::set<std::uint32_t> pages_;
};

// Tables of one volume; grid frames are still to be added, frame by frame.
inline format::PackTables sampleTables(const std::string& volume, const std::vector<std::string>& grids,
                                       std::uint32_t frames) {
  format::PackTables tables;
  format::VolumeRecord record{};
  record.name = tables.addString(volume);
  record.gridCount = static_cast<std::uint32_t>(grids.size());
  record.frameCount = frames;
  record.framesPerSecond = 24;
  tables.volumes.push_back(record);
  for (const std::string& name : grids) {
    format::GridRecord grid{};
    grid.name = tables.addString(name);
    grid.role = static_cast<std::uint32_t>(name == "density" ? format::Role::extinction : format::Role::flames);
    grid.component = format::kNone;
    tables.grids.push_back(grid);
  }
  for (std::uint32_t i = 0; i < frames; ++i) tables.frames.push_back({static_cast<std::int32_t>(i) + 7, 0, i / 24.0});
  return tables;
}

// What a frame holds that lacks the grid.
inline format::GridFrame absentGridFrame() {
  format::GridFrame frame{};
  frame.node5 = format::kNone;
  for (int axis = 0; axis < 3; ++axis) {
    frame.activeMax[axis] = -1;
    frame.indexToWorld[5 * axis] = 1;
  }
  return frame;
}

// Writes a pack by way of a file in the folder for temporary files, and gives its bytes.
template <class Fill>
std::vector<std::byte> writePack(format::PackWriter::Options options, const Fill& fill) {
  std::string folder = (std::filesystem::temp_directory_path() / "billow_pack_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return {};
  const std::string path = folder + "/sample.blw";
  {
    format::PackWriter writer(path, options);
    writer.finish(fill(writer));
  }
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::filesystem::remove_all(folder);
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

// One volume, one grid, one frame, nothing active.
inline std::vector<std::byte> smallestPack() {
  return writePack({}, [](format::PackWriter&) {
    format::PackTables tables = sampleTables("v", {"density"}, 1);
    tables.gridFrames.push_back(absentGridFrame());
    return tables;
  });
}

// Two grids, two frames: every encoding class, every kind of mask, a tile, an absent grid, look defaults and INFO.
inline std::vector<std::byte> samplePack(format::PackWriter::Options options = {}) {
  using namespace format;
  return writePack(options, [](PackWriter& writer) {
    PackTables tables = sampleTables("cloud", {"density", "flames"}, 2);
    tables.volumes[0].look.set = 5;
    tables.volumes[0].look.extinctionScale = 2;
    tables.volumes[0].look.anisotropy = 0.5f;
    tables.infoJson = "{\"generator\": \"test\"}";
    Mask3 half{};
    std::fill_n(half.words, 8, 0x0ff0f00fu);
    GridFrameBuilder first(writer, 0);
    first.brick({2, 3, 4}, kEncodingBc7Y, randomBytes(128, 1), 0.25f, 0.001f, 0, half);
    first.brick({2, 3, 5}, kEncodingCoarse, randomBytes(64, 2), -1, 0.0002f, kMaskAll);
    first.brick({2, 3, 6}, uniformEncoding(3), randomBytes(192, 3), 0, 0.5f, kMaskTexel);
    first.brick({40, 3, 4}, kEncodingUniform16, randomBytes(1024, 4), 1, 0.0001f, 0, half);
    first.brick({2, 3, 7}, kEncodingConstant, {}, 3, 0, kMaskAll);
    first.brick({2, 3, 8}, localEncoding(4), randomBytes(288, 6), 0, 0.001f, kMaskTexel);
    first.brick({2, 3, 9}, uniformEncoding(8), randomBytes(512, 7), 0, 0.1f, kMaskAll);
    first.tile({4, 0, 1}, 0.5f);
    tables.gridFrames.push_back(first.finish(tables));
    tables.gridFrames.push_back(absentGridFrame());
    GridFrameBuilder second(writer, 0.125f);
    second.brick({500, 501, 502}, kEncodingConstant, {}, 2, 0, kMaskAll);
    tables.gridFrames.push_back(second.finish(tables));
    GridFrameBuilder third(writer, 0);
    third.brick({1, 1, 1}, kEncodingBc7Z, randomBytes(128, 5), 0.25f, 0.001f, kMaskAll);
    tables.gridFrames.push_back(third.finish(tables));
    return tables;
  });
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SAMPLE_PACK_H
