// The structural walk over one grid's tree in a .vdb file.
#ifndef BILLOW_COMPILER_IMPORT_VDB_WALK_H
#define BILLOW_COMPILER_IMPORT_VDB_WALK_H

#include "import/byte_reader.h"
#include "import/vdb_file.h"

namespace billow::compiler {

// Walks topology and buffers from the reader's position (the tree's first byte) to the byte after the tree. Nothing is
// decompressed; memory is two bytes a leaf. Throws Error(Fault::input).
void walkTree(ByteReader& reader, const VdbGrid& grid);

// The topology alone, of a tree whose nodes hold four bytes a value: returns the number of leaves.
std::size_t walkPointTopology(ByteReader& reader, const VdbGrid& grid);

// Skips a Blosc chunk of `stored` bytes whose header must say that it holds `raw` bytes: Blosc itself believes the
// sizes in there.
void skipBlosc(ByteReader& reader, std::uint64_t stored, std::uint64_t raw);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_WALK_H
