// Writing a pack: append items to the six global arrays in order, close with the tables. Deterministic.
#ifndef BILLOW_FORMAT_WRITER_H
#define BILLOW_FORMAT_WRITER_H

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "billow/format/effect.h"
#include "billow/format/layout.h"

namespace billow::format {

// Everything but the pages.
struct PackTables {
  std::vector<VolumeRecord> volumes;
  std::vector<GridRecord> grids;
  std::vector<FrameRecord> frames;
  std::vector<GridFrame> gridFrames;
  std::vector<std::uint32_t> pageLists;
  std::string strings;
  std::string infoJson;  // "" writes no INFO section
  // Tables without a record write no section.
  std::vector<LevelRecord> levels;
  std::vector<LevelError> levelErrors;
  EffectTables effects;

  StringRef addString(const std::string& text);  // equal strings share
};

// What pages are compressed for: `small`, the fewest bytes (Codec::model, or zstd where that is smaller still), `fast`,
// reading several times as quick (Codec::zstd), or `none`: reading is a copy. Pages that don't shrink are stored raw.
enum class Compression { small, fast, none };

// Writes to a temporary name beside `path`, renamed by commit(); the destructor removes what is unfinished.
// Throws std::system_error (with the path) when the file cannot be written.
class PackWriter {
 public:
  struct Options {
    std::uint32_t pageBytes = 128u << 10;  // raw bytes at which a page is closed
    Compression compression = Compression::small;
    // Whether the tables will have levels, and effects: room is kept for the entries of their sections.
    bool levels = false;
    bool effects = false;
    unsigned threads = 0;  // that compress pages; 0: as many as the machine has, at most 8. The bytes are the same.
  };
  PackWriter(std::string path, Options options);
  PackWriter(const PackWriter&) = delete;
  PackWriter& operator=(const PackWriter&) = delete;
  ~PackWriter();

  // Appends `count` items and returns the global index of the first. All of one call lies in one page, so a call may
  // bring at most kMaxPageBytes (else std::length_error). A brick's units and a node's child list are one call each.
  std::uint32_t append(Stream stream, const void* items, std::uint32_t count);
  // What is appended next begins a page, so that it can be read without what was before.
  void endPage();
  // Items appended so far, by stream.
  std::array<std::uint64_t, kStreamCount> itemCounts() const;
  // The page in which the stream's item lies (or will lie, while its page is open).
  std::uint32_t pageOf(Stream stream, std::uint32_t index) const;

  // Writes tables, contents and header: the file is whole but for its name. Returns its size in bytes. Once, after the
  // last append. `tables` must keep the rules of spec/format.md.
  std::uint64_t close(const PackTables& tables);
  // After close(): flushes and renames.
  void commit();
  void finish(const PackTables& tables) {
    close(tables);
    commit();
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_WRITER_H
