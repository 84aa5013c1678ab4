#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "billow/format/affine.h"
#include "billow/format/look.h"
#include "rules.h"

namespace billow::format {
namespace {

bool finite(double value) {
  return std::isfinite(value);
}
bool finite(float value) {
  return std::isfinite(value);
}

std::string_view textOf(const TableView& tables, StringRef ref) {
  return tables.strings.substr(ref.offset, ref.size);
}

template <std::size_t N>
bool allZero(const std::uint32_t (&values)[N]) {
  return std::all_of(std::begin(values), std::end(values), [](std::uint32_t value) { return value == 0; });
}

void checkLook(const LookRecord& look, const Place& place, IssueSink& sink) {
  if (!allZero(look.reserved)) sink.report(Rule::tableReserved, place, "A reserved field of a look is not.");
  if (look.set >> kLookFieldCount != 0) {
    sink.report(Rule::look, place, fmt::format("Unknown bits in {:#x}.", look.set));
  }
  for (std::uint32_t field = 0; field < kLookFieldCount; ++field) {
    const bool given = isSet(look, field);
    for (const float value : lookValues(look, field)) {
      if (given ? finite(value) && kLookFields[field].holds(value) : value == 0) continue;
      sink.report(Rule::look, place,
                  fmt::format("{} {} is {}.", given ? "The set" : "The unset", kLookFields[field].name, value));
    }
  }
}

// Whether the volumes divide the other tables among themselves, so that records may be found through them.
bool checkVolumeRanges(const TableView& tables, IssueSink& sink) {
  std::uint64_t grids = 0, frames = 0, gridFrames = 0;
  for (std::size_t i = 0; i < tables.volumes.size(); ++i) {
    const VolumeRecord& volume = tables.volumes[i];
    const bool follows =
        volume.firstGrid == grids && volume.firstFrame == frames && volume.firstGridFrame == gridFrames;
    grids += volume.gridCount;
    frames += volume.frameCount;
    gridFrames += std::uint64_t{volume.gridCount} * volume.frameCount;
    if (!follows || grids > tables.grids.size() || frames > tables.frames.size() ||
        gridFrames > tables.gridFrames.size()) {
      Place place = tables.place(kSectionVolumes, i * sizeof(VolumeRecord));
      place.volume = static_cast<std::uint32_t>(i);
      sink.report(Rule::volumeRanges, place, "Its ranges do not follow those of the volume before, or pass the end.");
      return false;
    }
  }
  if (grids == tables.grids.size() && frames == tables.frames.size() && gridFrames == tables.gridFrames.size()) {
    return true;
  }
  sink.report(Rule::volumeRanges, tables.place(kSectionVolumes, 0),
              fmt::format("Volumes own {} of {} grids, {} of {} frames, {} of {} grid frames.", grids,
                          tables.grids.size(), frames, tables.frames.size(), gridFrames, tables.gridFrames.size()));
  return false;
}

void checkGrid(const GridRecord& grid, std::uint32_t owner, const Place& place, IssueSink& sink) {
  if (grid.volume != owner) {
    sink.report(Rule::gridVolume, place, fmt::format("It names volume {} and belongs to {}.", grid.volume, owner));
  }
  if (grid.role >= kRoleCount) sink.report(Rule::gridRole, place, fmt::format("Role {}.", grid.role));
  const bool vector = grid.sourceType >= static_cast<std::uint32_t>(SourceType::vec3f);
  if (grid.sourceType >= kSourceTypeCount || (vector ? grid.component > 2 : grid.component != kNone)) {
    sink.report(Rule::gridType, place, fmt::format("Type {}, component {}.", grid.sourceType, grid.component));
  }
  if (!allZero(grid.reserved)) sink.report(Rule::tableReserved, place, "A reserved field of a grid is not.");
}

void checkVolumeGrids(const TableView& tables, std::uint32_t number, IssueSink& sink) {
  const VolumeRecord& volume = tables.volumes[number];
  std::set<std::string_view> names;
  for (std::uint32_t i = 0; i < volume.gridCount && !sink.stopped(); ++i) {
    const std::size_t index = std::size_t{volume.firstGrid} + i;
    Place place = tables.place(kSectionGrids, index * sizeof(GridRecord));
    place.volume = number;
    place.grid = i;
    checkName(tables, tables.grids[index].name, place, names, sink);
    checkGrid(tables.grids[index], number, place, sink);
  }
}

void checkVolumeFrames(const TableView& tables, std::uint32_t number, IssueSink& sink) {
  const VolumeRecord& volume = tables.volumes[number];
  const FrameRecord* before = nullptr;
  for (std::uint32_t i = 0; i < volume.frameCount && !sink.stopped(); ++i) {
    const FrameRecord& frame = tables.frames[std::size_t{volume.firstFrame} + i];
    Place place = tables.place(kSectionFrames, (std::uint64_t{volume.firstFrame} + i) * sizeof(FrameRecord));
    place.volume = number;
    place.frame = frame.number;
    if (before != nullptr && frame.number <= before->number) {
      sink.report(Rule::frameNumber, place, fmt::format("It follows frame {}.", before->number));
    }
    if (!finite(frame.time) || frame.time < 0 || (before != nullptr && frame.time < before->time)) {
      sink.report(Rule::frameTime, place, fmt::format("Its time is {} s.", frame.time));
    }
    const bool held = (frame.flags & kFrameHeld) != 0;
    const bool blank = (frame.flags & kFrameBlank) != 0;
    if ((frame.flags & ~(kFrameHeld | kFrameBlank)) != 0 || (held && blank) || (held && i == 0)) {
      sink.report(Rule::frameFlags, place, fmt::format("Its flags are {:#x}.", frame.flags));
    }
    before = &frame;
  }
}

void checkValues(const GridFrame& frame, const Place& place, IssueSink& sink) {
  const bool values = finite(frame.background) && finite(frame.valueMin) && finite(frame.valueMax) &&
                      frame.valueMin <= frame.background && frame.background <= frame.valueMax;
  const bool source = finite(frame.sourceMin) && finite(frame.sourceMax) && frame.sourceMin <= frame.sourceMax;
  const bool errors =
      finite(frame.maxError) && frame.maxError >= 0 && finite(frame.squaredError) && frame.squaredError >= 0;
  if (values && source && errors) return;
  sink.report(Rule::gridFrameValues, place,
              fmt::format("Background {}, values [{}, {}], source [{}, {}], largest error {}, squared errors {}.",
                          frame.background, frame.valueMin, frame.valueMax, frame.sourceMin, frame.sourceMax,
                          frame.maxError, frame.squaredError));
}

void checkBox(const GridFrame& frame, const Place& place, IssueSink& sink) {
  bool empty = false, inside = true;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t low = frame.activeMin[axis], high = frame.activeMax[axis];
    empty |= low > high;
    inside &= low >= 0 && high < static_cast<std::int32_t>(kIndexSpan);
    if (frame.origin[axis] % 8 != 0) {
      sink.report(Rule::gridFrameOrigin, place, fmt::format("Axis {} begins at {}.", axis, frame.origin[axis]));
    }
  }
  for (int axis = 0; axis < 3 && !empty; ++axis) {
    const std::int64_t last = std::int64_t{frame.origin[axis]} + frame.activeMax[axis];
    if (last <= std::numeric_limits<std::int32_t>::max()) continue;
    sink.report(Rule::gridFrameOrigin, place, fmt::format("Axis {} ends at {}.", axis, last));
  }
  if (empty == (frame.activeVoxels == 0) && (empty || inside)) return;
  sink.report(
      Rule::gridFrameBox, place,
      fmt::format("[{}, {}] x [{}, {}] x [{}, {}] for {} active voxels.", frame.activeMin[0], frame.activeMax[0],
                  frame.activeMin[1], frame.activeMax[1], frame.activeMin[2], frame.activeMax[2], frame.activeVoxels));
}

void checkPageList(const TableView& tables, const GridFrame& frame, const Place& place, IssueSink& sink) {
  if (frame.pageListBegin > tables.pageLists.size() ||
      frame.pageListCount > tables.pageLists.size() - frame.pageListBegin) {
    return sink.report(
        Rule::pageListRange, place,
        fmt::format("{} entries at {} of {}.", frame.pageListCount, frame.pageListBegin, tables.pageLists.size()));
  }
  const std::span<const std::uint32_t> list = tables.pageLists.subspan(frame.pageListBegin, frame.pageListCount);
  for (std::size_t i = 0; i < list.size() && !sink.stopped(); ++i) {
    if (i > 0 && list[i] <= list[i - 1]) {
      sink.report(Rule::pageListOrder, place, fmt::format("Page {} follows page {}.", list[i], list[i - 1]));
    }
    if (list[i] >= tables.pages.size()) {
      sink.report(Rule::pageListPage, place, fmt::format("Page {} of {}.", list[i], tables.pages.size()));
    }
  }
}

void checkEmpty(const GridFrame& frame, const Place& place, IssueSink& sink) {
  std::uint64_t sum = frame.activeVoxels | frame.pageListCount;
  sum |= frame.node4Count | frame.node3Count | frame.maskCount | frame.childCount | frame.tileCount;
  for (std::uint32_t i = 0; i < kBrickClassCount; ++i) sum |= frame.brickCount[i] | frame.brickUnits[i];
  if (sum != 0) sink.report(Rule::gridFrameEmpty, place, "Some of its counts are not zero.");
}

void checkGridFrame(const TableView& tables, std::uint64_t index, std::uint64_t node5Total, IssueSink& sink) {
  const GridFrame& frame = tables.gridFrames[index];
  const Place place = tables.gridFramePlace(index);
  if ((frame.flags & ~kGridPresent) != 0) {
    sink.report(Rule::gridFrameFlags, place, fmt::format("Its flags are {:#x}.", frame.flags));
  }
  if ((frame.reserved | frame.reserved2) != 0)
    sink.report(Rule::tableReserved, place, "A reserved field of a grid frame is not.");
  if (!invertible(frame.indexToWorld)) {
    const bool numbers = std::all_of(std::begin(frame.indexToWorld), std::end(frame.indexToWorld),
                                     [](double value) { return finite(value); });
    sink.report(Rule::transform, place, numbers ? "It is singular." : "It is not finite.");
  }
  checkValues(frame, place, sink);
  checkBox(frame, place, sink);
  checkPageList(tables, frame, place, sink);
  if (frame.node5 == kNone) {
    checkEmpty(frame, place, sink);
  } else if (frame.node5 >= node5Total) {
    sink.report(Rule::gridFrameNode5, place, fmt::format("Node5 {} of {}.", frame.node5, node5Total));
  }
}

// What a frame's flags say about its grid frames.
void checkPresence(const TableView& tables, const VolumeRecord& volume, IssueSink& sink) {
  std::uint64_t index = volume.firstGridFrame;
  for (std::uint32_t f = 0; f < volume.frameCount && !sink.stopped(); ++f) {
    const bool blank = (tables.frames[std::size_t{volume.firstFrame} + f].flags & kFrameBlank) != 0;
    for (std::uint32_t g = 0; g < volume.gridCount; ++g, ++index) {
      const GridFrame& frame = tables.gridFrames[index];
      const bool present = (frame.flags & kGridPresent) != 0;
      if ((blank && present) || (!present && frame.node5 != kNone)) {
        sink.report(Rule::frameBlank, tables.gridFramePlace(index), "It has one all the same.");
      }
    }
  }
}

}  // namespace

Place TableView::place(std::uint32_t section, std::uint64_t byte) const {
  Place place;
  place.section = sectionName(section);
  for (const SectionEntry& entry : sections) {
    if (entry.type == section) place.offset = entry.offset + byte;
  }
  return place;
}

Place TableView::gridFramePlace(std::uint64_t index) const {
  Place at = place(kSectionGridFrames, index * sizeof(GridFrame));
  const auto after = std::upper_bound(volumes.begin(), volumes.end(), index,
                                      [](std::uint64_t i, const VolumeRecord& v) { return i < v.firstGridFrame; });
  if (after == volumes.begin()) return at;
  const VolumeRecord& volume = *(after - 1);
  const std::uint64_t local = index - volume.firstGridFrame;
  if (local >= std::uint64_t{volume.gridCount} * volume.frameCount) return at;
  const std::uint64_t frame = volume.firstFrame + local / volume.gridCount;
  at.volume = static_cast<std::uint32_t>(after - 1 - volumes.begin());
  at.grid = static_cast<std::uint32_t>(local % volume.gridCount);
  if (frame < frames.size()) at.frame = frames[frame].number;
  return at;
}

void checkName(const TableView& tables, StringRef ref, const Place& place, std::set<std::string_view>& seen,
               IssueSink& sink) {
  if (ref.offset > tables.strings.size() || ref.size > tables.strings.size() - ref.offset) {
    return sink.report(Rule::stringRange, place,
                       fmt::format("{} bytes at {} of {}.", ref.size, ref.offset, tables.strings.size()));
  }
  const std::string_view name = textOf(tables, ref);
  if (!isUtf8(name)) return sink.report(Rule::stringRange, place, "It is cut inside of a character.");
  const bool control = std::any_of(name.begin(), name.end(), isControl);
  if (name.empty() || control) {
    return sink.report(Rule::nameEmpty, place, name.empty() ? "It is empty." : "It has control characters.");
  }
  if (!seen.insert(name).second) sink.report(Rule::nameDuplicate, place, fmt::format("\"{}\" occurs twice.", name));
}

void checkTables(const TableView& tables, IssueSink& sink) {
  if (!isUtf8(tables.strings)) sink.report(Rule::stringsUtf8, tables.place(kSectionStrings, 0), "They are not.");
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < tables.volumes.size() && !sink.stopped(); ++i) {
    Place place = tables.place(kSectionVolumes, i * sizeof(VolumeRecord));
    place.volume = static_cast<std::uint32_t>(i);
    const VolumeRecord& volume = tables.volumes[i];
    checkName(tables, volume.name, place, names, sink);
    if (!finite(volume.framesPerSecond) || volume.framesPerSecond <= 0) {
      sink.report(Rule::frameRate, place, fmt::format("It is {}.", volume.framesPerSecond));
    }
    checkLook(volume.look, place, sink);
  }
  if (checkVolumeRanges(tables, sink)) {
    for (std::uint32_t i = 0; i < tables.volumes.size() && !sink.stopped(); ++i) {
      checkVolumeGrids(tables, i, sink);
      checkVolumeFrames(tables, i, sink);
      checkPresence(tables, tables.volumes[i], sink);
    }
  }
  const std::uint64_t node5Total = streamTotals(tables.pages).count[static_cast<std::uint32_t>(Stream::node5)];
  for (std::uint64_t i = 0; i < tables.gridFrames.size() && !sink.stopped(); ++i) {
    checkGridFrame(tables, i, node5Total, sink);
  }
}

}  // namespace billow::format
