// What can be wrong with a pack: one catalogue for the loader and the validator.
#ifndef BILLOW_FORMAT_ISSUE_H
#define BILLOW_FORMAT_ISSUE_H

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace billow::format {

enum class Severity : std::uint8_t { error, warning };

// Numeric ids are stable and never reused; the hundreds say which part of a pack the rule belongs to.
struct IssueKind {
  std::uint16_t id;
  Severity severity;
  std::string_view name;     // kebab-case
  std::string_view summary;  // one sentence: the rule that is broken
};

// Where in the pack. Whatever is not known is absent.
struct Place {
  std::string_view section = {};             // four letters, or "header", "contents"; a literal
  std::optional<std::uint64_t> offset = {};  // bytes from the start of the file
  std::optional<std::uint32_t> page = {};
  std::optional<std::uint32_t> volume = {};
  std::optional<std::int32_t> frame = {};  // the source's number
  std::optional<std::uint32_t> grid = {};
  std::string_view nodeKind = {};          // "Node5", "Node4", "Node3", "mask", "brick", "child"; a literal
  std::optional<std::uint64_t> node = {};  // global index
};

struct Issue {
  const IssueKind* kind = nullptr;  // points into the catalogue
  Place place;
  std::string detail;  // a sentence: what was found, what was expected
};

// "error 203 page-checksum at PAGE byte 4096 page 3: ..." on one line.
std::string toString(const Issue& issue);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_ISSUE_H
