// Volumes, frames and grids of a pack by what users call them.
#ifndef BILLOW_COMMAND_PACK_LOOKUP_H
#define BILLOW_COMMAND_PACK_LOOKUP_H

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tl/expected.hpp>

#include "billow/format/pack.h"

namespace billow::command {

// The index of the volume with this name, or of its level with voxels 2^level times as long; "" takes the only one that
// is no level. The error is a sentence for the user that lists what there is.
tl::expected<std::uint32_t, std::string> findVolume(const format::Pack& pack, const std::string& name,
                                                    std::uint32_t level = 0);

// The same for effects.
tl::expected<std::uint32_t, std::string> findEffect(const format::Pack& pack, const std::string& name);

// The index of frame `number` in the volume's frames, or -1.
std::ptrdiff_t findFrame(const format::Pack& pack, const format::VolumeRecord& volume, std::int32_t number);

// The index of the grid with this name in the volume's grids, or -1.
std::ptrdiff_t findGrid(const format::Pack& pack, const format::VolumeRecord& volume, const std::string& name);

// The names of the volume's grids, for messages.
std::string gridNames(const format::Pack& pack, const format::VolumeRecord& volume);

// Whether both paths lead to one existing file: an output that would take an input's place.
bool sameFile(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_PACK_LOOKUP_H
