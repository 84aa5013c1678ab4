#include "import/vdb_read.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <mutex>

#include "parallel.h"

namespace billow::compiler {
namespace {

// Beyond this, lo + scale * texel could overflow on its way to a value.
constexpr double kLargestValue = 1e37;

// What is noted while values are converted; one a leaf, merged in order, so that messages do not depend on threads.
struct Notes {
  float min = 0, max = 0;
  std::uint32_t nonFinite = 0, tooLarge = 0, denormal = 0;
  std::uint32_t firstNonFinite = 0, firstTooLarge = 0;  // voxel indices
  std::uint64_t rounded = 0;                            // values that single precision does not hold exactly
  double rounding = 0;                                  // the largest difference that makes
  std::uint32_t mostRounded = 0;                        // and its voxel index
};

template <class T>
void noteRounding(T value, float result, std::uint32_t index, Notes& notes) {
  if constexpr (std::is_same_v<T, double> || (std::is_integral_v<T> && sizeof(T) >= 4)) {
    using Wide = std::conditional_t<sizeof(T) == 8 && std::is_integral_v<T>, long double, double>;
    const auto difference = static_cast<double>(std::fabs(static_cast<Wide>(value) - static_cast<Wide>(result)));
    if (difference > 0) ++notes.rounded;
    if (difference <= notes.rounding) return;
    notes.rounding = difference;
    notes.mostRounded = index;
  }
}

// Converts one value; `index` is where it stands, for the notes.
template <class T>
float convert(T value, std::uint32_t index, Notes& notes) {
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) {
      if (notes.nonFinite++ == 0) notes.firstNonFinite = index;
      return 0;
    }
    if (std::fabs(value) > static_cast<T>(kLargestValue)) {
      if (notes.tooLarge++ == 0) notes.firstTooLarge = index;
      return 0;
    }
  }
  const auto result = static_cast<float>(value);
  if (std::fabs(result) < FLT_MIN && value != T(0)) {
    ++notes.denormal;
    return 0;
  }
  noteRounding(value, result, index, notes);
  return result;
}

template <class ValueT>
auto componentOf(const ValueT& value, std::uint32_t component) {
  if constexpr (openvdb::VecTraits<ValueT>::IsVec) {
    return value[static_cast<int>(component)];
  } else {
    return value;
  }
}

std::array<std::int32_t, 3> toArray(const openvdb::Coord& at) {
  return {at.x(), at.y(), at.z()};
}

std::string where(const std::array<std::int32_t, 3>& at) {
  return fmt::format("({}, {}, {})", at[0], at[1], at[2]);
}

std::array<std::int32_t, 3> voxelAt(const std::array<std::int32_t, 3>& origin, std::uint32_t index) {
  return {origin[0] + static_cast<std::int32_t>(index >> 6), origin[1] + static_cast<std::int32_t>(index >> 3 & 7),
          origin[2] + static_cast<std::int32_t>(index & 7)};
}

// One tree of a file, walked once; each component is converted from it.
template <class TreeT>
class TreeSource {
 public:
  using ValueT = typename TreeT::ValueType;
  using LeafT = typename TreeT::LeafNodeType;

  TreeSource(const TreeT& tree, std::string name, std::string what, const ReadContext& context)
      : background_(tree.background()), name_(std::move(name)), what_(std::move(what)), context_(context) {
    collect(tree);
  }

  // False, with a warning, when the component does not fit a float.
  bool convertTo(std::uint32_t component, ImportedGrid& out) const {
    Notes total;
    out.background = convert(componentOf(background_, component), 0, total);
    if (total.nonFinite != 0 && context_.options.nonFinite == NonFinite::error) {
      failNonFinite("the background is not finite");
    }
    total.nonFinite = 0;
    total.rounding = 0;  // it is about voxels
    total.rounded = 0;
    if (total.tooLarge != 0) return warnTooLarge("the background", componentOf(background_, component));
    out.leaves.resize(leaves_.size());
    std::vector<Notes> notes(leaves_.size());
    parallelRanges(leaves_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) {
        convertLeaf(*leaves_[i], component, out.background, out.leaves[i], notes[i]);
      }
    });
    total.min = total.max = out.background;
    for (std::size_t i = 0; i < leaves_.size(); ++i) merge(notes[i], total);
    std::vector<Notes> tileNotes(tiles_.size());
    for (std::size_t i = 0; i < tiles_.size(); ++i) {
      const float value = convert(componentOf(tiles_[i].value, component), 0, tileNotes[i]);
      tileNotes[i].min = tileNotes[i].max = value;
      out.tiles.push_back({tiles_[i].origin, tiles_[i].dim, value});
      merge(tileNotes[i], total);
    }
    out.activeVoxels = activeVoxels_;
    out.min = total.min;
    out.max = total.max;
    return report(component, notes, tileNotes, total);
  }

 private:
  struct TileSource {
    std::array<std::int32_t, 3> origin;
    std::uint32_t dim;
    ValueT value;
  };

  void collect(const TreeT& tree) {
    const auto& root = tree.root();
    for (auto tile = root.cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 4096, *tile);
    for (auto upper = root.cbeginChildOn(); upper; ++upper) {
      for (auto tile = upper->cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 128, *tile);
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        for (auto tile = lower->cbeginValueOn(); tile; ++tile) addTile(tile.getCoord(), 8, *tile);
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) addLeaf(*leaf);
      }
    }
    std::sort(leaves_.begin(), leaves_.end(), [](const LeafT* a, const LeafT* b) { return a->origin() < b->origin(); });
    std::sort(tiles_.begin(), tiles_.end(), [](const TileSource& a, const TileSource& b) {
      return std::tie(a.origin, a.dim) < std::tie(b.origin, b.dim);
    });
  }

  void addTile(const openvdb::Coord& origin, std::uint32_t dim, const ValueT& value) {
    tiles_.push_back({toArray(origin), dim, value});
    activeVoxels_ += std::uint64_t{dim} * dim * dim;
  }

  void addLeaf(const LeafT& leaf) {
    const std::uint64_t active = leaf.onVoxelCount();
    if (active == 0) return;
    leaves_.push_back(&leaf);
    activeVoxels_ += active;
  }

  // Voxel index -> value; a pointer where the leaf has one, for getValue() asks each time whether it is loaded.
  static auto valuesOf(const LeafT& leaf) {
    if constexpr (std::is_same_v<ValueT, bool>) {
      return [&leaf](std::uint32_t i) { return leaf.getValue(i); };
    } else {
      return [data = leaf.buffer().data()](std::uint32_t i) -> const ValueT& { return data[i]; };
    }
  }

  static void convertLeaf(const LeafT& leaf, std::uint32_t component, float background, Leaf& out, Notes& notes) {
    out.origin = toArray(leaf.origin());
    for (std::uint32_t word = 0; word < 8; ++word) {
      const auto bits = leaf.getValueMask().template getWord<std::uint64_t>(word);
      out.active.words[2 * word] = static_cast<std::uint32_t>(bits);
      out.active.words[2 * word + 1] = static_cast<std::uint32_t>(bits >> 32);
    }
    notes.min = std::numeric_limits<float>::max();
    notes.max = std::numeric_limits<float>::lowest();
    const auto values = valuesOf(leaf);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      float value = background;
      if (format::maskBit(out.active, i)) {
        value = convert(componentOf(values(i), component), i, notes);
        notes.min = std::min(notes.min, value);
        notes.max = std::max(notes.max, value);
      }
      out.values[i] = value;
    }
  }

  static void merge(const Notes& from, Notes& into) {
    into.min = std::min(into.min, from.min);
    into.max = std::max(into.max, from.max);
    into.nonFinite += from.nonFinite;
    into.tooLarge += from.tooLarge;
    into.denormal += from.denormal;
    into.rounded += from.rounded;
    into.rounding = std::max(into.rounding, from.rounding);
  }

  bool report(std::uint32_t component, const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
              const Notes& total) const {
    if (total.nonFinite != 0 && context_.options.nonFinite == NonFinite::error) {
      const auto [at, value] = firstWith(component, leafNotes, tileNotes, &Notes::nonFinite, &Notes::firstNonFinite);
      failNonFinite(fmt::format("{} active voxels or tiles are not finite, the first at index {} is {}",
                                total.nonFinite, where(at), value));
    }
    if (total.tooLarge != 0) {
      const auto [at, value] = firstWith(component, leafNotes, tileNotes, &Notes::tooLarge, &Notes::firstTooLarge);
      return warnTooLarge(fmt::format("the voxel at index {}", where(at)), value);
    }
    if (total.denormal != 0) {
      context_.warn(
          fmt::format("{}: {} values are smaller than 1.2e-38 (denormal), which a GPU takes for 0; they are "
                      "set to 0",
                      what_, total.denormal));
    }
    // A millionth of the range: well below what any encoding keeps.
    const double range = static_cast<double>(total.max) - static_cast<double>(total.min);
    if (range > 0 && total.rounding > range * 0x1p-20) {
      context_.warn(fmt::format("{}: {} values are rounded to single precision, by {} at most, at index {}", what_,
                                total.rounded, total.rounding,
                                where(mostRounded(leafNotes, tileNotes, total.rounding))));
    }
    return true;
  }

  std::array<std::int32_t, 3> mostRounded(const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
                                          double rounding) const {
    for (std::size_t i = 0; i < leafNotes.size(); ++i) {
      if (leafNotes[i].rounding == rounding) return voxelAt(toArray(leaves_[i]->origin()), leafNotes[i].mostRounded);
    }
    std::size_t i = 0;
    while (tileNotes[i].rounding != rounding) ++i;
    return tiles_[i].origin;
  }

  struct Found {
    std::array<std::int32_t, 3> at;
    double value;
  };

  Found firstWith(std::uint32_t component, const std::vector<Notes>& leafNotes, const std::vector<Notes>& tileNotes,
                  std::uint32_t Notes::*count, std::uint32_t Notes::*first) const {
    for (std::size_t i = 0; i < leafNotes.size(); ++i) {
      if (leafNotes[i].*count == 0) continue;
      const std::uint32_t index = leafNotes[i].*first;
      return {voxelAt(toArray(leaves_[i]->origin()), index),
              static_cast<double>(componentOf(leaves_[i]->getValue(index), component))};
    }
    std::size_t i = 0;
    while (tileNotes[i].*count == 0) ++i;
    return {tiles_[i].origin, static_cast<double>(componentOf(tiles_[i].value, component))};
  }

  [[noreturn]] void failNonFinite(const std::string& detail) const {
    throw Error(Fault::input, fmt::format("{}: {}; --non-finite zero sets such voxels to 0", what_, detail));
  }

  template <class T>
  bool warnTooLarge(const std::string& place, T value) const {
    context_.warn(
        fmt::format("{}: {} is {}, which single precision cannot hold with room to spare (at most 1e37); the "
                    "grid is skipped",
                    what_, place, static_cast<double>(value)));
    return false;
  }

  ValueT background_;
  std::string name_;
  std::string what_;  // file, frame and grid
  const ReadContext& context_;
  std::vector<const LeafT*> leaves_;
  std::vector<TileSource> tiles_;
  std::uint64_t activeVoxels_ = 0;
};

bool isLevelSet(const VdbGrid& grid) {
  return grid.gridClass == "level set";
}

template <class GridT>
typename GridT::Ptr openvdbGrid(const openvdb::GridBase::Ptr& base, const std::string& what) {
  auto grid = openvdb::gridPtrCast<GridT>(base);
  if (!grid) throw Error(Fault::input, what + ": its type changed while it was read");
  return grid;
}

// Level sets to fog: 1 inside, falling to 0 over the narrow band, 0 and inactive outside.
template <class GridT>
void levelSetToFog(GridT& grid, const std::string& what, const ReadContext& context) {
  if constexpr (std::is_floating_point_v<typename GridT::ValueType>) {
    if (!(grid.background() > 0)) throw Error(Fault::input, what + ": a level set's background must be positive");
    ImportedGrid checked;  // NaN and infinity must be found before they are turned into densities
    TreeSource(grid.tree(), grid.getName(), what, context).convertTo(0, checked);
    openvdb::tools::sdfToFogVolume(grid);
  }
}

// 3x4 row-major. Asked of the map itself: OpenVDB's general matrix refuses voxels of less than 3e-15 cubic units.
std::array<double, 12> matrixOf(const openvdb::math::Transform& transform, const std::string& what) {
  if (!transform.isLinear()) throw Error(Fault::input, what + ": its transform is not affine");
  const openvdb::math::MapBase& map = *transform.baseMap();
  const openvdb::Vec3d columns[4] = {map.applyJacobian({1, 0, 0}), map.applyJacobian({0, 1, 0}),
                                     map.applyJacobian({0, 0, 1}), map.applyMap({0, 0, 0})};
  std::array<double, 12> result{};
  bool sound = true;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double value = columns[column][row] + 0.0;  // no negative zero
      sound = sound && std::isfinite(value);
      result[static_cast<std::size_t>(row) * 4 + static_cast<std::size_t>(column)] = value;
    }
  }
  const double volume = columns[0].dot(columns[1].cross(columns[2]));
  if (!sound || volume == 0 || !std::isfinite(volume)) {
    throw Error(Fault::input, what + ": its transform is singular or not finite");
  }
  return result;
}

template <class GridT>
void readAs(const openvdb::GridBase::Ptr& base, const VdbGrid& info, const std::string& what,
            const ReadContext& context, const std::array<ImportedGrid*, 3>& out, const std::string& file) {
  const auto grid = openvdbGrid<GridT>(base, what);
  const auto matrix = matrixOf(grid->transform(), what);
  if (isLevelSet(info)) levelSetToFog(*grid, what, context);
  const TreeSource source(grid->tree(), info.name, what, context);
  for (std::uint32_t component = 0; component < 3; ++component) {
    ImportedGrid* target = out[component];
    if (target == nullptr) continue;
    *target = ImportedGrid{};
    if (!source.convertTo(component, *target)) {
      *target = ImportedGrid{};
      continue;
    }
    target->present = true;
    target->indexToWorld = matrix;
    target->file = file;
  }
}

using ReadFunction = void (*)(const openvdb::GridBase::Ptr&, const VdbGrid&, const std::string&, const ReadContext&,
                              const std::array<ImportedGrid*, 3>&, const std::string&);

ReadFunction readerOf(format::SourceType type) {
  switch (type) {
    case format::SourceType::float16:
    case format::SourceType::float32:
      return readAs<openvdb::FloatGrid>;
    case format::SourceType::float64:
      return readAs<openvdb::DoubleGrid>;
    case format::SourceType::int32:
      return readAs<openvdb::Int32Grid>;
    case format::SourceType::int64:
      return readAs<openvdb::Int64Grid>;
    case format::SourceType::boolean:
      return readAs<openvdb::BoolGrid>;
    case format::SourceType::mask:
      return readAs<openvdb::MaskGrid>;
    case format::SourceType::vec3f:
      return readAs<openvdb::Vec3SGrid>;
    case format::SourceType::vec3d:
      return readAs<openvdb::Vec3DGrid>;
    case format::SourceType::vec3i:
      return readAs<openvdb::Vec3IGrid>;
  }
  throw Error(Fault::internal, "a source type without a reader");
}

struct GridRegistry : openvdb::GridBase {
  using openvdb::GridBase::registerGrid;
};

// OpenVDB refuses to open a file that names a type it does not know, also where that grid is never read. So such a type
// is registered under its name; nothing is ever made of it, for only grids with a VdbType are read.
void registerTypes(const VdbFile& file) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  openvdb::initialize();
  for (const VdbGrid& grid : file.grids) {
    if (openvdb::GridBase::isRegistered(grid.treeType)) continue;
    GridRegistry::registerGrid(grid.treeType, [] { return openvdb::GridBase::Ptr(openvdb::MaskGrid::create()); });
  }
}

// Runs `read`, turning whatever OpenVDB throws into one line.
template <class Read>
void guarded(const std::string& path, const Read& read) {
  try {
    read();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const openvdb::ArithmeticError& error) {
    throw Error(Fault::input, fmt::format("{}: OpenVDB cannot read it: {}; a transform is singular, or its voxels are "
                                          "too small for OpenVDB (less than 3e-15 cubic units)",
                                          path, error.what()));
  } catch (const std::exception& error) {
    throw Error(Fault::input, fmt::format("{}: damaged: OpenVDB cannot read it: {}", path, error.what()));
  }
}

}  // namespace

void checkImportable(const std::string& path, const VdbGrid& grid, const ImportOptions& options) {
  if (grid.mapType == "NonlinearFrustumMap") {
    throw Error(Fault::input, fmt::format("{}: grid '{}' has a frustum transform; only affine ones can be compiled "
                                          "(resample it, or leave it out with --grid)",
                                          path, grid.name));
  }
  if (!isLevelSet(grid)) return;
  if (!options.sdfToFog) {
    throw Error(Fault::input,
                fmt::format("{}: grid '{}' is a level set (signed distances), not a density; --sdf-to-fog "
                            "converts it",
                            path, grid.name));
  }
  if (grid.type->sourceType == format::SourceType::float32 || grid.type->sourceType == format::SourceType::float64)
    return;
  throw Error(Fault::input, fmt::format("{}: grid '{}' is a level set of type {}; --sdf-to-fog converts float and "
                                        "double",
                                        path, grid.name, grid.treeType));
}

struct VdbReader::Impl {
  explicit Impl(const VdbFile& vdb) : path(vdb.path), file(vdb.path) {}
  std::string path;
  openvdb::io::File file;
};

VdbReader::VdbReader(const VdbFile& file) {
  registerTypes(file);
  impl_ = std::make_unique<Impl>(file);
  guarded(file.path, [&] { impl_->file.open(/*delayLoad=*/false); });
}

VdbReader::~VdbReader() = default;

void VdbReader::read(const VdbGrid& grid, const ReadContext& context, const std::array<ImportedGrid*, 3>& out) {
  const std::string what = fmt::format("{}: frame {}: grid '{}'", impl_->path, context.frame, grid.name);
  guarded(impl_->path, [&] {
    // OpenVDB finds one of several grids of a name only by the form "name[1]".
    const openvdb::GridBase::Ptr base =
        impl_->file.readGrid(openvdb::io::GridDescriptor::nameAsString(grid.uniqueName));
    readerOf(grid.type->sourceType)(base, grid, what, context, out, impl_->path);
  });
}

}  // namespace billow::compiler
