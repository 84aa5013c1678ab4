#include "billow/format/issue.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "billow/format/validate.h"
#include "rules.h"

namespace billow::format {
namespace {

constexpr IssueKind error(Rule rule, std::string_view name, std::string_view summary) {
  return {static_cast<std::uint16_t>(rule), Severity::error, name, summary};
}
constexpr IssueKind warning(Rule rule, std::string_view name, std::string_view summary) {
  return {static_cast<std::uint16_t>(rule), Severity::warning, name, summary};
}

// By ascending id.
constexpr IssueKind kCatalogue[] = {
    error(Rule::cannotOpen, "cannot-open", "The file can be opened for reading."),
    error(Rule::cannotRead, "cannot-read", "Every byte of the file can be read."),
    error(Rule::tooManyBricks, "too-many-bricks",
          "A grid frame spreads its shared nodes over no more bricks than this reader lays out at once."),
    error(Rule::tableLimit, "table-limit", "A table is no longer than this reader holds in memory (1 GiB)."),
    error(Rule::frameLimit, "frame-limit",
          "The pages of a grid frame are no more than this reader holds in memory (4 GiB)."),
    error(Rule::memory, "memory", "The system gives the reader the memory and the threads that it asks for."),

    error(Rule::tooShort, "too-short", "A pack is at least as long as its header."),
    error(Rule::magic, "magic", "A pack begins with the magic bytes."),
    error(Rule::headerChecksum, "header-checksum", "The header's checksum matches its bytes."),
    error(Rule::majorVersion, "major-version", "The major version is one that the reader knows."),
    warning(Rule::minorVersion, "minor-version", "The minor version is no newer than the reader."),
    error(Rule::fileSize, "file-size", "The file is as long as its header says."),
    error(Rule::headerReserved, "header-reserved", "Reserved fields of the header are zero."),
    error(Rule::contentsRange, "contents-range",
          "The contents begin right after the header, list at most 64 sections and lie inside the file."),
    error(Rule::contentsChecksum, "contents-checksum", "The contents' checksum matches its bytes."),
    error(Rule::sectionFlags, "section-flags", "A section has the flags that its type demands and no reserved ones."),
    error(Rule::sectionAlignment, "section-alignment", "A section begins at a multiple of 64 bytes."),
    error(Rule::sectionOrder, "section-order", "Sections are listed in the order of the file and do not overlap."),
    error(Rule::sectionRange, "section-range", "A section lies inside the file."),
    error(Rule::sectionDuplicate, "section-duplicate", "A known section occurs once."),
    error(Rule::sectionMissing, "section-missing", "Every required section is there."),
    error(Rule::sectionUnknown, "section-unknown", "An unknown section is not marked as required."),
    error(Rule::padding, "padding", "Bytes that belong to no section are zero."),
    error(Rule::paddingLength, "padding-length", "Less than 4096 bytes lie between one section and the next."),
    error(Rule::fileEnd, "file-end", "The file ends where its last section ends."),
    error(Rule::sectionChecksum, "section-checksum", "A section's checksum matches its bytes."),

    error(Rule::tableSize, "table-size", "A table is a whole number of records, and no more than 2^32 - 1."),
    error(Rule::stringsUtf8, "strings-utf8", "The strings are well-formed UTF-8."),
    error(Rule::stringRange, "string-range", "A string reference lies inside the strings and cuts no character."),
    error(Rule::nameEmpty, "name-empty", "A name has at least one character and no control characters."),
    error(Rule::nameDuplicate, "name-duplicate", "Names of volumes, and of the grids of one volume, are unique."),
    error(Rule::volumeRanges, "volume-ranges",
          "The volumes divide grids, frames and grid frames among themselves, in order and without remainder."),
    error(Rule::frameRate, "frame-rate", "Frames per second are finite and above zero."),
    error(Rule::look, "look", "Look defaults are in range, and zero where they are not set."),
    error(Rule::gridVolume, "grid-volume", "A grid names the volume that owns it."),
    error(Rule::gridRole, "grid-role", "A grid's role is known."),
    error(Rule::gridType, "grid-type",
          "A grid's source type is known, and it has a component exactly if it is a vector."),
    error(Rule::frameNumber, "frame-number", "Frame numbers of a volume strictly increase."),
    error(Rule::frameTime, "frame-time", "Frame times are finite, at least zero and never decrease within a volume."),
    error(Rule::frameFlags, "frame-flags",
          "A frame has no reserved flags, is not both held and blank, and is not held when it is the first."),
    error(Rule::tableReserved, "table-reserved", "Reserved fields of the tables are zero."),
    error(Rule::gridFrameFlags, "grid-frame-flags", "A grid frame has no reserved flags."),
    error(Rule::transform, "transform",
          "An index-to-world transform is finite, and so are its determinant and the reciprocal of that."),
    error(Rule::gridFrameValues, "grid-frame-values",
          "A grid frame's values are finite, its ranges are ordered and hold the background, its errors are not "
          "negative."),
    error(Rule::gridFrameBox, "grid-frame-box",
          "The active box lies in [0, 4095] on every axis, and is empty exactly if no voxel is active."),
    error(Rule::gridFrameOrigin, "grid-frame-origin",
          "A grid frame's origin is a multiple of 8 on every axis, and no source index of its active box exceeds 2^31 "
          "- 1."),
    error(Rule::gridFrameEmpty, "grid-frame-empty",
          "A grid frame without a Node5 has no voxels, pages, nodes or bricks."),
    error(Rule::pageListRange, "page-list-range", "A grid frame's page list lies inside the page lists."),
    error(Rule::pageListOrder, "page-list-order", "The pages of a list strictly increase."),
    error(Rule::pageListPage, "page-list-page", "A listed page exists."),
    error(Rule::gridFrameNode5, "grid-frame-node5", "A grid frame's Node5 exists."),
    error(Rule::frameBlank, "frame-blank",
          "A grid frame that is not present has no Node5, and none of a blank frame is present."),
    error(Rule::infoUtf8, "info-utf8", "The provenance text is well-formed UTF-8."),
    error(Rule::pageCodec, "page-codec", "A page's codec is known."),
    error(
        Rule::pageSize, "page-size",
        "A page's raw size is the sum of its runs, from 1 byte to 1 MiB; its stored size is equal to it if it is raw, "
        "else smaller."),
    error(Rule::pageStreams, "page-streams", "The pages' runs divide each global array, in order and without gaps."),
    error(Rule::pageOffset, "page-offset", "The pages follow one another without gaps and fill their section."),
    error(Rule::streamLength, "stream-length",
          "A global array has at most 2^27 units, 2^31 masks, or 2^32 - 1 other items."),
    error(
        Rule::levelVolumes, "level-volumes",
        "Levels are in order of their full volumes, each 2^1 to 2^4 times as coarse and more so than the one before; a "
        "volume is the level of one other that is none itself."),
    error(Rule::levelContents, "level-contents",
          "A level has its full volume's look, frame rate, frames and grids, and each grid in the same frames."),
    error(Rule::levelPlace, "level-place",
          "A level's voxels are as much longer as it is coarser, and each lies where those are that it covers."),
    error(Rule::levelErrors, "level-errors",
          "The levels divide their errors in order and without remainder, which are finite and not negative."),

    error(Rule::pageChecksum, "page-checksum", "A page's checksum matches its stored bytes."),
    error(Rule::pageDecompress, "page-decompress", "A page decompresses to exactly the bytes that were written."),
    error(Rule::pageMissing, "page-missing", "A grid frame lists every page that it needs."),
    warning(Rule::pageSuperfluous, "page-superfluous", "A grid frame lists only pages that it needs."),
    warning(Rule::pageUnused, "page-unused", "Every page is listed by a grid frame."),
    warning(Rule::itemUnused, "item-unused", "Every node, mask and brick unit is reached from a grid frame."),

    error(Rule::nodeChildren, "node-children", "A node's child list exists and lies in one page."),
    error(Rule::nodeFlags, "node-flags", "A node has no reserved flags."),
    error(Rule::nodeFinite, "node-finite", "A node's values are finite."),
    error(Rule::nodeRange, "node-range",
          "A node's mean, and its tile where a child is absent, lie between its minimum and maximum."),
    error(Rule::childIndex, "child-index", "A child exists."),
    error(Rule::nodeConservative, "node-conservative",
          "Every value below a node lies between its minimum and maximum."),
    error(Rule::nodeTileActive, "node-tile-active", "Only a node without children is an active tile."),
    error(Rule::nodeTile, "node-tile", "The tile of an inactive node with an absent child is the background."),

    error(Rule::brickEncoding, "brick-encoding", "A brick's encoding is known."),
    error(Rule::brickUnits, "brick-units", "A brick's units exist and lie in one page; a constant has unit 0."),
    error(Rule::brickMask, "brick-mask",
          "A brick's mask exists, and comes from its indices only where the encoding has indices."),
    error(Rule::brickFinite, "brick-finite", "A brick's values are finite, the largest that it can hold included."),
    error(Rule::brickScale, "brick-scale", "A brick's scale is not negative, and a constant's is zero."),
    error(Rule::brickMean, "brick-mean",
          "A brick's mean lies between the least and the largest that it can hold, or the background."),
    error(Rule::brickOverlap, "brick-overlap",
          "Two bricks have no unit in common, or all and then the same encoding or both BC7."),

    error(Rule::counts, "counts", "A grid frame's counts are those of what it reaches."),
    error(Rule::activeVoxels, "active-voxels", "A grid frame's active voxels are those that it reaches."),
    error(Rule::activeBox, "active-box", "The active box holds every active voxel."),
    warning(Rule::activeBoxLoose, "active-box-loose", "The active box is no larger than its active voxels need."),
    error(Rule::valueRange, "value-range", "A grid frame's value range holds its root's range."),

    error(Rule::effectRanges, "effect-ranges",
          "The effects divide the emitters among themselves, at most 64 each, and the emitters the spans, 1 to 128 "
          "each, none with given particles, in order and without remainder."),
    error(Rule::effectValues, "effect-values",
          "An effect has no reserved flags, is warm from the start only if it loops, and lasts from 0.01 to 3600 s."),
    error(Rule::effectAlive, "effect-alive", "No more than 65536 particles of an effect can be alive at once."),
    error(Rule::emitterValues, "emitter-values", "An emitter's numbers are finite and in range."),
    error(Rule::emitterSpans, "emitter-spans",
          "An emitter's spans lie within its effect's duration and number 1 to 1048576 particles, one after another."),
    error(Rule::effectReference, "effect-reference",
          "The curves, ramps, cube maps and material that are referred to exist."),
    error(Rule::materialProfile, "material-profile",
          "A material's profile is known, and it has a curve that exists exactly if its profile is one."),
    error(Rule::materialValues, "material-values", "A material's numbers are finite and in range."),
    error(Rule::effectTable, "effect-table",
          "Values of curves lie in [-1000000, 1000000], those of ramps in [0, 1000000]."),
    error(Rule::trackRanges, "track-ranges",
          "The tracks divide their frames, and these the bytes, in order and without remainder, within their limits."),
    error(Rule::trackData, "track-data",
          "A track's frame is a Draco point cloud of so many points, in order of their numbers, at finite places."),
    error(Rule::givenRanges, "given-ranges",
          "The emitters divide the given particles among themselves, at most 1048576 each, in order and without "
          "remainder; those with any have a track, and only those one with radii."),
    error(Rule::givenValues, "given-values",
          "Given particles are in order of birth, within their effect's duration, and their numbers are in range."),
    error(Rule::emitterSurface, "emitter-surface",
          "An emitter on a mesh has 1 to 65536 surface points, which exist; any other has none."),
};

consteval bool ascending() {
  for (std::size_t i = 1; i < std::size(kCatalogue); ++i) {
    if (kCatalogue[i - 1].id >= kCatalogue[i].id) return false;
  }
  return true;
}
static_assert(ascending(), "ids are unique and in order");

}  // namespace

std::span<const IssueKind> issueCatalogue() {
  return kCatalogue;
}

const IssueKind& kindOf(Rule rule) {
  return *std::lower_bound(std::begin(kCatalogue), std::end(kCatalogue), static_cast<std::uint16_t>(rule),
                           [](const IssueKind& kind, std::uint16_t id) { return kind.id < id; });
}

Issue makeIssue(Rule rule, const Place& place, std::string detail) {
  return {&kindOf(rule), place, std::move(detail)};
}

void IssueSink::report(Rule rule, const Place& place, std::string detail) {
  if (stopped_) return;
  Issue issue = makeIssue(rule, place, std::move(detail));
  if (issue.kind->severity == Severity::error) ++errors_;
  stopped_ = !take(std::move(issue));
}

bool FirstError::take(Issue issue) {
  if (issue.kind->severity == Severity::warning) return true;
  issue_ = std::move(issue);
  return false;
}

bool Collector::take(Issue issue) {
  issues_.push_back(std::move(issue));
  return issues_.size() < limit_;
}

std::string toString(const Issue& issue) {
  if (issue.kind == nullptr) return issue.detail;
  const Place& place = issue.place;
  std::string where;
  const auto add = [&](std::string_view word, auto value) { where += fmt::format(" {} {}", word, value); };
  if (!place.section.empty()) where += fmt::format(" {}", place.section);
  if (place.offset) add("byte", *place.offset);
  if (place.page) add("page", *place.page);
  if (place.volume) add("volume", *place.volume);
  if (place.frame) add("frame", *place.frame);
  if (place.grid) add("grid", *place.grid);
  if (place.node) add(place.nodeKind.empty() ? "item" : place.nodeKind, *place.node);
  const std::string_view severity = issue.kind->severity == Severity::error ? "error" : "warning";
  return fmt::format("{} {} {}{}{}: {}", severity, issue.kind->id, issue.kind->name, where.empty() ? "" : " at", where,
                     issue.detail);
}

}  // namespace billow::format
