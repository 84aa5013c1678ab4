// Reading a pack: open() checks header, contents and tables and stops at the first broken rule; pages are read, checked
// and decompressed when asked for. Nothing here trusts the bytes.
#ifndef BILLOW_FORMAT_PACK_H
#define BILLOW_FORMAT_PACK_H

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "billow/format/effect.h"
#include "billow/format/layout.h"
#include "billow/format/result.h"
#include "billow/format/source.h"

namespace billow::format {

// One decompressed page; the spans point into `raw`, whose items are 4-byte aligned.
struct Page {
  std::vector<std::byte> raw;
  std::uint32_t number = 0;

  // Bytes of one stream's run, in Stream order.
  std::span<const std::byte> stream(const PageRecord& record, Stream which) const;
};

class Pack {
 public:
  // Reads header, contents and tables (every section but PAGE and INFO). The pack keeps the source.
  static Result<Pack> open(std::unique_ptr<ByteSource> source);
  static Result<Pack> openFile(const std::string& path);

  std::span<const VolumeRecord> volumes() const { return volumes_; }
  std::span<const GridRecord> grids() const { return grids_; }
  std::span<const FrameRecord> frames() const { return frames_; }
  std::span<const GridFrame> gridFrames() const { return gridFrames_; }
  std::span<const std::uint32_t> pageLists() const { return pageLists_; }
  std::span<const PageRecord> pages() const { return pages_; }
  // Detail levels, by full volume, then finest first. A level's volume stands among volumes() like any other; whoever
  // lists or draws volumes passes over those that isLevel().
  std::span<const LevelRecord> levels() const { return levels_; }
  const EffectTables& effects() const { return effects_; }  // empty where the pack has none
  std::string_view string(StringRef ref) const;
  std::uint64_t fileSize() const;
  const ByteSource& source() const { return *source_; }
  std::span<const SectionEntry> sections() const { return sections_; }

  // Volume-relative access; indices must be in range (they come from the tables above).
  std::span<const GridRecord> gridsOf(const VolumeRecord& volume) const;
  std::span<const FrameRecord> framesOf(const VolumeRecord& volume) const;
  const GridFrame& gridFrame(const VolumeRecord& volume, std::uint32_t frame, std::uint32_t grid) const;
  std::span<const std::uint32_t> pagesOf(const GridFrame& gridFrame) const;

  // Levels of a full volume, finest first; none where it has none, or is a level itself.
  std::span<const LevelRecord> levelsOf(std::uint32_t volume) const;
  // Whether the volume holds a coarser level of another one.
  bool isLevel(std::uint32_t volume) const { return isLevel_[volume]; }
  const LevelError& levelError(const LevelRecord& level, std::uint32_t frame, std::uint32_t grid) const;

  // The INFO section's JSON text, or "" where there is none.
  Result<std::string> infoJson() const;

  // Reads, verifies (stored checksum) and decompresses one page. Thread-safe.
  Result<Page> readPage(std::uint32_t number) const;

 private:
  friend struct PackReader;  // reads the tables: one set of rules for open() and validate
  std::unique_ptr<ByteSource> source_;
  std::vector<SectionEntry> sections_;
  std::string strings_;
  std::vector<VolumeRecord> volumes_;
  std::vector<GridRecord> grids_;
  std::vector<FrameRecord> frames_;
  std::vector<GridFrame> gridFrames_;
  std::vector<std::uint32_t> pageLists_;
  std::vector<PageRecord> pages_;
  std::vector<LevelRecord> levels_;
  std::vector<LevelError> levelErrors_;
  std::vector<bool> isLevel_;  // by volume
  EffectTables effects_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_PACK_H
