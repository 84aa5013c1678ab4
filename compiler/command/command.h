// The `billow` command: one file a sub-command, each a few lines over the libraries.
#ifndef BILLOW_COMMAND_COMMAND_H
#define BILLOW_COMMAND_COMMAND_H

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "billow/format/issue.h"

namespace billow::command {

// Exit codes, listed in every --help and in README.
enum Exit : int {
  kDone = 0,
  kCommandLine = 1,
  kFile = 2,     // a file cannot be read or written
  kInvalid = 3,  // the input or pack is invalid
  kGpu = 4,      // no usable GPU, or it failed
  kInternal = 5  // our own fault
};

// Each add… declares a sub-command with its options; when it is the one called, its callback stores in `run` what to
// do, which returns an exit code. main() prints what escapes (compiler::Error and others) as "billow: error: ..." on
// stderr and maps it to an exit code.
using Run = std::function<int()>;

void addCompile(CLI::App& app, Run& run);
void addInfo(CLI::App& app, Run& run);
void addValidate(CLI::App& app, Run& run);
void addExtract(CLI::App& app, Run& run);
void addCompare(CLI::App& app, Run& run);
void addRender(CLI::App& app, Run& run);
void addView(CLI::App& app, Run& run);

// Prints "billow: error: PATH: ..." to stderr and returns the exit code: kFile when the bytes could not be read, else
// kInvalid.
int reportIssue(const std::string& path, const format::Issue& issue);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_COMMAND_H
