#include "pack_lookup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <system_error>
#include <vector>

namespace billow::command {

namespace {

// By name, of those that are no level.
tl::expected<std::uint32_t, std::string> findFull(const format::Pack& pack, const std::string& name) {
  std::vector<std::uint32_t> full;
  std::vector<std::string_view> names;
  for (std::uint32_t i = 0; i < pack.volumes().size(); ++i) {
    if (pack.isLevel(i)) continue;
    full.push_back(i);
    names.push_back(pack.string(pack.volumes()[i].name));
    if (names.back() == name) return i;
  }
  if (name.empty() && full.size() == 1) return full.front();
  if (full.empty()) return tl::unexpected(std::string("the pack has no volumes, only effects or nothing"));
  return tl::unexpected(name.empty() ? fmt::format("the pack has {} volumes; choose one by name: {}", names.size(),
                                                   fmt::join(names, ", "))
                                     : fmt::format("no volume \"{}\"; there is: {}", name, fmt::join(names, ", ")));
}

}  // namespace

tl::expected<std::uint32_t, std::string> findVolume(const format::Pack& pack, const std::string& name,
                                                    std::uint32_t level) {
  const auto full = findFull(pack, name);
  if (!full || level == 0) return full;
  std::string stored = "0";
  for (const format::LevelRecord& record : pack.levelsOf(*full)) {
    if (record.log2 == level) return record.level;
    stored += fmt::format(", {}", record.log2);
  }
  return tl::unexpected(fmt::format("no level {} of volume \"{}\"; there is: {}", level,
                                    pack.string(pack.volumes()[*full].name), stored));
}

tl::expected<std::uint32_t, std::string> findEffect(const format::Pack& pack, const std::string& name) {
  const auto& effects = pack.effects().effects;
  std::vector<std::string_view> names;
  for (std::uint32_t i = 0; i < effects.size(); ++i) {
    names.push_back(pack.string(effects[i].name));
    if (names.back() == name) return i;
  }
  return tl::unexpected(fmt::format("no effect \"{}\"; there is: {}", name,
                                    names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

std::ptrdiff_t findFrame(const format::Pack& pack, const format::VolumeRecord& volume, std::int32_t number) {
  const auto frames = pack.framesOf(volume);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].number == number) return static_cast<std::ptrdiff_t>(i);
  }
  return -1;
}

std::ptrdiff_t findGrid(const format::Pack& pack, const format::VolumeRecord& volume, const std::string& name) {
  const auto grids = pack.gridsOf(volume);
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (pack.string(grids[i].name) == name) return static_cast<std::ptrdiff_t>(i);
  }
  return -1;
}

std::string gridNames(const format::Pack& pack, const format::VolumeRecord& volume) {
  std::vector<std::string_view> names;
  for (const format::GridRecord& grid : pack.gridsOf(volume)) names.push_back(pack.string(grid.name));
  return fmt::format("{}", fmt::join(names, ", "));
}

bool sameFile(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

}  // namespace billow::command
