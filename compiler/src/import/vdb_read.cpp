#include "import/vdb_read.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include "import/tree_source.h"
#include "import/vdb_open.h"

namespace billow::compiler {
namespace {

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
