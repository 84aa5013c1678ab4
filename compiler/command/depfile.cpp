#include "depfile.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "import_options.h"
#include "stages.h"

namespace billow::command {
namespace {

// Backslashes count before a space or '#' alone, and are doubled there.
std::string escaped(const std::string& name) {
  std::string text;
  std::size_t backslashes = 0;
  for (const char c : name) {
    if (c == '\n') {
      throw compiler::Error(compiler::Fault::input, "--depfile: a file's name has a line break, which no rule can say");
    }
    if (c == ' ' || c == '#' || c == '\t') text += std::string(backslashes + 1, '\\');
    if (c == '$') text += '$';
    text += c;
    backslashes = c == '\\' ? backslashes + 1 : 0;
  }
  return text;
}

bool holds(const std::string& folder, const std::string& file) {
  std::error_code ignored;
  const std::filesystem::path parent = std::filesystem::path(file).parent_path();
  return std::filesystem::equivalent(folder, parent.empty() ? "." : parent, ignored);
}

}  // namespace

void writeDepfile(const std::string& path, const std::string& output, const std::set<std::string>& inputs) {
  std::string rule = escaped(output) + ":";
  for (const std::string& input : inputs) {
    if (holds(input, output)) {
      printWarning(
          fmt::format("--depfile: the pack lies in {}, which is searched for inputs: a build will not see ones that "
                      "come or go there",
                      input));
      continue;
    }
    rule += " \\\n  " + escaped(input);
  }
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << rule << '\n';
  file.close();
  if (!file) throw compiler::Error(compiler::Fault::file, path + ": cannot be written");
  // Make takes a depfile that is newer than its output for news, and would compile once more.
  std::error_code ignored;
  std::filesystem::last_write_time(path, std::filesystem::last_write_time(output, ignored), ignored);
}

}  // namespace billow::command
