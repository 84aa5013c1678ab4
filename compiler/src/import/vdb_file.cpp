#include "import/vdb_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "import/byte_reader.h"
#include "import/vdb_points_walk.h"
#include "import/vdb_walk.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using format::SourceType;

constexpr std::uint64_t kVdbMagic = 0x56444220;
constexpr std::uint32_t kOldestVersion = 222;  // OpenVDB 3 (2014): since then nodes are written as they are today
constexpr std::uint32_t kNewestVersion = 224;  // OpenVDB 5 to 12
constexpr std::uint64_t kUuidBytes = 36;
constexpr std::uint32_t kMostGrids = 100000;
constexpr std::uint32_t kMostMetadata = 100000;
constexpr std::string_view kPointTree = "Tree_ptdataidx32_5_4_3";
constexpr std::string_view kHalfSuffix = "_HalfFloat";
constexpr char kUniqueSeparator = '\x1e';  // between a grid's name and the number that makes it unique

constexpr std::array<VdbType, 9> kTypes{{
    {"Tree_float_5_4_3", SourceType::float32, 4, 2, 1, false},
    {"Tree_double_5_4_3", SourceType::float64, 8, 2, 1, false},
    {"Tree_int32_5_4_3", SourceType::int32, 4, 4, 1, false},
    {"Tree_int64_5_4_3", SourceType::int64, 8, 8, 1, false},
    {"Tree_bool_5_4_3", SourceType::boolean, 1, 1, 1, true},
    {"Tree_mask_5_4_3", SourceType::mask, 1, 1, 1, true},
    {"Tree_vec3s_5_4_3", SourceType::vec3f, 12, 6, 3, false},
    {"Tree_vec3d_5_4_3", SourceType::vec3d, 24, 6, 3, false},
    {"Tree_vec3i_5_4_3", SourceType::vec3i, 12, 12, 3, false},
}};

// Bytes of metadata values whose size OpenVDB knows and does not check against what the file says.
constexpr std::array<std::pair<std::string_view, std::uint32_t>, 14> kMetadataBytes{{
    {"bool", 1},
    {"float", 4},
    {"double", 8},
    {"int32", 4},
    {"int64", 8},
    {"vec2i", 8},
    {"vec2s", 8},
    {"vec2d", 16},
    {"vec3i", 12},
    {"vec3s", 12},
    {"vec3d", 24},
    {"vec4i", 16},
    {"vec4s", 16},
    {"mat4s", 64},
}};

constexpr std::array<std::pair<std::string_view, std::uint64_t>, 8> kMapBytes{{
    {"AffineMap", 128},
    {"UnitaryMap", 128},
    {"ScaleMap", 120},
    {"UniformScaleMap", 120},
    {"TranslationMap", 24},
    {"ScaleTranslateMap", 144},
    {"UniformScaleTranslateMap", 144},
    {"NonlinearFrustumMap", 0},  // refused before its tree is looked at
}};

// One array of delayed-load metadata: stored bytes (0: not compressed), then as many, or `raw` of them.
void skipDelayedLoadArray(ByteReader& reader, std::uint32_t stored, std::uint64_t raw) {
  if (stored == 0) return reader.skip(raw, "delayed-load metadata");
  skipBlosc(reader, stored, raw);
}

// OpenVDB allocates what these counts ask for and hands the rest to Blosc, before it looks at either.
void checkDelayedLoad(ByteReader& reader, std::uint32_t bytes) {
  if (bytes == 0) return;  // a grid without leaves
  const std::uint64_t end = reader.position() + bytes;
  const auto leaves = reader.value<std::uint32_t>("delayed-load metadata");
  if (leaves > reader.size() / 64) reader.fail("delayed-load metadata counts more leaves than the file can hold");
  skipDelayedLoadArray(reader, reader.value<std::uint32_t>("delayed-load metadata"), leaves);
  const auto sizes = reader.value<std::uint32_t>("delayed-load metadata");
  constexpr std::uint32_t kNoSizes = 0xffffffffu;
  if (sizes != kNoSizes) skipDelayedLoadArray(reader, sizes, std::uint64_t{leaves} * 8);
  if (reader.position() != end) reader.fail("delayed-load metadata has another size than it says");
}

void readMetadataValue(ByteReader& reader, const std::string& name, const std::string& type, VdbGrid* grid) {
  const auto bytes = reader.value<std::uint32_t>("the size of metadata");
  for (const auto& [known, size] : kMetadataBytes) {
    if (type == known && bytes != size) reader.fail(fmt::format("metadata of type {} says {} bytes", type, bytes));
  }
  if (type == "mat4d" && bytes != 128) reader.fail(fmt::format("metadata of type {} says {} bytes", type, bytes));
  if (type == "__delayedload") return checkDelayedLoad(reader, bytes);
  if (grid != nullptr && name == "class" && type == "string" && bytes <= 64) {
    grid->gridClass.resize(bytes);
    return reader.read(grid->gridClass.data(), bytes, "the grid's class");
  }
  if (grid != nullptr && name == "is_saved_as_half_float" && type == "bool") {
    grid->halfFlag = reader.value<std::uint8_t>("metadata") != 0;
    return;
  }
  reader.skip(bytes, "metadata");
}

// Of a grid where it is not null.
void readMetadata(ByteReader& reader, VdbGrid* grid) {
  const auto count = reader.value<std::uint32_t>("the number of metadata");
  if (count > kMostMetadata) reader.fail(fmt::format("{} metadata claimed", count));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = reader.string("the name of metadata");
    const std::string type = reader.string("the type of metadata");
    readMetadataValue(reader, name, type, grid);
  }
}

// Compression, metadata and transform: everything of a grid before its tree.
void readGridHead(ByteReader& reader, VdbGrid& grid) {
  grid.compression = reader.value<std::uint32_t>("a grid's compression");
  if (grid.compression > 7) reader.fail(fmt::format("unknown compression {:#x}", grid.compression));
  readMetadata(reader, &grid);
  // The type's name says it and the metadata say it; OpenVDB goes by the latter, for the values' size.
  if (grid.half != grid.halfFlag) reader.fail("the grid's type and metadata differ in whether it is saved as half");
  grid.mapType = reader.string("a transform's type");
  const auto map =
      std::find_if(kMapBytes.begin(), kMapBytes.end(), [&](const auto& m) { return m.first == grid.mapType; });
  if (map == kMapBytes.end()) reader.fail(fmt::format("unknown transform '{}'", grid.mapType));
  reader.skip(map->second, "a transform");
  grid.treeOffset = reader.position();
}

void setType(VdbGrid& grid, std::string tree) {
  grid.half = tree.ends_with(kHalfSuffix);
  if (grid.half) tree.resize(tree.size() - kHalfSuffix.size());
  for (const VdbType& type : kTypes) {
    if (type.tree == tree) grid.type = &type;
  }
  grid.points = tree == kPointTree;
  grid.treeType = std::move(tree);
}

// Where a grid begins and ends. (Between them in the file stands where its buffers begin; nobody needs that to read.)
struct Span {
  std::uint64_t grid, end;
};

Span readOffsets(ByteReader& reader, const VdbGrid& grid) {
  const std::uint64_t after = reader.position() + 24;
  const auto gridOffset = reader.value<std::uint64_t>("a grid's offset");
  reader.skip(8, "a grid's offset");
  const auto endOffset = reader.value<std::uint64_t>("a grid's offset");
  if (gridOffset < after || gridOffset > endOffset || endOffset > reader.size()) {
    reader.fail(
        fmt::format("grid '{}' lies at bytes {} to {} of a file of {} bytes (truncated, or its index is damaged)",
                    grid.uniqueName, gridOffset, endOffset, reader.size()));
  }
  return {gridOffset, endOffset};
}

VdbGrid readGrid(ByteReader& reader, bool hasOffsets) {
  VdbGrid grid;
  grid.uniqueName = reader.string("a grid's name");
  setType(grid, reader.string("a grid's type"));
  grid.instanceParent = reader.string("an instance's parent");
  if (hasOffsets) {
    const Span span = readOffsets(reader, grid);
    grid.endOffset = span.end;
    if (grid.type != nullptr || grid.points) {
      reader.seek(span.grid);
      reader.setLimit(span.end);
      readGridHead(reader, grid);
      reader.setLimit(reader.size());
    }
    reader.seek(span.end);
    return grid;
  }
  // Written as a stream: the next grid is found only by walking this one.
  reader.skip(24, "a grid's offsets");
  if (grid.type == nullptr) {
    throw Error(Fault::input, fmt::format("{}: grid '{}' is of type {} in a file without an index, which hides what "
                                          "follows it; save the file again with OpenVDB's io::File",
                                          reader.path(), grid.uniqueName, grid.treeType));
  }
  readGridHead(reader, grid);
  if (grid.instanceParent.empty()) walkTree(reader, grid);
  grid.endOffset = reader.position();
  return grid;
}

// "density", "unnamed", and _1, _2, ... for those that share a name.
void nameGrids(std::vector<VdbGrid>& grids) {
  std::set<std::string> taken;
  std::map<std::string, int> uses;
  std::vector<std::string> plain;
  for (const VdbGrid& grid : grids) {
    const std::string name = grid.uniqueName.substr(0, grid.uniqueName.find(kUniqueSeparator));
    plain.push_back(name.empty() ? "unnamed" : name);
    taken.insert(plain.back());
  }
  for (std::size_t i = 0; i < grids.size(); ++i) {
    int& use = uses[plain[i]];
    std::string name = plain[i];
    if (use++ > 0) {
      while (!taken.insert(name = fmt::format("{}_{}", plain[i], use - 1)).second) ++use;
    }
    grids[i].name = name;
  }
}

void readHeader(ByteReader& reader, VdbFile& file) {
  if (reader.size() == 0) throw Error(Fault::input, fmt::format("{}: the file is empty", file.path));
  if (reader.size() < 8 || reader.value<std::uint64_t>("the magic number") != kVdbMagic) {
    throw Error(Fault::input, fmt::format("{}: not an OpenVDB file", file.path));
  }
  file.version = reader.value<std::uint32_t>("the file's version");
  if (file.version < kOldestVersion || file.version > kNewestVersion) {
    throw Error(Fault::input, fmt::format("{}: OpenVDB file version {}, while {} to {} can be read; save it again with "
                                          "another OpenVDB",
                                          file.path, file.version, kOldestVersion, kNewestVersion));
  }
  reader.skip(8, "the library's version");
}

}  // namespace

VdbFile listVdbFile(const std::string& path) {
  ByteReader reader(path);
  VdbFile file;
  file.path = path;
  readHeader(reader, file);
  const auto hasOffsets = reader.value<std::uint8_t>("the header");
  if (hasOffsets > 1) reader.fail("the index flag is neither 0 nor 1");
  reader.skip(kUuidBytes, "the file's UUID");
  readMetadata(reader, nullptr);
  const auto count = reader.value<std::uint32_t>("the number of grids");
  if (count > kMostGrids) reader.fail(fmt::format("{} grids claimed", count));
  std::set<std::string> names;
  for (std::uint32_t i = 0; i < count; ++i) {
    file.grids.push_back(readGrid(reader, hasOffsets == 1));
    if (!names.insert(file.grids.back().uniqueName).second) reader.fail("two grids with the same unique name");
  }
  nameGrids(file.grids);
  return file;
}

SourceType sourceTypeOf(const VdbGrid& grid) {
  return grid.half && grid.type->sourceType == SourceType::float32 ? SourceType::float16 : grid.type->sourceType;
}

void checkVdbGrid(const VdbFile& file, const VdbGrid& grid) {
  const VdbGrid* tree = &grid;
  if (!grid.instanceParent.empty()) {
    const auto parent = std::find_if(file.grids.begin(), file.grids.end(),
                                     [&](const VdbGrid& other) { return other.uniqueName == grid.instanceParent; });
    if (parent == file.grids.end() || !parent->instanceParent.empty() || parent->type != grid.type ||
        parent->half != grid.half) {
      throw Error(Fault::input, fmt::format("{}: damaged: grid '{}' shares the tree of '{}', which the file lacks or "
                                            "which is of another type",
                                            file.path, grid.name, grid.instanceParent));
    }
    tree = &*parent;
  }
  ByteReader reader(file.path);
  reader.setLimit(tree->endOffset);
  reader.seek(tree->treeOffset);
  walkTree(reader, *tree);
}

void skipMetadata(ByteReader& reader) {
  readMetadata(reader, nullptr);
}

std::uint64_t checkVdbPoints(const VdbFile& file, const VdbGrid& grid, std::uint64_t most) {
  constexpr std::uint32_t kMultiPassVersion = 224;
  if (file.version < kMultiPassVersion || !grid.instanceParent.empty()) {
    throw Error(Fault::input, fmt::format("{}: grid '{}': points of an OpenVDB before 5, or that share the tree of "
                                          "another grid; save the file again",
                                          file.path, grid.name));
  }
  ByteReader reader(file.path);
  reader.setLimit(grid.endOffset);
  reader.seek(grid.treeOffset);
  return walkPoints(reader, grid, most);
}

}  // namespace billow::compiler
