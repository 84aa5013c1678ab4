// PLY files for tests, in each encoding.
#ifndef BILLOW_TESTS_PLY_FILE_H
#define BILLOW_TESTS_PLY_FILE_H

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace billow::tests {

struct PlyColumn {
  std::string type, name;
  std::vector<double> values;
};

// The text of a file whose vertices have these properties. Before them it has an element with lists, which readers must
// pass over; among the vertices' properties is a list too where `lists`.
inline std::string plyText(const std::string& encoding, const std::vector<PlyColumn>& columns, bool lists = false) {
  const std::size_t count = columns.empty() ? 0 : columns[0].values.size();
  std::ostringstream out;
  out.precision(17);
  out << "ply\nformat " << encoding << " 1.0\ncomment made by a test\r\nelement face 2\n"
      << "property list uchar int vertex_indices\nproperty ushort material\nelement vertex " << count << "\n";
  for (const PlyColumn& column : columns) out << "property " << column.type << " " << column.name << "\n";
  if (lists) out << "property list uint8 float weights\n";
  out << "element tail 1\nproperty float unread\nend_header\n";
  const bool ascii = encoding == "ascii", big = encoding == "binary_big_endian";
  const auto bytes = [&](const auto& value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (big) std::reverse(raw, raw + sizeof value);
    out.write(raw, sizeof value);
  };
  const auto put = [&](const std::string& type, double value) {
    if (ascii) {
      out << value << " ";
    } else if (type == "char" || type == "int8") {
      bytes(static_cast<std::int8_t>(value));
    } else if (type == "uchar" || type == "uint8") {
      bytes(static_cast<std::uint8_t>(value));
    } else if (type == "short" || type == "int16") {
      bytes(static_cast<std::int16_t>(value));
    } else if (type == "ushort" || type == "uint16") {
      bytes(static_cast<std::uint16_t>(value));
    } else if (type == "int" || type == "int32") {
      bytes(static_cast<std::int32_t>(value));
    } else if (type == "uint" || type == "uint32") {
      bytes(static_cast<std::uint32_t>(value));
    } else if (type == "double" || type == "float64") {
      bytes(value);
    } else {
      bytes(static_cast<float>(value));
    }
  };
  const auto endLine = [&] {
    if (ascii) out << "\n";
  };
  for (int face = 0; face < 2; ++face) {
    put("uchar", 3 - face);
    for (int i = 0; i < 3 - face; ++i) put("int", i);
    put("ushort", 7);
    endLine();
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (const PlyColumn& column : columns) put(column.type, column.values[i]);
    if (lists) {
      put("uint8", static_cast<double>(i % 3));
      for (std::size_t w = 0; w < i % 3; ++w) put("float", 0.5);
    }
    endLine();
  }
  put("float", 1);
  endLine();
  return out.str();
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_PLY_FILE_H
