// What `billow compile` says of what it chose: encodings, bricks, bytes, error.
#ifndef BILLOW_COMMAND_COMPILE_REPORT_H
#define BILLOW_COMMAND_COMPILE_REPORT_H

#include <nlohmann/json.hpp>
#include <string>

#include "compile.h"

namespace billow::command {

// A table for each grid, to stdout.
void printReport(const compiler::CompileReport& report, const std::string& output);

nlohmann::ordered_json reportJson(const compiler::CompileReport& report, const std::string& output);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_COMPILE_REPORT_H
