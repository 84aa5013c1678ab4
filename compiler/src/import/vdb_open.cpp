#include "import/vdb_open.h"

#include <cmath>
#include <mutex>

namespace billow::compiler {
namespace {

struct GridRegistry : openvdb::GridBase {
  using openvdb::GridBase::registerGrid;
};

}  // namespace

void registerTypes(const VdbFile& file) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  openvdb::initialize();
  for (const VdbGrid& grid : file.grids) {
    if (openvdb::GridBase::isRegistered(grid.treeType)) continue;
    GridRegistry::registerGrid(grid.treeType, [] { return openvdb::GridBase::Ptr(openvdb::MaskGrid::create()); });
  }
}

// Asked of the map itself: OpenVDB's general matrix refuses voxels of less than 3e-15 cubic units.
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

}  // namespace billow::compiler
