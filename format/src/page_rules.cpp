#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "billow/format/brick.h"
#include "billow/format/page_unpacker.h"
#include "rules.h"

namespace billow::format {
namespace {

bool finite(float value) {
  return std::isfinite(value);
}

// Where pages are read one by one, and memory is the heap's.
PageUnpacker& unpacker() {
  thread_local PageUnpacker keptByThread(std::pmr::new_delete_resource());
  return keptByThread;
}

// Checks the items of one page, each by itself.
class ItemRules {
 public:
  ItemRules(const Pack& pack, const StreamTotals& totals, const Page& page, IssueSink& sink)
      : pages_(pack.pages()),
        totals_(totals),
        page_(page),
        record_(pages_[page.number]),
        place_(placeOfPage(pack, page.number)),
        sink_(sink) {}

  void checkAll() {
    checkNodes<Node5>(Stream::node5, "Node5");
    checkNodes<Node4>(Stream::node4, "Node4");
    std::uint64_t index = record_.streams[static_cast<std::uint32_t>(Stream::node3)].first;
    for (const Node3& node : itemsOf<Node3>(page_, record_, Stream::node3)) {
      if (sink_.stopped()) return;
      setPlace("Node3", index++);
      checkNode3(node);
    }
  }

 private:
  void setPlace(std::string_view kind, std::uint64_t index) {
    place_.nodeKind = kind;
    place_.node = index;
  }

  // Whether items [first, first + count) of an array exist and lie in one page.
  bool inOnePage(Stream stream, std::uint64_t first, std::uint64_t count) const {
    const auto which = static_cast<std::uint32_t>(stream);
    const auto holds = [&](const StreamRange& run) {
      return first >= run.first && first + count <= std::uint64_t{run.first} + run.count;
    };
    if (holds(record_.streams[which])) return true;
    const auto found =
        std::upper_bound(pages_.begin(), pages_.end(), first, [&](std::uint64_t at, const PageRecord& p) {
          return at < std::uint64_t{p.streams[which].first} + p.streams[which].count;
        });
    return found != pages_.end() && holds(found->streams[which]);
  }

  template <class Node>
  void checkNodes(Stream stream, std::string_view kind) {
    std::uint64_t index = record_.streams[static_cast<std::uint32_t>(stream)].first;
    for (const Node& node : itemsOf<Node>(page_, record_, stream)) {
      if (sink_.stopped()) return;
      setPlace(kind, index++);
      std::uint32_t children = 0;
      for (const std::uint32_t word : node.mask) children += static_cast<std::uint32_t>(std::popcount(word));
      checkNode(node, children, static_cast<std::uint32_t>(std::size(node.mask)) * 32);
    }
  }

  template <class Node>
  void checkNode(const Node& node, std::uint32_t children, std::uint32_t mostChildren) {
    if ((node.flags & ~kNodeTileActive) != 0) {
      sink_.report(Rule::nodeFlags, place_, fmt::format("Its flags are {:#x}.", node.flags));
    }
    if ((node.flags & kNodeTileActive) != 0 && children > 0) {
      sink_.report(Rule::nodeTileActive, place_, fmt::format("It has {} children.", children));
    }
    if (!finite(node.tile) || !finite(node.min) || !finite(node.max) || !finite(node.mean)) {
      sink_.report(Rule::nodeFinite, place_,
                   fmt::format("tile {}, min {}, max {}, mean {}.", node.tile, node.min, node.max, node.mean));
    }
    const bool tile = children == mostChildren || (node.min <= node.tile && node.tile <= node.max);
    if (!(node.min <= node.mean && node.mean <= node.max && tile)) {
      sink_.report(Rule::nodeRange, place_,
                   fmt::format("tile {}, min {}, max {}, mean {}.", node.tile, node.min, node.max, node.mean));
    }
    if (children > 0 && !inOnePage(Stream::child, node.childBegin, children)) {
      sink_.report(Rule::nodeChildren, place_, fmt::format("{} entries at {}.", children, node.childBegin));
    }
  }

  void checkNode3(const Node3& node) {
    const std::uint32_t encoding = encodingOf(node);
    const std::optional<std::uint32_t> bytes = brickBytes(encoding);
    if (!bytes) return sink_.report(Rule::brickEncoding, place_, fmt::format("Encoding {}.", encoding));
    const std::uint32_t units = *bytes / kBrickUnitBytes;
    if (units == 0 ? unitOf(node) != 0 : !inOnePage(Stream::unit, unitOf(node), units)) {
      sink_.report(Rule::brickUnits, place_, fmt::format("{} units at {}.", units, unitOf(node)));
    }
    const bool maskKnown = node.mask == kMaskAll || (node.mask == kMaskTexel && indexBits(encoding) != 0) ||
                           node.mask < totals_.count[static_cast<std::uint32_t>(Stream::mask)];
    if (!maskKnown) {
      sink_.report(Rule::brickMask, place_, fmt::format("Mask {:#x} with encoding {}.", node.mask, encoding));
    }
    checkNode3Values(node, encoding);
  }

  void checkNode3Values(const Node3& node, std::uint32_t encoding) {
    const float high = reconstruct(node.lo, node.scale, largestTexel(encoding));
    const auto values = [&] { return fmt::format("lo {}, scale {}, mean {}.", node.lo, node.scale, node.mean); };
    if (!finite(node.lo) || !finite(node.scale) || !finite(node.mean) || !finite(high)) {
      return sink_.report(Rule::brickFinite, place_, values());
    }
    if (node.scale < 0 || (encoding == kEncodingConstant && node.scale != 0)) {
      sink_.report(Rule::brickScale, place_, values());
    }
  }

  std::span<const PageRecord> pages_;
  const StreamTotals& totals_;
  const Page& page_;
  const PageRecord& record_;
  Place place_;
  IssueSink& sink_;
};

}  // namespace

bool checkListedBytes(std::span<const PageRecord> pages, std::span<const std::uint32_t> list, const Place& place,
                      IssueSink& sink) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 32;
  std::uint64_t bytes = 0;
  for (const std::uint32_t page : list) bytes += page < pages.size() ? pages[page].rawSize : 0;
  if (bytes <= kMost) return true;
  sink.report(Rule::frameLimit, place, fmt::format("Its {} pages unpack to {} bytes.", list.size(), bytes));
  return false;
}

bool loadPage(const Pack& pack, std::uint32_t number, Page& page, IssueSink& sink) {
  if (number >= pack.pages().size()) {
    sink.report(Rule::pageListPage, {}, fmt::format("Page {} of {}.", number, pack.pages().size()));
    return false;
  }
  const PageRecord& record = pack.pages()[number];
  const Place place = placeOfPage(pack, number);
  page.number = number;
  thread_local std::vector<std::byte> storedByThread;
  const bool isRaw = record.codec == static_cast<std::uint32_t>(Codec::raw);
  std::vector<std::byte>& stored = isRaw ? page.raw : storedByThread;
  stored.resize(record.storedSize);
  if (!place.offset || !pack.source().read(*place.offset, stored)) {
    sink.report(Rule::cannotRead, place, fmt::format("{} bytes cannot be read.", stored.size()));
    return false;
  }
  page.raw.resize(record.rawSize);
  const auto done =
      isRaw ? unpacker().checkRaw(pack, number, stored, true) : unpacker().unpack(pack, number, stored, true, page.raw);
  if (!done) sink.report(static_cast<Rule>(done.error().kind->id), place, done.error().detail);
  return done.has_value();
}

bool checkPageItems(const Pack& pack, const StreamTotals& totals, const Page& page, IssueSink& sink) {
  const std::uint64_t before = sink.errors();
  ItemRules(pack, totals, page, sink).checkAll();
  return sink.errors() == before;
}

}  // namespace billow::format
