// What is in a .vdb file, found without OpenVDB, and whether OpenVDB may be let near it.
//
// OpenVDB trusts the counts and sizes in a file: a damaged one can make it loop for minutes, allocate without bound or
// report "no grids" for half a header. So every file is listed by the code here, and every grid is walked (structure
// only, nothing is decompressed) before OpenVDB reads it. The walk costs a few per cent of the read.
#ifndef BILLOW_COMPILER_IMPORT_VDB_FILE_H
#define BILLOW_COMPILER_IMPORT_VDB_FILE_H

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "billow/format/layout.h"

namespace billow::compiler {

// A value type that can be compiled, as trees of 32^3, 16^3, 8^3 children store it.
struct VdbType {
  std::string_view tree;  // OpenVDB's name without the suffix for half: "Tree_float_5_4_3"
  format::SourceType sourceType;
  std::uint32_t valueBytes;  // of one value in a node
  std::uint32_t halfBytes;   // of one value when the grid is saved as half
  std::uint32_t components;  // 1 or 3
  bool bits;                 // leaves hold bit masks, not values (bool, mask)
};

struct VdbGrid {
  std::string uniqueName;  // as the file has it: the name, and a number where several grids share it
  std::string name;        // "density"; without a name "unnamed"; repeated ones get _1, _2, ... in the file's order
  std::string treeType;    // without the suffix for half
  bool half = false;
  bool halfFlag = false;          // the same, as the metadata say it
  std::string instanceParent;     // unique name of the grid whose tree this one shares, or ""
  const VdbType* type = nullptr;  // null: cannot be compiled
  bool points = false;            // a point grid: particles (points.h), no volume
  std::string gridClass;          // "fog volume", "level set", ... or "" where not known
  std::string mapType;            // "UniformScaleMap", ...; "" where the type cannot be compiled
  std::uint32_t compression = 0;  // OpenVDB's flags: 1 zip, 2 active mask, 4 blosc
  std::uint64_t treeOffset = 0;   // of the tree's first byte
  std::uint64_t endOffset = 0;
};

struct VdbFile {
  std::string path;
  std::uint32_t version = 0;
  std::vector<VdbGrid> grids;  // in the file's order
};

// Lists a file's grids: header, metadata and descriptors only. Every offset is checked against the file's size.
// Throws Error: Fault::file when the bytes cannot be read, Fault::input when they are no sound OpenVDB file.
VdbFile listVdbFile(const std::string& path);

// The source type of a grid ("half" included).
format::SourceType sourceTypeOf(const VdbGrid& grid);

// Walks the nodes of a grid whose type is not null; throws Error(Fault::input) at the first size, count or offset that
// cannot be right. What is left for OpenVDB to find is the contents of compressed blocks.
void checkVdbGrid(const VdbFile& file, const VdbGrid& grid);

// The same for a point grid, whose points it counts. Throws Error(Fault::input) also where they are more than `most`.
std::uint64_t checkVdbPoints(const VdbFile& file, const VdbGrid& grid, std::uint64_t most);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_FILE_H
