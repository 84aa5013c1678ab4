// The encodings as a report shows them: those that differ in the packed axis or in bits a voxel are one family.
#ifndef BILLOW_COMMAND_REPORT_ENCODINGS_H
#define BILLOW_COMMAND_REPORT_ENCODINGS_H

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "stages.h"

namespace billow::command {

struct EncodingFamily {
  std::string_view name;
  std::uint32_t first, last;  // encodings, inclusive
  // How many of them, from `first` on, are tried; 1 where encode() itself finds the best one.
  std::uint32_t tried;
  // `effort` 0 to 9 counts where the encoder has efforts.
  void (*encode)(const compiler::BrickSource& brick, std::uint32_t encoding, int effort, compiler::Candidate& out);
};

// The constant is first. Each becomes a curve, so a new encoding's line here is all that it needs.
std::span<const EncodingFamily> encodingFamilies();

// Index of the encoding's family; encodingFamilies().size() for one that has none.
std::size_t familyOf(std::uint32_t encoding);

// "BC7, packed along x"; "uniform, 5 bits".
std::string encodingName(std::uint32_t encoding);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_ENCODINGS_H
