// What a pack depends on, for build systems.
#ifndef BILLOW_COMMAND_DEPFILE_H
#define BILLOW_COMMAND_DEPFILE_H

#include <set>
#include <string>

namespace billow::command {

// Writes a rule of make, `output: inputs`, as GCC escapes it; make, Ninja and CMake read it. The folder in which the
// pack lies is left out of the inputs, with a warning: writing the pack changes it. Throws compiler::Error(file) where
// it cannot be written, (input) where a name has a line break, which no rule can say.
void writeDepfile(const std::string& path, const std::string& output, const std::set<std::string>& inputs);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_DEPFILE_H
