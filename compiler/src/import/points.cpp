#include "import/points.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "billow/format/source.h"
#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 30;

std::vector<std::byte> readFile(const std::string& path) {
  const auto source = format::openFileSource(path);
  if (!source) throw Error(Fault::file, fmt::format("{}: cannot be read: {}", path, source.error().detail));
  const std::uint64_t size = (*source)->size();
  if (size > kMostFileBytes) {
    throw Error(Fault::input, fmt::format("{}: {} bytes; expected at most {}", path, size, kMostFileBytes));
  }
  std::vector<std::byte> bytes(size);
  if (!(*source)->read(0, bytes)) throw Error(Fault::file, fmt::format("{}: cannot be read", path));
  return bytes;
}

}  // namespace

PointFrame readPoints(const std::string& path, std::int32_t frame, const PointAttributes& attributes,
                      std::uint32_t most) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string what = fmt::format("{}: frame {}", path, frame);
  if (extension == ".ply") return readPly(readFile(path), what, attributes, most);
  if (extension == ".vdb") return readVdbPoints(path, what, attributes, most);
  throw Error(Fault::input, fmt::format("{}: particles are read from .ply and .vdb files", path));
}

void failWithoutAttribute(const std::string& what, const AttributeChoice& choice,
                          std::span<const std::string> offered) {
  constexpr std::size_t kShown = 32;
  const auto shown = offered.subspan(0, std::min(offered.size(), kShown));
  throw Error(Fault::input, fmt::format("{}: no attribute '{}' of a fitting type; there is: {}", what,
                                        fmt::join(choice.names, "' or '"),
                                        offered.empty() ? "none" : fmt::format("{}", fmt::join(shown, ", "))));
}

std::int64_t idOf(double value, const std::string& what, std::size_t particle) {
  constexpr double kMost = 9007199254740992;  // 2^53: up to here, every integer is a double
  if (std::abs(value) <= kMost && value == std::floor(value)) return static_cast<std::int64_t>(value);
  throw Error(Fault::input, fmt::format("{}: particle {}: an id of {}; expected an integer", what, particle, value));
}

}  // namespace billow::compiler
