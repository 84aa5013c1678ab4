// Pages like those of packs, for tests and benchmarks of the page codec: smooth bricks with noise, under blob masks.
#ifndef BILLOW_TESTS_PAGE_BUILDER_H
#define BILLOW_TESTS_PAGE_BUILDER_H

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "billow/format/brick.h"

namespace billow::tests {

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

class PageBuilder {
 public:
  struct Page {
    std::array<format::StreamRange, format::kStreamCount> runs{};
    std::vector<std::byte> bytes;

    format::Node3 node3(std::size_t number) const {
      format::Node3 node;
      std::memcpy(&node, bytes.data() + node3At(number), sizeof node);
      return node;
    }
    void setNode3(std::size_t number, const format::Node3& node) {
      std::memcpy(bytes.data() + node3At(number), &node, sizeof node);
    }

   private:
    std::size_t node3At(std::size_t number) const {
      std::size_t at = number * sizeof(format::Node3);
      for (std::size_t i = 0; i < 4; ++i) at += std::size_t{runs[i].count} * format::kStreamItemBytes[i];
      return at;
    }
  };

  explicit PageBuilder(std::uint32_t seed) : random_(seed) {
    for (std::uint32_t i = 0; i < format::kStreamCount; ++i) page_.runs[i].first = 1000 * i;
  }

  // A brick with its Node3 and, where `mask` is 0, a mask. `loud`: inactive voxels have indices and ends too.
  void brick(std::uint32_t encoding, std::uint32_t mask, bool loud = false) {
    drawField();
    format::Mask3 active{};
    if (mask == format::kMaskAll) std::fill(std::begin(active.words), std::end(active.words), ~0u);
    for (std::uint32_t i = 0; i < format::kBrickVoxels && mask != format::kMaskAll; ++i) {
      if (field_[i] > 0.35) active.words[i >> 5] |= 1u << (i & 31);
    }
    format::Node3 node{};
    node.brick = encoding << format::kEncodingShift;
    const std::vector<std::byte> payload = payloadOf(encoding, active, loud, mask == format::kMaskTexel);
    if (!payload.empty()) node.brick |= append(format::Stream::unit, payload.data(), payload.size());
    node.mask = mask == 0 ? append(format::Stream::mask, &active, sizeof active) : mask;
    node.lo = std::ldexp(static_cast<float>(random_() % 4096), -12);
    node.scale =
        encoding == format::kEncodingConstant ? 0 : std::ldexp(static_cast<float>(2048 + random_() % 2048), -18);
    node.mean = node.lo;
    children_.push_back(append(format::Stream::node3, &node, sizeof node));
  }

  // A Node4 over the bricks so far, and a Node5.
  void upperNodes() {
    format::Node4 node{};
    node.childBegin = append(format::Stream::child, children_.data(), 4 * children_.size());
    for (std::uint32_t i = 0; i < children_.size(); ++i) node.mask[i >> 3 & 127] |= 1u << (i & 7) << (random_() % 3);
    node.max = 1;
    node.mean = 0.125;
    format::Node5 root{};
    const std::uint32_t index = append(format::Stream::node4, &node, sizeof node);
    root.childBegin = append(format::Stream::child, &index, sizeof index);
    root.mask[17] = 1;
    append(format::Stream::node5, &root, sizeof root);
  }

  Page page() const {
    Page page = page_;
    for (const auto& stream : streams_) page.bytes.insert(page.bytes.end(), stream.begin(), stream.end());
    return page;
  }

 private:
  std::uint32_t append(format::Stream stream, const void* bytes, std::size_t size) {
    const auto which = static_cast<std::size_t>(stream);
    const auto* first = static_cast<const std::byte*>(bytes);
    streams_[which].insert(streams_[which].end(), first, first + size);
    const auto count = static_cast<std::uint32_t>(size / format::kStreamItemBytes[which]);
    page_.runs[which].count += count;
    return page_.runs[which].first + page_.runs[which].count - count;
  }

  // A slope and a bump in [0, 1], with noise.
  void drawField() {
    const auto draw = [&] { return static_cast<double>(random_() % 1024) / 1024; };
    const double slope[3] = {draw() - 0.5, draw() - 0.5, draw() - 0.5};
    const double centre[3] = {8 * draw(), 8 * draw(), 8 * draw()};
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      const double at[3] = {static_cast<double>(i >> 6), static_cast<double>(i >> 3 & 7), static_cast<double>(i & 7)};
      double value = 0.5;
      double apart = 0;
      for (int axis = 0; axis < 3; ++axis) {
        value += slope[axis] * (at[axis] - 3.5) / 8;
        apart += (at[axis] - centre[axis]) * (at[axis] - centre[axis]);
      }
      field_[i] = std::clamp(value + 0.4 / (1 + apart / 8) - 0.2 + 0.03 * draw(), 0.0, 1.0);
    }
  }

  std::vector<std::byte> payloadOf(std::uint32_t encoding, const format::Mask3& active, bool loud, bool byTexel) {
    std::vector<std::byte> payload(*format::brickBytes(encoding));
    const std::uint32_t bits = format::indexBits(encoding);
    if (bits == 0) {
      for (std::byte& byte : payload) byte = static_cast<std::byte>(random_());
      for (std::size_t block = 0; block < payload.size(); block += 16) {  // all modes of BC7, the reserved one too
        payload[block] = static_cast<std::byte>((random_() & 0xff) << (block / 16 + random_() % 2));
      }
      return payload;
    }
    const bool local = format::isLocal(encoding);
    std::array<bool, format::kLocalCells> used{};
    format::Texels indices;
    const double most = static_cast<double>((1u << bits) - 1);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      const bool on = loud || format::maskBit(active, i);
      indices[i] = on ? static_cast<std::uint16_t>(std::max(field_[i] * most, byTexel ? 1.0 : 0.0)) : std::uint16_t{0};
      if (on && (indices[i] != 0 || !byTexel)) used[format::localCell(i >> 6, i >> 3 & 7, i & 7)] = true;
    }
    for (std::uint32_t cell = 0; local && cell < format::kLocalCells; ++cell) {
      if (!used[cell]) continue;
      payload[2 * cell] = static_cast<std::byte>(20 + random_() % 16);
      payload[2 * cell + 1] = static_cast<std::byte>(random_() % 8 == 0 ? 20 : 120 + random_() % 32);
    }
    format::packIndices(indices, bits, payload.data() + (local ? format::kLocalCellBytes : 0));
    return payload;
  }

  Random random_;
  Page page_;
  std::array<std::vector<std::byte>, format::kStreamCount> streams_;
  std::vector<std::uint32_t> children_;
  std::array<double, format::kBrickVoxels> field_{};
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_PAGE_BUILDER_H
