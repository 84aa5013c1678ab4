// The encodings' names in JSON and in short lists.
#ifndef BILLOW_COMMAND_ENCODING_KEYS_H
#define BILLOW_COMMAND_ENCODING_KEYS_H

#include <array>

#include "billow/format/layout.h"

namespace billow::command {

inline constexpr std::array<const char*, format::kEncodingCount> kEncodingKeys = {
    "constant", "bc7z",     "bc7y",     "bc7x",     "uniform1", "uniform2",  "uniform3",
    "uniform4", "uniform5", "uniform6", "uniform7", "uniform8", "uniform16", "local2",
    "local3",   "local4",   "local5",   "local6",   "coarse"};

}  // namespace billow::command

#endif  // BILLOW_COMMAND_ENCODING_KEYS_H
