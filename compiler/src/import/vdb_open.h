// What reading grids and reading points share of OpenVDB.
#ifndef BILLOW_COMPILER_IMPORT_VDB_OPEN_H
#define BILLOW_COMPILER_IMPORT_VDB_OPEN_H

#include <fmt/format.h>
#include <openvdb/openvdb.h>

#include <array>
#include <exception>
#include <new>
#include <string>

#include "import/vdb_file.h"
#include "stages.h"

namespace billow::compiler {

// OpenVDB refuses to open a file that names a type it does not know, also where that grid is never read. So such a type
// is registered under its name; nothing is ever made of it, for only grids with a VdbType or points are read.
void registerTypes(const VdbFile& file);

// 3x4 row-major. Throws Error(Fault::input) where it is not affine, singular or not finite.
std::array<double, 12> matrixOf(const openvdb::math::Transform& transform, const std::string& what);

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

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_OPEN_H
