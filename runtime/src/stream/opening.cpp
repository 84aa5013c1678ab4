#include "opening.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "api.h"
#include "billow/format/source.h"
#include "checks.h"
#include "detail.h"
#include "players.h"

namespace billow::runtime {
namespace {

struct Piece {
  std::uint64_t offset = 0;
  std::vector<std::byte> bytes;
};

// What was read of a host's source before the pack is opened. Pages are read by the transport.
class PieceSource final : public format::ByteSource {
 public:
  PieceSource(std::uint64_t size, std::vector<Piece> pieces) : size_(size), pieces_(std::move(pieces)) {}
  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    for (const Piece& piece : pieces_) {
      if (offset < piece.offset || offset - piece.offset > piece.bytes.size()) continue;
      if (into.size() > piece.bytes.size() - (offset - piece.offset)) continue;
      if (!into.empty()) std::memcpy(into.data(), piece.bytes.data() + (offset - piece.offset), into.size());
      return true;
    }
    return false;
  }

 private:
  std::uint64_t size_;
  std::vector<Piece> pieces_;
};

constexpr std::uint64_t kLargestTable = std::uint64_t{1} << 30;  // larger ones are refused unread

// Ranges of the tables, from a header and contents that nobody has checked yet: only those that lie in the file.
std::vector<std::pair<std::uint64_t, std::uint64_t>> tableRanges(std::span<const std::byte> contents,
                                                                 std::uint64_t size) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  for (std::size_t at = 0; at + sizeof(format::SectionEntry) <= contents.size(); at += sizeof(format::SectionEntry)) {
    format::SectionEntry entry;
    std::memcpy(&entry, contents.data() + at, sizeof entry);
    if (entry.type == format::kSectionPages || entry.size > kLargestTable) continue;
    if (entry.offset > size || entry.size > size - entry.offset) continue;
    ranges.emplace_back(entry.offset, entry.size);
  }
  return ranges;
}

// Bytes of contents that follow the header, 0 where it lists none that can be.
std::uint64_t contentsBytes(std::span<const std::byte> bytes, std::uint64_t size) {
  format::FileHeader header;
  if (bytes.size() < sizeof header) return 0;
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::uint64_t wanted = std::uint64_t{header.sectionCount} * sizeof(format::SectionEntry);
  return header.sectionCount <= format::kMaxSections && wanted <= size - sizeof header ? wanted : 0;
}

std::uint64_t sum(const std::vector<std::pair<std::uint64_t, std::uint64_t>>& ranges) {
  std::uint64_t bytes = 0;
  for (const auto& range : ranges) bytes += range.second;
  return bytes;
}

Error packError(const format::Issue& issue) {
  return {.code = ErrorCode::pack, .message = toString(issue), .issue = issue};
}

tl::unexpected<Error> tooLarge(std::uint64_t bytes) {
  return failure(ErrorCode::budget,
                 "the pack's tables of " + std::to_string(bytes) + " bytes do not fit into the CPU budget");
}

std::uint64_t bookkeepingBytes(const std::vector<std::shared_ptr<const Clip>>& clips) {
  std::uint64_t bytes = 0;
  for (const auto& clip : clips) {
    if (clip != nullptr) bytes += bookkeepingBytes(*clip);
  }
  return bytes;
}

// Gives back what it holds unless it was kept.
class Held {
 public:
  explicit Held(Reserve reserve) : reserve_(reserve) {}
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() { reserve_.giveBack(bytes_); }
  bool more(std::uint64_t bytes) {
    if (!reserve_(bytes)) return false;
    bytes_ += bytes;
    return true;
  }
  void less(std::uint64_t bytes) {
    reserve_.giveBack(bytes);
    bytes_ -= bytes;
  }
  std::uint64_t keep() { return std::exchange(bytes_, 0); }

 private:
  Reserve reserve_;
  std::uint64_t bytes_ = 0;
};

// What is the same for files and sources once the tables can be read. `held` has their bytes.
Result<Opened> finish(format::Pack pack, std::shared_ptr<AsyncSource> source, AssetId asset, Held& held) {
  const std::size_t words = (pack.pages().size() + 31) / 32;
  Opened opened;
  opened.pack = std::make_shared<OpenPack>(
      OpenPack{std::move(pack), std::move(source), std::vector<std::atomic<std::uint32_t>>(words)});
  opened.clips = makeClips(opened.pack, asset);
  const std::uint64_t more = bookkeepingBytes(opened.clips) + words * 4;
  if (!held.more(more)) return tooLarge(more);
  opened.bytes = held.keep();
  return opened;
}

class TableReaderImpl final : public TableReader, public std::enable_shared_from_this<TableReaderImpl> {
 public:
  TableReaderImpl(std::shared_ptr<AsyncSource> source, AssetId asset, Reserve reserve, ReadsInFlight& inFlight,
                  std::function<void()> done)
      : source_(std::move(source)), asset_(asset), held_(reserve), inFlight_(inFlight), done_(std::move(done)) {}

  void start() override {
    size_ = source_->size();
    read(0, std::min<std::uint64_t>(size_, sizeof(format::FileHeader)));
  }

  Result<Opened> open() override {
    return guarded<Opened>([&]() -> Result<Opened> {
      if (failed_) return failure(ErrorCode::pack, "the pack's tables cannot be read");
      if (tooLarge_ != 0) return tooLarge(tooLarge_);
      auto pack = format::Pack::open(std::make_unique<PieceSource>(size_, std::move(pieces_)));
      if (!pack) return tl::unexpected(packError(pack.error()));
      return finish(std::move(*pack), source_, asset_, held_);
    });
  }

 private:
  void read(std::uint64_t offset, std::uint64_t bytes) {
    try {
      pieces_.push_back({offset, std::vector<std::byte>(bytes)});
    } catch (const std::bad_alloc&) {
      failed_ = true;
      return done_();
    }
    inFlight_.add();
    source_->read(offset, pieces_.back().bytes,
                  {.call =
                       [](void* context, bool success) {
                         // Who is told of the end may let go of the reader before this returns.
                         auto self = static_cast<TableReaderImpl*>(context)->shared_from_this();
                         ReadsInFlight& inFlight = self->inFlight_;
                         self->came(success);
                         self.reset();
                         inFlight.remove();
                       },
                   .context = this});
  }

  void came(bool success) {
    if (!success) {
      failed_ = true;
      return done_();
    }
    if (pieces_.size() == 1) {
      const std::uint64_t bytes = contentsBytes(pieces_[0].bytes, size_);
      return bytes > 0 ? read(sizeof(format::FileHeader), bytes) : done_();
    }
    if (pieces_.size() == 2) {
      ranges_ = tableRanges(pieces_[1].bytes, size_);
      // As they are read and as the pack keeps them.
      const std::uint64_t bytes = 2 * sum(ranges_);
      if (!held_.more(bytes)) {
        tooLarge_ = bytes;
        return done_();
      }
    }
    const std::size_t next = pieces_.size() - 2;
    return next < ranges_.size() ? read(ranges_[next].first, ranges_[next].second) : done_();
  }

  std::shared_ptr<AsyncSource> source_;
  AssetId asset_;
  Held held_;
  ReadsInFlight& inFlight_;
  std::function<void()> done_;
  std::uint64_t size_ = 0;
  std::vector<Piece> pieces_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges_;
  bool failed_ = false;
  std::uint64_t tooLarge_ = 0;
};

}  // namespace

std::uint64_t bookkeepingBytes(const Clip& clip) {
  return clip.items() * (sizeof(PlannedItem) + sizeof(Track::Slot)) + clip.frames() * 24ull;
}

Result<Opened> openFile(const std::string& path, AssetId asset, Reserve reserve) {
  return guarded<Opened>([&]() -> Result<Opened> {
    auto source = format::openFileSource(path);
    if (!source) return tl::unexpected(packError(source.error()));
    const std::uint64_t size = (*source)->size();
    std::vector<std::byte> head(std::min<std::uint64_t>(size, sizeof(format::FileHeader)));
    std::vector<std::byte> contents;
    if ((*source)->read(0, head)) contents.resize(contentsBytes(head, size));
    if (!contents.empty() && !(*source)->read(sizeof(format::FileHeader), contents)) contents.clear();
    const std::uint64_t bytes = sum(tableRanges(contents, size));
    Held held(reserve);
    if (!held.more(bytes)) return tooLarge(bytes);
    auto pack = format::Pack::open(std::move(*source));
    if (!pack) return tl::unexpected(packError(pack.error()));
    return finish(std::move(*pack), nullptr, asset, held);
  });
}

std::shared_ptr<TableReader> TableReader::make(std::shared_ptr<AsyncSource> source, AssetId asset, Reserve reserve,
                                               ReadsInFlight& inFlight, std::function<void()> done) {
  return std::make_shared<TableReaderImpl>(std::move(source), asset, reserve, inFlight, std::move(done));
}

}  // namespace billow::runtime
