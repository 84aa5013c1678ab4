// What a PLY file says of itself before its values (Greg Turk's format of 1994).
#ifndef BILLOW_COMPILER_IMPORT_PLY_HEADER_H
#define BILLOW_COMPILER_IMPORT_PLY_HEADER_H

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace billow::compiler {

enum class PlyEncoding { ascii, littleEndian, bigEndian };
enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t plyBytes(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;
  std::optional<PlyType> count;  // of a list: how many follow
};

struct PlyElement {
  std::string name;
  std::uint64_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding;
  std::vector<PlyElement> elements;
  std::size_t size;  // bytes before the values
};

// Throws Error(Fault::input). `what` names the file.
PlyHeader readPlyHeader(std::span<const std::byte> bytes, const std::string& what);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_PLY_HEADER_H
