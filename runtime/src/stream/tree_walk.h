// From a grid's Node5 to its Node3s: nothing that a node refers to is believed.
#ifndef BILLOW_RUNTIME_STREAM_TREE_WALK_H
#define BILLOW_RUNTIME_STREAM_TREE_WALK_H

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "billow/format/issue.h"
#include "billow/format/rule.h"
#include "stream/load_plan.h"
#include "stream/page_items.h"

namespace billow::runtime {

// False as soon as visit(bit) is.
template <class Visit>
bool forEachBit(std::span<const std::uint32_t> words, const Visit& visit) {
  for (std::uint32_t w = 0; w < words.size(); ++w) {
    for (std::uint32_t rest = words[w]; rest != 0; rest &= rest - 1) {
      if (!visit(w * 32 + static_cast<std::uint32_t>(std::countr_zero(rest)))) return false;
    }
  }
  return true;
}

class TreeWalk {
 public:
  struct Node {  // where one lies, for errors
    const char* kind;
    std::uint64_t index;
    std::uint32_t page;
  };
  struct Children {
    std::uint32_t count = 0;
    const std::uint32_t* list = nullptr;  // null without children
  };
  template <class T>
  struct Visited {
    const T* node = nullptr;  // null: it or something of it is missing or wrong
    Node at{};
    std::uint32_t local = 0;  // its number in PageItems
    Children children{};
    bool tile = false;  // active, all of it
  };

  TreeWalk(const LoadRequest& request, const GridPlan& grid, PageItems& items)
      : request_(request), grid_(grid), items_(items) {}

  Visited<format::Node5> root();
  Visited<format::Node4> node4(const Node& parent, std::uint32_t index);
  PageItems::Found node3(const Node& parent, std::uint32_t index) {
    return find(format::Stream::node3, parent, "Node3", index, 1);
  }
  // `count` items that `parent` refers to. Reports what is missing.
  PageItems::Found find(format::Stream stream, const Node& parent, const char* kind, std::uint32_t index,
                        std::uint32_t count) {
    const PageItems::Found found = items_.find(stream, index, count);
    if (found.data == nullptr) failMissing(stream, parent, kind, index);
    return found;
  }

  // Returns false, so that callers can say `return fail(...)`.
  bool fail(format::Rule rule, const Node& at, std::string detail);
  // Of the first that failed.
  const format::Issue& issue() const { return *issue_; }

 private:
  void failMissing(format::Stream stream, const Node& at, const char* kind, std::uint64_t index);
  template <class T>
  bool checkNode(Visited<T>& visited);

  const LoadRequest& request_;
  const GridPlan& grid_;
  PageItems& items_;
  std::uint64_t leaves_ = 0;
  std::optional<format::Issue> issue_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_TREE_WALK_H
