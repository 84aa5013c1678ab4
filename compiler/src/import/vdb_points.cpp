#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>

#include "import/points.h"
#include "import/vdb_file.h"
#include "import/vdb_open.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using openvdb::points::AttributeArray;
using openvdb::points::AttributeHandle;
using openvdb::points::AttributeSet;
using Leaf = openvdb::points::PointDataTree::LeafNodeType;

// Calls `use` with a handle of the array's own type; false where it holds no single numbers.
template <class Use>
bool withNumbers(const AttributeArray& array, const Use& use) {
  const std::string& type = array.type().first;
  if (array.stride() != 1) return false;
  if (type == "float") return use(AttributeHandle<float>(array)), true;
  if (type == "double") return use(AttributeHandle<double>(array)), true;
  if (type == "int32") return use(AttributeHandle<std::int32_t>(array)), true;
  if (type == "int64") return use(AttributeHandle<std::int64_t>(array)), true;
  if (type == "int16") return use(AttributeHandle<std::int16_t>(array)), true;
  if (type == "int8") return use(AttributeHandle<std::int8_t>(array)), true;
  return false;
}

template <class Use>
bool withVectors(const AttributeArray& array, const Use& use) {
  const std::string& type = array.type().first;
  if (array.stride() != 1) return false;
  if (type == "vec3s") return use(AttributeHandle<openvdb::Vec3s>(array)), true;
  if (type == "vec3d") return use(AttributeHandle<openvdb::Vec3d>(array)), true;
  return false;
}

std::array<float, 3> floats(const auto& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

class LeafReader {
 public:
  LeafReader(const std::string& what, const PointAttributes& attributes, const std::array<double, 12>& matrix,
             PointFrame& frame)
      : what_(what), attributes_(attributes), matrix_(matrix), frame_(frame) {}

  void read(const Leaf& leaf) {
    const AttributeSet& set = leaf.attributeSet();
    const AttributeArray* places = set.getConst("P");
    if (set.size() == 0 || (places != nullptr && places->size() == 0)) return;
    if (places == nullptr || !withVectors(*places, [&](const auto& handle) { readPlaces(leaf, *places, handle); })) {
      throw Error(Fault::input, fmt::format("{}: its points have no places 'P' of vectors", what_));
    }
    readNumbers(set, attributes_.radius, frame_.radii);
    readNumbers(set, attributes_.age, frame_.ages);
    readNumbers(set, attributes_.life, frame_.lives);
    readIds(set);
    readColours(set);
  }

 private:
  // By voxels, to whose middles places are relative; the others in the same order.
  template <class Handle>
  void readPlaces(const Leaf& leaf, const AttributeArray& array, const Handle& handle) {
    order_.clear();
    std::uint32_t next = 0;
    for (std::uint32_t voxel = 0; voxel < Leaf::SIZE; ++voxel) {
      const auto end = static_cast<std::uint32_t>(leaf.getValue(voxel));
      if (end < next || end > array.size()) {
        throw Error(Fault::input,
                    fmt::format("{}: damaged: a voxel's points end at {} of {}", what_, end, array.size()));
      }
      const openvdb::Vec3d middle = leaf.offsetToGlobalCoord(voxel).asVec3d();
      for (; next < end; ++next) {
        const auto relative = handle.get(next);
        order_.push_back(next);
        std::array<double, 3> index;
        for (int i = 0; i < 3; ++i) index[static_cast<std::size_t>(i)] = middle[i] + static_cast<double>(relative[i]);
        frame_.places.push_back(world(index));
      }
    }
  }

  std::array<float, 3> world(const std::array<double, 3>& index) const {
    std::array<float, 3> place;
    for (std::size_t row = 0; row < 3; ++row) {
      const double* m = &matrix_[row * 4];
      place[row] = static_cast<float>(m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3]);
    }
    return place;
  }

  // The first of the choice's names that the set has and that `use` takes.
  template <class Use>
  void choose(const AttributeSet& set, const AttributeChoice& choice, const Use& use) const {
    for (const std::string& name : choice.names) {
      const AttributeArray* array = name.empty() ? nullptr : set.getConst(name);
      if (array != nullptr && use(*array)) return;
    }
    if (!choice.required) return;
    std::vector<std::string> names;
    for (const auto& [name, place] : set.descriptor().map()) names.push_back(name);
    std::sort(names.begin(), names.end());
    failWithoutAttribute(what_, choice, names);
  }

  void readNumbers(const AttributeSet& set, const AttributeChoice& choice, std::vector<float>& into) const {
    choose(set, choice, [&](const AttributeArray& array) {
      return withNumbers(array, [&](const auto& handle) {
        for (const std::uint32_t i : order_) into.push_back(static_cast<float>(handle.get(i)));
      });
    });
  }
  void readIds(const AttributeSet& set) const {
    choose(set, attributes_.id, [&](const AttributeArray& array) {
      return withNumbers(array, [&](const auto& handle) {
        for (const std::uint32_t i : order_) frame_.ids.push_back(id(handle.get(i)));
      });
    });
  }
  std::int64_t id(double value) const { return idOf(value, what_, frame_.ids.size()); }
  static std::int64_t id(std::integral auto value) { return value; }

  void readColours(const AttributeSet& set) const {
    choose(set, attributes_.colour, [&](const AttributeArray& array) {
      return withVectors(array, [&](const auto& handle) {
        for (const std::uint32_t i : order_) frame_.colours.push_back(floats(handle.get(i)));
      });
    });
  }

  const std::string& what_;
  const PointAttributes& attributes_;
  const std::array<double, 12>& matrix_;
  PointFrame& frame_;
  std::vector<std::uint32_t> order_;  // of a leaf's points
};

// The point grids that are asked for.
std::vector<VdbGrid> chosenGrids(const VdbFile& file, const std::string& what, const PointAttributes& attributes) {
  std::vector<VdbGrid> grids;
  for (const VdbGrid& grid : file.grids) {
    const auto& names = attributes.grids;
    if (!names.empty() && std::find(names.begin(), names.end(), grid.name) == names.end()) continue;
    if (grid.points) grids.push_back(grid);
  }
  if (!grids.empty()) return grids;
  std::string text =
      fmt::format("{}: no point grid{}; there is:", what, attributes.grids.empty() ? "" : " of that name");
  for (const VdbGrid& grid : file.grids) text += fmt::format(" '{}' of type {}", grid.name, grid.treeType);
  throw Error(Fault::input, text);
}

}  // namespace

PointFrame readVdbPoints(const std::string& path, const std::string& what, const PointAttributes& attributes,
                         std::uint32_t most) {
  const VdbFile file = listVdbFile(path);
  const std::vector<VdbGrid> grids = chosenGrids(file, what, attributes);
  std::uint64_t points = 0;
  for (const VdbGrid& grid : grids) points += checkVdbPoints(file, grid, most - points);
  PointFrame frame;
  registerTypes(file);
  guarded(path, [&] {
    openvdb::io::File opened(path);
    opened.open(/*delayLoad=*/false);
    for (const VdbGrid& info : grids) {
      const auto base = opened.readGrid(openvdb::io::GridDescriptor::nameAsString(info.uniqueName));
      const auto grid = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(base);
      if (!grid) throw Error(Fault::input, what + ": its type changed while it was read");
      const auto matrix = matrixOf(grid->transform(), what);
      LeafReader reader(what, attributes, matrix, frame);
      for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) reader.read(*leaf);
    }
  });
  return frame;
}

}  // namespace billow::compiler
