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
#include "billow/format/source.h"
#include "billow/format/text.h"

namespace billow::format {

// The ids of the catalogue (issue.cpp). Never renumber: retire an id and leave its line as a comment.
enum class Rule : std::uint16_t {
  cannotOpen = 1,
  cannotRead = 2,
  tooManyBricks = 3,
  tableLimit = 4,
  frameLimit = 5,
  memory = 6,

  tooShort = 101,
  magic = 102,
  headerChecksum = 103,
  majorVersion = 104,
  minorVersion = 105,
  fileSize = 106,
  headerReserved = 107,
  contentsRange = 108,
  contentsChecksum = 109,
  sectionFlags = 110,
  sectionAlignment = 111,
  sectionOrder = 112,
  sectionRange = 113,
  sectionDuplicate = 114,
  sectionMissing = 115,
  sectionUnknown = 116,
  padding = 117,
  paddingLength = 118,
  fileEnd = 119,
  sectionChecksum = 120,

  tableSize = 201,
  stringsUtf8 = 202,
  stringRange = 203,
  nameEmpty = 204,
  nameDuplicate = 205,
  volumeRanges = 206,
  frameRate = 207,
  look = 208,
  gridVolume = 209,
  gridRole = 210,
  gridType = 211,
  frameNumber = 212,
  frameTime = 213,
  frameFlags = 214,
  tableReserved = 215,
  gridFrameFlags = 216,
  transform = 217,
  gridFrameValues = 218,
  gridFrameBox = 219,
  gridFrameOrigin = 220,
  gridFrameEmpty = 221,
  pageListRange = 222,
  pageListOrder = 223,
  pageListPage = 224,
  gridFrameNode5 = 225,
  frameBlank = 226,
  infoUtf8 = 227,
  pageCodec = 230,
  pageSize = 231,
  pageStreams = 232,
  pageOffset = 233,
  streamLength = 234,

  pageChecksum = 301,
  pageDecompress = 302,
  pageMissing = 304,
  pageSuperfluous = 305,
  pageUnused = 306,
  itemUnused = 307,

  nodeChildren = 401,
  nodeFlags = 402,
  nodeFinite = 403,
  nodeRange = 404,
  childIndex = 405,
  nodeConservative = 406,
  nodeTileActive = 407,
  nodeTile = 408,

  brickEncoding = 501,
  brickUnits = 502,
  brickMask = 503,
  brickFinite = 504,
  brickScale = 505,
  brickMean = 506,
  brickOverlap = 507,

  counts = 601,
  activeVoxels = 602,
  activeBox = 603,
  activeBoxLoose = 604,
  valueRange = 605,

  effectRanges = 701,
  effectValues = 702,
  effectAlive = 703,
  emitterValues = 704,
  emitterSpans = 705,
  effectReference = 706,
  materialProfile = 707,
  materialValues = 708,
  effectTable = 709,
  trackRanges = 710,
  trackData = 711,
  givenRanges = 712,
  givenValues = 713,
  emitterSurface = 714,
};

// The catalogue's entry; the id must be in it.
const IssueKind& kindOf(Rule rule);
Issue makeIssue(Rule rule, const Place& place, std::string detail);

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
  const EffectTables* effects;

  // Where byte `byte` of a table lies in the file.
  Place place(std::uint32_t section, std::uint64_t byte) const;
  // The same for a grid frame, with volume, frame and grid as far as the volumes tell.
  Place gridFramePlace(std::uint64_t index) const;
};
// All rules of the tables but those of the page table.
void checkTables(const TableView& tables, IssueSink& sink);
void checkPageTable(const TableView& tables, IssueSink& sink);  // page_table_rules.cpp
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
