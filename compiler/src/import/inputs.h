// From what the user typed to numbered frames and files. File names only; nothing is opened.
#ifndef BILLOW_COMPILER_IMPORT_INPUTS_H
#define BILLOW_COMPILER_IMPORT_INPUTS_H

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "stages.h"

namespace billow::compiler {

// Frame number -> the files whose grids make up that frame.
using NumberedFiles = std::map<std::int32_t, std::vector<std::string>>;

// Expands files, directories (their *.vdb, hidden ones left out), globs, name_####.vdb and name_%04d.vdb. A frame's
// number is the last number in a file's name, or what stands at a pattern's place. Files whose names differ in more
// than the number are merged frame by frame when they count the same frames. One file alone is frame 0 unless a number
// ends its name. Throws Error: Fault::file when nothing is there, Fault::input when the names do not make a sequence.
NumberedFiles findFiles(const std::vector<std::string>& inputs);

// The frames that the options ask for, gaps treated as they say. Throws Error(Fault::input) naming missing numbers.
std::vector<PlannedFrame> selectFrames(const NumberedFiles& files, const ImportOptions& options);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_INPUTS_H
