#include "stream/tree_walk.h"

#include <cmath>

namespace billow::runtime {
namespace {

using format::Node4;
using format::Node5;
using format::Rule;
using format::Stream;

// A node that is shared by many parents becomes a leaf for each: a few bytes could ask for 2^27 of them.
constexpr std::uint64_t kMostLeaves = std::uint64_t{1} << 24;

// The rule that says that a stream's item must exist.
Rule existenceOf(Stream stream) {
  switch (stream) {
    case Stream::child:
      return Rule::nodeChildren;
    case Stream::mask:
      return Rule::brickMask;
    case Stream::unit:
      return Rule::brickUnits;
    default:
      return Rule::childIndex;
  }
}

}  // namespace

bool TreeWalk::fail(Rule rule, const Node& at, std::string detail) {
  if (issue_) return false;
  format::Place place = gridPlace(request_, grid_.number);
  const format::Place page = format::placeOfPage(*request_.pack, at.page);
  place.section = page.section;
  place.offset = page.offset;
  place.page = page.page;
  place.nodeKind = at.kind;
  place.node = at.index;
  issue_ = format::makeIssue(rule, place, std::move(detail));
  return false;
}

void TreeWalk::failMissing(Stream stream, const Node& at, const char* kind, std::uint64_t index) {
  // There is a page, for `at` lies in it.
  const format::StreamRange& last = request_.pack->pages().back().streams[static_cast<std::uint32_t>(stream)];
  const std::uint64_t total = std::uint64_t{last.first} + last.count;
  const std::string which = std::string(kind) + " " + std::to_string(index);
  if (index < total) {
    fail(Rule::pageMissing, at, which + " lies in none of the pages that the frame lists, or not in one.");
  } else {
    fail(existenceOf(stream), at, which + " of " + std::to_string(total) + ".");
  }
}

TreeWalk::Visited<Node5> TreeWalk::root() {
  const std::uint32_t index = grid_.frame->node5;
  const PageItems::Found found = items_.find(Stream::node5, index, 1);
  if (found.data == nullptr) {
    format::Place place = gridPlace(request_, grid_.number);
    place.nodeKind = "Node5";
    place.node = index;
    issue_ = format::makeIssue(Rule::pageMissing, place, "It lies in none of the pages that the frame lists.");
    return {};
  }
  Visited<Node5> visited{reinterpret_cast<const Node5*>(found.data), {"Node5", index, found.page}, found.local, {}, {}};
  return checkNode(visited) ? visited : Visited<Node5>{};
}

TreeWalk::Visited<Node4> TreeWalk::node4(const Node& parent, std::uint32_t index) {
  const PageItems::Found found = find(Stream::node4, parent, "Node4", index, 1);
  if (found.data == nullptr) return {};
  Visited<Node4> visited{reinterpret_cast<const Node4*>(found.data), {"Node4", index, found.page}, found.local, {}, {}};
  if (!checkNode(visited)) return {};
  leaves_ += visited.children.count;
  if (leaves_ <= kMostLeaves) return visited;
  fail(Rule::tooManyBricks, visited.at, "With it there are " + std::to_string(leaves_) + " of at most 16777216.");
  return {};
}

template <class T>
bool TreeWalk::checkNode(Visited<T>& visited) {
  const T& node = *visited.node;
  Children& children = visited.children;
  for (const std::uint32_t word : node.mask) children.count += static_cast<std::uint32_t>(std::popcount(word));
  visited.tile = (node.flags & format::kNodeTileActive) != 0;
  if ((node.flags & ~format::kNodeTileActive) != 0) {
    return fail(Rule::nodeFlags, visited.at, "Its flags are " + std::to_string(node.flags) + ".");
  }
  if (visited.tile && children.count > 0) {
    return fail(Rule::nodeTileActive, visited.at, "It has " + std::to_string(children.count) + " children.");
  }
  if (visited.tile && !std::isfinite(node.tile)) {
    return fail(Rule::nodeFinite, visited.at, "Its tile is " + std::to_string(node.tile) + ".");
  }
  if (children.count == 0) return true;
  const PageItems::Found found = find(Stream::child, visited.at, "child list entry", node.childBegin, children.count);
  children.list = reinterpret_cast<const std::uint32_t*>(found.data);
  return found.data != nullptr;
}

}  // namespace billow::runtime
