// The structural walk over one point grid in a .vdb file.
#ifndef BILLOW_COMPILER_IMPORT_VDB_POINTS_WALK_H
#define BILLOW_COMPILER_IMPORT_VDB_POINTS_WALK_H

#include <cstdint>

#include "import/byte_reader.h"
#include "import/vdb_file.h"

namespace billow::compiler {

// Walks a point grid from its tree's first byte to the byte after it, as OpenVDB reads it: the sizes of all arrays of
// attributes, and that each lies whole in the pages that hold it. Nothing is decompressed. Returns the number of
// points. Throws Error(Fault::input), also where there are more than `most`.
std::uint64_t walkPoints(ByteReader& reader, const VdbGrid& grid, std::uint64_t most);

// Passes over metadata as a file, a grid or a set of attributes has them. (In vdb_file.cpp.)
void skipMetadata(ByteReader& reader);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_POINTS_WALK_H
