// Options that say how a source is read, the same for `compile` and `compare`.
#ifndef BILLOW_COMMAND_IMPORT_OPTIONS_H
#define BILLOW_COMMAND_IMPORT_OPTIONS_H

#include <CLI/CLI.hpp>
#include <string>

#include "stages.h"

namespace billow::command {

// Raw texts as given; importOptions() below makes sense of them.
struct ImportArguments {
  compiler::ImportOptions options;
  std::string frames;
  std::string missing = "error";
  std::string nonFinite = "error";
};

void addImportOptions(CLI::App& command, ImportArguments& arguments);

// Throws compiler::Error(commandLine) where a text cannot be understood.
compiler::ImportOptions importOptions(const ImportArguments& arguments);

// Refuses NaN and infinity, which CLI11's own ranges let pass.
CLI::Validator finiteNumber();

// "billow: warning: ..." on stderr, the same text once; may be called from any thread.
void printWarning(const std::string& text);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_IMPORT_OPTIONS_H
