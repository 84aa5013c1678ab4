// Writing grids as OpenVDB, for `extract` and for tests.
#ifndef BILLOW_COMPILER_IMPORT_VDB_WRITE_H
#define BILLOW_COMPILER_IMPORT_VDB_WRITE_H

#include <array>
#include <span>
#include <string>

#include "stages.h"

namespace billow::compiler {

struct VdbOutput {
  std::string name;
  bool fogVolume = false;  // the grid class that is written; else none
  // One for a FloatGrid, three (x, y, z) for a Vec3SGrid. Their tiles need not be aligned to their size.
  std::array<const ImportedGrid*, 3> components{};
};

// Writes the grids with the topology they have: leaves with their masks, tiles as active tiles. To a temporary name
// beside `path`, then renamed. Throws Error(Fault::file).
void writeVdb(const std::string& path, std::span<const VdbOutput> grids);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_WRITE_H
