#include "import/vdb_write.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>

#include "billow/format/temp_file.h"
#include "import/vdb_file.h"

namespace billow::compiler {
namespace {

openvdb::Coord toCoord(const std::array<std::int32_t, 3>& at) {
  return {at[0], at[1], at[2]};
}

void putTile(openvdb::FloatTree& tree, const Tile& tile) {
  const openvdb::Coord origin = toCoord(tile.origin);
  const auto dim = static_cast<std::int32_t>(tile.dim);
  const bool aligned =
      std::all_of(tile.origin.begin(), tile.origin.end(), [&](std::int32_t x) { return x % dim == 0; });
  if (aligned) {
    tree.addTile(dim == 8 ? 1 : dim == 128 ? 2 : 3, origin, tile.value, true);
  } else {
    tree.sparseFill(openvdb::CoordBBox::createCube(origin, dim), tile.value, true);
  }
}

void putLeaf(openvdb::FloatTree& tree, const Leaf& leaf) {
  openvdb::FloatTree::LeafNodeType* node = tree.touchLeaf(toCoord(leaf.origin));
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (format::maskBit(leaf.active, i)) {
      node->setValueOn(i, leaf.values[i]);
    } else {
      node->setValueOff(i, leaf.values[i]);
    }
  }
}

openvdb::FloatGrid::Ptr floatGrid(const ImportedGrid& grid) {
  auto result = openvdb::FloatGrid::create(grid.background);
  for (const Tile& tile : grid.tiles) putTile(result->tree(), tile);
  for (const Leaf& leaf : grid.leaves) putLeaf(result->tree(), leaf);
  return result;
}

// The components may keep one region as a tile here and as leaves there, so the union's topology is taken.
openvdb::GridBase::Ptr vectorGrid(const std::array<const ImportedGrid*, 3>& components) {
  std::array<openvdb::FloatGrid::Ptr, 3> parts;
  for (std::size_t c = 0; c < 3; ++c) parts[c] = floatGrid(*components[c]);
  auto result = openvdb::Vec3SGrid::create(
      openvdb::Vec3s(components[0]->background, components[1]->background, components[2]->background));
  for (const auto& part : parts) result->tree().topologyUnion(part->tree());
  const auto x = parts[0]->getConstAccessor(), y = parts[1]->getConstAccessor(), z = parts[2]->getConstAccessor();
  for (auto value = result->tree().beginValueOn(); value; ++value) {
    const openvdb::Coord at = value.getCoord();
    value.setValue(openvdb::Vec3s(x.getValue(at), y.getValue(at), z.getValue(at)));
  }
  return result;
}

openvdb::math::Transform::Ptr transformOf(const std::array<double, 12>& indexToWorld) {
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix(column, row) = indexToWorld[static_cast<std::size_t>(row) * 4 + static_cast<std::size_t>(column)];
    }
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

openvdb::GridBase::Ptr makeGrid(const VdbOutput& output) {
  const bool vector = output.components[1] != nullptr;
  const ImportedGrid& first = *output.components[0];
  openvdb::GridBase::Ptr grid = vector ? vectorGrid(output.components) : floatGrid(first);
  grid->setName(output.name);
  grid->setTransform(transformOf(first.indexToWorld));
  if (output.fogVolume) grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}

// OpenVDB gives each file a random UUID; one from the file's other bytes makes equal grids equal files.
void nameByContent(const std::string& path) {
  constexpr std::streamoff kUuid = 21;  // after magic, versions and the flag for offsets
  constexpr std::size_t kUuidBytes = 36;
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::vector<char> piece(std::size_t{1} << 20);
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  file.seekg(kUuid + static_cast<std::streamoff>(kUuidBytes));
  while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0) {
    XXH3_128bits_update(state.get(), piece.data(), static_cast<std::size_t>(file.gcount()));
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  const std::string uuid =
      fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", hash.high64 >> 32, hash.high64 >> 16 & 0xffff,
                  hash.high64 & 0xffff, hash.low64 >> 48, hash.low64 & 0xffffffffffff);
  file.clear();
  file.seekp(kUuid);
  file.write(uuid.data(), static_cast<std::streamsize>(uuid.size()));
  file.flush();
  if (!file) throw std::runtime_error("its header cannot be changed");
}

// OpenVDB does not always notice a full disk, so what was written is looked at before it gets its name.
void checkWritten(const std::string& path) {
  const VdbFile file = listVdbFile(path);
  for (const VdbGrid& grid : file.grids) checkVdbGrid(file, grid);
}

}  // namespace

void writeVdb(const std::string& path, std::span<const VdbOutput> grids) {
  openvdb::initialize();
  format::TempFile target(path);
  try {
    openvdb::GridPtrVec made;
    for (const VdbOutput& output : grids) made.push_back(makeGrid(output));
    openvdb::io::File file(target.temporaryPath());
    file.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    file.write(made);
    file.close();
    nameByContent(target.temporaryPath());
    checkWritten(target.temporaryPath());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const openvdb::ArithmeticError& error) {
    throw Error(Fault::file, fmt::format("{}: cannot be written: {}; voxels of less than 3e-15 cubic units are too "
                                         "small for OpenVDB",
                                         path, error.what()));
  } catch (const std::exception& error) {
    throw Error(Fault::file, fmt::format("{}: cannot be written: {}", path, error.what()));
  }
  target.commit(std::filesystem::file_size(target.temporaryPath()));
}

}  // namespace billow::compiler
