#include "report/encodings.h"

#include <fmt/format.h>

#include <iterator>

namespace billow::command {
namespace {

using compiler::BrickSource;
using compiler::Candidate;

constexpr EncodingFamily kFamilies[] = {
    {"constant", format::kEncodingConstant, format::kEncodingConstant, 1,
     [](const BrickSource& brick, std::uint32_t, int, Candidate& out) { compiler::encodeConstant(brick, out); }},
    {"BC7", format::kEncodingBc7Z, format::kEncodingBc7X, 1,
     [](const BrickSource& brick, std::uint32_t, int effort, Candidate& out) {
       compiler::encodeBc7BestAxis(brick, effort, out);
     }},
    {"uniform", format::kEncodingUniform1, format::kEncodingUniform16,
     format::kEncodingUniform16 - format::kEncodingUniform1 + 1,
     [](const BrickSource& brick, std::uint32_t encoding, int, Candidate& out) {
       compiler::encodeUniform(brick, format::indexBits(encoding), out);
     }},
    {"local", format::kEncodingLocal2, format::kEncodingLocal6, format::kEncodingLocal6 - format::kEncodingLocal2 + 1,
     [](const BrickSource& brick, std::uint32_t encoding, int, Candidate& out) {
       compiler::encodeLocal(brick, format::indexBits(encoding), out);
     }},
    {"coarse", format::kEncodingCoarse, format::kEncodingCoarse, 1,
     [](const BrickSource& brick, std::uint32_t, int, Candidate& out) { compiler::encodeCoarse(brick, out); }},
};

}  // namespace

std::span<const EncodingFamily> encodingFamilies() {
  return kFamilies;
}

std::size_t familyOf(std::uint32_t encoding) {
  for (std::size_t f = 0; f < std::size(kFamilies); ++f) {
    if (encoding >= kFamilies[f].first && encoding <= kFamilies[f].last) return f;
  }
  return std::size(kFamilies);
}

std::string encodingName(std::uint32_t encoding) {
  const std::size_t family = familyOf(encoding);
  if (family == std::size(kFamilies)) return fmt::format("encoding {}", encoding);
  const std::string name(kFamilies[family].name);
  if (format::isBc7(encoding)) return fmt::format("{}, packed along {}", name, "xyz"[format::packedAxis(encoding)]);
  const std::uint32_t bits = format::indexBits(encoding);
  return bits == 0 ? name : fmt::format("{}, {} bit{} a voxel", name, bits, bits == 1 ? "" : "s");
}

}  // namespace billow::command
