// The one set of rules. Each function checks one part of a pack and reports what is wrong to a sink, which decides
// whether to go on: opening a pack stops at the first error, validating it collects all.
//
// A rule function never trusts what an earlier one found wrong: its result says whether the part may be relied upon.
#ifndef BILLOW_FORMAT_SRC_RULES_H
#define BILLOW_FORMAT_SRC_RULES_H

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "billow/format/issue.h"
#include "billow/format/layout.h"
#include "billow/format/pack.h"
#include "billow/format/rule.h"
#include "billow/format/source.h"
#include "billow/format/text.h"

namespace billow::format {

class IssueSink {
 public:
  IssueSink() = default;
  IssueSink(const IssueSink&) = delete;
  IssueSink& operator=(const IssueSink&) = delete;
  virtual ~IssueSink() = default;

  void report(Rule rule, const Place& place, std::string detail);
  // Rule functions leave their loops when this is true.
  bool stopped() const { return stopped_; }
  std::uint64_t errors() const { return errors_; }

 protected:
  virtual bool take(Issue issue) = 0;  // whether to go on

 private:
  bool stopped_ = false;
  std::uint64_t errors_ = 0;
};

// Keeps the first error; warnings pass.
class FirstError : public IssueSink {
 public:
  Issue& issue() { return issue_; }

 private:
  bool take(Issue issue) override;
  Issue issue_;
};

// Keeps all, up to a limit.
class Collector : public IssueSink {
 public:
  explicit Collector(std::size_t limit) : limit_(limit) {}
  std::vector<Issue>& issues() { return issues_; }

 private:
  bool take(Issue issue) override;
  std::size_t limit_;
  std::vector<Issue> issues_;
};

// ---- Header and contents (rules.cpp). False: nothing behind it can be found.
bool checkHeader(const ByteSource& source, FileHeader& header, IssueSink& sink);
bool readContents(const ByteSource& source, const FileHeader& header, std::vector<SectionEntry>& sections,
                  IssueSink& sink);
// Entry by entry; what is wrong is removed from `sections`, so that no later rule reads by it.
void checkContents(const ByteSource& source, std::vector<SectionEntry>& sections, IssueSink& sink);
// Reads the source between the sections.
void checkPadding(const ByteSource& source, const FileHeader& header, std::span<const SectionEntry> sections,
                  IssueSink& sink);
// Reads the section in pieces.
void checkSectionBytes(const ByteSource& source, const SectionEntry& section, IssueSink& sink);
std::string_view sectionName(std::uint32_t type);  // "" when unknown

// ---- Tables (table_rules.cpp): the records against one another.
struct TableView {
  std::span<const SectionEntry> sections;
  std::string_view strings;
  std::span<const VolumeRecord> volumes;
  std::span<const GridRecord> grids;
  std::span<const FrameRecord> frames;
  std::span<const GridFrame> gridFrames;
  std::span<const std::uint32_t> pageLists;
  std::span<const PageRecord> pages;
  std::span<const LevelRecord> levels;
  std::span<const LevelError> levelErrors;
  const EffectTables* effects;

  // Where byte `byte` of a table lies in the file.
  Place place(std::uint32_t section, std::uint64_t byte) const;
  // The same for a grid frame, with volume, frame and grid as far as the volumes tell.
  Place gridFramePlace(std::uint64_t index) const;
};
// All rules of the tables but those of the page table.
void checkTables(const TableView& tables, IssueSink& sink);
void checkPageTable(const TableView& tables, IssueSink& sink);  // page_table_rules.cpp
void checkLevels(const TableView& tables, IssueSink& sink);     // level_rules.cpp
void checkEffects(const TableView& tables, IssueSink& sink);    // effect_rules.cpp
bool checkTracks(const TableView& tables, IssueSink& sink);     // track_rules.cpp; false: frames cannot be found
// Decodes the frames, after checkTracks(). `effects` are those of the view.
void loadTracks(const TableView& tables, EffectTables& effects, IssueSink& sink);
// Whether the name can be used; `seen` are the names that it must differ from, and gets it.
void checkName(const TableView& tables, StringRef ref, const Place& place, std::set<std::string_view>& seen,
               IssueSink& sink);

// Reads what Pack holds. In `pack` are the tables that could be read; false when a rule of header, contents or tables
// is broken.
struct PackReader {
  static bool read(std::unique_ptr<ByteSource> source, Pack& pack, FileHeader& header, IssueSink& sink);
  static TableView view(const Pack& pack);
};

// Items in each global array.
struct StreamTotals {
  std::uint64_t count[kStreamCount] = {};
};
StreamTotals streamTotals(std::span<const PageRecord> pages);

// Whether the pages of a list are no more than this reader holds at once: they compress so well that a small file could
// ask for terabytes.
bool checkListedBytes(std::span<const PageRecord> pages, std::span<const std::uint32_t> list, const Place& place,
                      IssueSink& sink);

// ---- Pages (page_rules.cpp): stored bytes, then each item by itself.
// Reads, verifies and decompresses; false when there is no content to look at.
bool loadPage(const Pack& pack, std::uint32_t number, Page& page, IssueSink& sink);
// Every item of a loaded page by itself; false when one is broken.
bool checkPageItems(const Pack& pack, const StreamTotals& totals, const Page& page, IssueSink& sink);

// A run's items, in place. T must be the stream's item.
template <class T>
std::span<const T> itemsOf(const Page& page, const PageRecord& record, Stream stream) {
  const std::span<const std::byte> bytes = page.stream(record, stream);
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

template <class F>
void forEachBit(std::span<const std::uint32_t> words, const F& visit) {
  for (std::uint32_t w = 0; w < words.size(); ++w) {
    for (std::uint32_t rest = words[w]; rest != 0; rest &= rest - 1) {
      visit(w * 32 + static_cast<std::uint32_t>(std::countr_zero(rest)));
    }
  }
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_RULES_H
