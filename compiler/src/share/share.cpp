#include "share/share.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <map>
#include <memory>
#include <new>
#include <tuple>

#include "billow/format/bfloat16.h"
#include "billow/format/children.h"
#include "billow/format/gpu_size.h"

namespace billow::compiler {
namespace {

using format::Node3;
using format::Node4;
using format::Node5;
using format::Stream;

// What a parent must know of a child.
struct Summary {
  std::uint32_t index;  // global
  float min, max;
  double mean;
};

constexpr std::uint32_t kNode4Children = 1u << (3 * format::kNode4Log2);
constexpr std::uint32_t kNode5Children = 1u << (3 * format::kNode5Log2);

// A tile that is cut up because the grid's origin is not aligned with it may become at most this many small ones.
constexpr std::uint64_t kMaxCutTiles = 1u << 24;

// An older page is read for its equal content where that is at least one part of so many, of the page or of the grid
// frame. So a small frame that hardly changes keeps what stands still, and reads at most so many old pages for it.
constexpr std::uint64_t kLeastUse = 4;

// Equal bytes are one brick only where they mean the same; BC7's axes are told by the Node3.
std::uint32_t meaningOf(const ChosenBrick& brick) {
  return format::isBc7(brick.encoding) ? format::kEncodingBc7Z : brick.encoding;
}

// What a record says of its source: frames of one tree may differ in it.
void setSource(const ImportedGrid& grid, const ChosenGrid& chosen, format::GridFrame& frame) {
  frame.sourceMin = grid.min;
  frame.sourceMax = grid.max;
  frame.squaredError = chosen.squaredError;
  frame.maxError = chosen.maxError;
  std::copy(grid.indexToWorld.begin(), grid.indexToWorld.end(), frame.indexToWorld);
}

void growPages(std::vector<std::uint32_t>& pages, std::uint32_t page) {
  if (pages.empty() || pages.back() != page) pages.push_back(page);
}

}  // namespace

// Builds one grid frame's tree bottom up.
class TreeBuilder {
 public:
  TreeBuilder(Sharer& sharer, const ImportedGrid& grid, const ChosenGrid& chosen, const std::string& where)
      : sharer_(sharer), grid_(grid), chosen_(chosen), where_(where) {}

  format::GridFrame build(std::vector<std::uint32_t>& pages) {
    setConstants();
    if (grid_.leaves.empty() && grid_.tiles.empty()) return frame_;
    setBox();
    addLeaves();
    addTiles();
    if (frame_.node5 == format::kNone) addUpperNodes();
    count();
    std::sort(pages_.begin(), pages_.end());
    pages_.erase(std::unique(pages_.begin(), pages_.end()), pages_.end());
    pages = std::move(pages_);
    return frame_;
  }

 private:
  void setConstants() {
    frame_.node5 = format::kNone;
    frame_.background = grid_.background;
    frame_.valueMin = frame_.valueMax = grid_.background;
    frame_.activeVoxels = grid_.activeVoxels;
    for (int a = 0; a < 3; ++a) frame_.activeMax[a] = -1;
    setSource(grid_, chosen_, frame_);
  }

  void setBox() {
    std::array<std::int64_t, 3> min, max;
    activeBox(grid_, min, max);
    const std::array<std::int32_t, 3> origin = chooseOrigin(min, max, where_);
    for (std::size_t a = 0; a < 3; ++a) {
      frame_.origin[a] = origin[a];
      frame_.activeMin[a] = static_cast<std::int32_t>(min[a] - origin[a]);
      frame_.activeMax[a] = static_cast<std::int32_t>(max[a] - origin[a]);
    }
    placeOrigin(grid_.indexToWorld, frame_);
  }

  std::array<std::uint32_t, 3> packed(const std::array<std::int32_t, 3>& at) const {
    std::array<std::uint32_t, 3> result;
    for (std::size_t a = 0; a < 3; ++a) {
      result[a] = static_cast<std::uint32_t>(std::int64_t{at[a]} - std::int64_t{frame_.origin[a]});
    }
    return result;
  }

  std::uint32_t intern(Stream stream, const void* items, std::uint32_t count, std::uint32_t meaning = 0) {
    const std::uint32_t index = sharer_.intern(stream, items, count, meaning);
    growPages(pages_, sharer_.writer_.pageOf(stream, index));
    return index;
  }

  void put3(const std::array<std::uint32_t, 3>& at, const Summary& summary) {
    const std::uint32_t parent = format::childBit(at, format::kNode5Log2, format::kNode4SpanLog2);
    nodes4_[parent][format::childBit(at, format::kNode4Log2, format::kNode3SpanLog2)] = summary;
  }

  void addLeaves() {
    for (std::size_t i = 0; i < grid_.leaves.size(); ++i) {
      put3(packed(grid_.leaves[i].origin), addLeaf(grid_.leaves[i], chosen_.bricks[i]));
    }
  }

  std::uint32_t internBrick(const ChosenBrick& brick) {
    const auto units = static_cast<std::uint32_t>(brick.payload.size() / format::kBrickUnitBytes);
    return intern(Stream::unit, brick.payload.data(), units, meaningOf(brick));
  }

  Summary addLeaf(const Leaf& leaf, const ChosenBrick& brick) {
    Node3 node{};
    node.lo = brick.lo;
    node.scale = brick.scale;
    const auto payloadBytes = static_cast<std::uint32_t>(brick.payload.size());
    std::uint32_t unit = 0;
    if (payloadBytes != 0) unit = internBrick(brick);
    node.brick = brick.encoding << format::kEncodingShift | unit;
    const bool full = std::all_of(std::begin(leaf.active.words), std::end(leaf.active.words),
                                  [](std::uint32_t word) { return word == ~0u; });
    if (full) {
      node.mask = format::kMaskAll;
    } else if (brick.texelMask) {
      node.mask = format::kMaskTexel;
    } else {
      node.mask = intern(Stream::mask, &leaf.active, 1);
      masks_.push_back(node.mask);
    }
    if (payloadBytes != 0) bricks_.push_back(node.brick);
    format::Mask3 active;
    format::decodeBrick(node, &leaf.active, brick.payload, grid_.background, values_, active);
    return finish3(node);
  }

  // Mean, range and index of a node whose values are in values_.
  Summary finish3(Node3& node) {
    // Independent sums, so that additions overlap; their order is fixed.
    constexpr std::size_t kSums = 8;
    float lows[kSums], highs[kSums];
    double sums[kSums] = {};
    std::copy_n(values_.begin(), kSums, lows);
    std::copy_n(values_.begin(), kSums, highs);
    for (std::size_t i = 0; i < format::kBrickVoxels; i += kSums) {
      for (std::size_t j = 0; j < kSums; ++j) {
        const float value = values_[i + j];
        lows[j] = value < lows[j] ? value : lows[j];
        highs[j] = value > highs[j] ? value : highs[j];
        sums[j] += static_cast<double>(value);
      }
    }
    const float min = *std::min_element(lows, lows + kSums);
    const float max = *std::max_element(highs, highs + kSums);
    const double sum = ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
    const float mean = std::clamp(static_cast<float>(sum / format::kBrickVoxels), min, max);
    // The mean serves drawing from afar; its low bits would be noise on disk.
    const float rounded = format::fromBfloat16(format::toBfloat16(mean));
    node.mean = min <= rounded && rounded <= max ? rounded : mean;
    const std::uint32_t index = intern(Stream::node3, &node, 1);
    nodes3_.push_back(index);
    return {index, min, max, static_cast<double>(node.mean)};
  }

  void addTiles() {
    for (const Tile& tile : grid_.tiles) {
      const std::array<std::uint32_t, 3> at = packed(tile.origin);
      if (tile.dim == format::kIndexSpan) {
        addRootTile(tile);
      } else if (tile.dim == 8) {
        put3(at, addSmallTile(tile.value));
      } else if ((at[0] | at[1] | at[2]) % tile.dim == 0) {
        tiles4_.emplace_back(format::childBit(at, format::kNode5Log2, format::kNode4SpanLog2), tile.value);
      } else {
        cutTile(at, tile);
      }
    }
  }

  Summary addSmallTile(float value) {
    Node3 node{};
    node.brick = format::kEncodingConstant << format::kEncodingShift;
    node.mask = format::kMaskAll;
    node.lo = value;
    values_.fill(value);
    return finish3(node);
  }

  // The origin is aligned to bricks only: a 128^3 tile straddles Node4s and is stored as 8^3 tiles, which all share one
  // Node3.
  void cutTile(const std::array<std::uint32_t, 3>& at, const Tile& tile) {
    const std::uint32_t n = tile.dim / 8;
    cutTiles_ += std::uint64_t{n} * n * n;
    if (cutTiles_ > kMaxCutTiles) {
      throw Error(Fault::input,
                  where_ +
                      ": spans nearly 4096 voxels with large constant tiles that cannot be aligned; move the grid "
                      "by a multiple of 128 voxels, or crop it");
    }
    const Summary summary = addSmallTile(tile.value);
    for (std::uint32_t i = 0; i < n * n * n; ++i) {
      put3({at[0] + i / (n * n) * 8, at[1] + i / n % n * 8, at[2] + i % n * 8}, summary);
    }
  }

  // A root tile fills the index space, so nothing else is there.
  void addRootTile(const Tile& tile) {
    const auto node = std::make_unique<Node5>();
    node->flags = format::kNodeTileActive;
    node->tile = node->min = node->max = node->mean = tile.value;
    frame_.node5 = intern(Stream::node5, node.get(), 1);
    noteTile(tile.value);
    growRange(tile.value, tile.value);
  }

  void growRange(float min, float max) {
    frame_.valueMin = std::min(frame_.valueMin, min);
    frame_.valueMax = std::max(frame_.valueMax, max);
  }

  void addUpperNodes() {
    std::map<std::uint32_t, Summary> children;
    for (const auto& [bit, nodes3] : nodes4_) children[bit] = addNode<Node4>(nodes3, kNode4Children, Stream::node4);
    for (const auto& [bit, value] : tiles4_) children[bit] = addTile4(value);
    for (const auto& [bit, child] : children) nodes4Used_.push_back(child.index);
    const Summary root = addNode<Node5>(children, kNode5Children, Stream::node5);
    frame_.node5 = root.index;
    growRange(root.min, root.max);
  }

  Summary addTile4(float value) {
    Node4 node{};
    node.flags = format::kNodeTileActive;
    node.tile = node.min = node.max = node.mean = value;
    noteTile(value);
    return {intern(Stream::node4, &node, 1), value, value, static_cast<double>(value)};
  }

  void noteTile(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits != std::bit_cast<std::uint32_t>(grid_.background)) tileBits_.push_back(bits);
  }

  template <class Node>
  Summary addNode(const std::map<std::uint32_t, Summary>& children, std::uint32_t slots, Stream stream) {
    const auto node = std::make_unique<Node>();
    node->tile = grid_.background;
    const bool full = children.size() == slots;
    float min = full ? children.begin()->second.min : grid_.background;
    float max = full ? children.begin()->second.max : grid_.background;
    double sum = static_cast<double>(grid_.background) * static_cast<double>(slots - children.size());
    std::vector<std::uint32_t> list;
    list.reserve(children.size());
    for (const auto& [bit, child] : children) {
      node->mask[bit >> 5] |= 1u << (bit & 31);
      list.push_back(child.index);
      min = std::min(min, child.min);
      max = std::max(max, child.max);
      sum += child.mean;
    }
    node->childBegin = intern(Stream::child, list.data(), static_cast<std::uint32_t>(list.size()));
    node->min = min;
    node->max = max;
    node->mean = std::clamp(static_cast<float>(sum / slots), min, max);
    const std::uint32_t index = intern(stream, node.get(), 1);
    lists_.emplace_back(stream == Stream::node5, index, static_cast<std::uint32_t>(list.size()));
    return {index, min, max, static_cast<double>(node->mean)};
  }

  template <class T>
  static std::uint32_t countDistinct(std::vector<T>& items) {
    std::sort(items.begin(), items.end());
    items.erase(std::unique(items.begin(), items.end()), items.end());
    return static_cast<std::uint32_t>(items.size());
  }

  void count() {
    frame_.node3Count = countDistinct(nodes3_);
    frame_.node4Count = countDistinct(nodes4Used_);
    frame_.maskCount = countDistinct(masks_);
    countDistinct(lists_);
    for (const auto& [isRoot, index, children] : lists_) frame_.childCount += children;
    countDistinct(bricks_);
    for (const std::uint32_t brick : bricks_) format::countBrick(frame_, brick >> format::kEncodingShift);
    frame_.tileCount = countDistinct(tileBits_);
  }

  Sharer& sharer_;
  const ImportedGrid& grid_;
  const ChosenGrid& chosen_;
  const std::string& where_;
  format::GridFrame frame_{};
  format::Values values_;
  std::map<std::uint32_t, std::map<std::uint32_t, Summary>> nodes4_;  // by Node5 bit, then Node4 bit
  std::vector<std::pair<std::uint32_t, float>> tiles4_;
  std::vector<std::uint32_t> nodes3_, nodes4Used_, masks_, bricks_, tileBits_, pages_;
  std::vector<std::tuple<bool, std::uint32_t, std::uint32_t>> lists_;  // is Node5, its index, children
  std::uint64_t cutTiles_ = 0;
};

Sharer::Key Sharer::keyOf(Stream stream, const void* bytes, std::size_t size, std::uint32_t meaning) const {
  const XXH64_hash_t seed = static_cast<XXH64_hash_t>(stream) | static_cast<XXH64_hash_t>(meaning) << 8;
  const XXH128_hash_t hash = XXH3_128bits_withSeed(bytes, size, seed);
  return {hash.low64, hash.high64};
}

const std::uint32_t* Sharer::find(const Key& key) const {
  if (const auto at = recent_.find(key); at != recent_.end()) return &at->second;
  const auto old = older_.find(key);
  return old != older_.end() ? &old->second : nullptr;
}

std::uint32_t Sharer::intern(Stream stream, const void* items, std::uint32_t count, std::uint32_t meaning) {
  const std::size_t bytes = std::size_t{count} * format::kStreamItemBytes[static_cast<std::size_t>(stream)];
  const Key key = keyOf(stream, items, bytes, meaning);
  const auto reads = [&](std::uint32_t page) { return page >= openPage_ || pageUses_.contains(page); };
  const std::uint32_t* const known = find(key);
  std::uint32_t index = 0;
  if (known != nullptr && reads(writer_.pageOf(stream, *known))) {
    index = *known;
  } else {
    index = writer_.append(stream, items, count);
    const std::uint32_t page = writer_.pageOf(stream, index);
    if (page >= pageBytes_.size()) pageBytes_.resize(page + 1);
    pageBytes_[page] += static_cast<std::uint32_t>(bytes);
  }
  recent_[key] = index;
  if (recent_.size() >= kGeneration) {
    older_ = std::move(recent_);
    recent_.clear();
  }
  return index;
}

void Sharer::countUse(Stream stream, const void* items, std::size_t bytes, std::uint32_t meaning) {
  const std::uint32_t* const known = find(keyOf(stream, items, bytes, meaning));
  if (known == nullptr) return;
  const std::uint32_t page = writer_.pageOf(stream, *known);
  if (page < openPage_) pageUses_[page] += bytes;
}

void Sharer::beginGrid(const ImportedGrid& grid, std::span<const ChosenBrick> bricks) {
  openPage_ = pageBytes_.empty() ? 0 : static_cast<std::uint32_t>(pageBytes_.size() - 1);
  pageUses_.clear();
  std::uint64_t bytes = grid.leaves.size() * sizeof(format::Mask3);
  for (const Leaf& leaf : grid.leaves) countUse(Stream::mask, &leaf.active, sizeof leaf.active, 0);
  for (const ChosenBrick& brick : bricks) {
    bytes += brick.payload.size();
    countUse(Stream::unit, brick.payload.data(), brick.payload.size(), meaningOf(brick));
  }
  std::erase_if(pageUses_, [&](const auto& use) {
    return use.second < std::min<std::uint64_t>(bytes, pageBytes_[use.first]) / kLeastUse;
  });
}

// Of all that a grid frame's tree is made from.
Sharer::Key Sharer::contentOf(const ImportedGrid& grid, std::span<const ChosenBrick> bricks) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  const auto add = [&](const auto& value) { XXH3_128bits_update(state.get(), &value, sizeof value); };
  add(grid.background);
  for (const Leaf& leaf : grid.leaves) {
    add(leaf.origin);
    add(leaf.active);
  }
  for (const ChosenBrick& brick : bricks) {
    add(brick.encoding);
    add(brick.texelMask);
    add(brick.lo);
    add(brick.scale);
    XXH3_128bits_update(state.get(), brick.payload.data(), brick.payload.size());
  }
  for (const Tile& tile : grid.tiles) {
    add(tile.origin);
    add(tile.dim);
    add(tile.value);
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return {hash.low64, hash.high64};
}

format::GridFrame Sharer::addGrid(const ImportedGrid& grid, const ChosenGrid& chosen, const std::string& where,
                                  std::vector<std::uint32_t>& pages) {
  const auto [tree, isNew] = trees_.try_emplace(contentOf(grid, chosen.bricks));
  if (isNew) {
    beginGrid(grid, chosen.bricks);
    tree->second.frame = TreeBuilder(*this, grid, chosen, where).build(tree->second.pages);
  }
  pages = tree->second.pages;
  format::GridFrame frame = tree->second.frame;
  setSource(grid, chosen, frame);
  if (frame.node5 != format::kNone) placeOrigin(grid.indexToWorld, frame);
  return frame;
}

}  // namespace billow::compiler
