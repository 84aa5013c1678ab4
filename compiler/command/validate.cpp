#include "billow/format/validate.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "command.h"

namespace billow::command {
namespace {

struct Arguments {
  std::string pack;
  std::string outputFormat = "text";
  bool warningsAsErrors = false;
  unsigned threads = 0;
};

struct Findings {
  std::vector<format::Issue> issues;
  std::size_t errors = 0;
  std::size_t warnings = 0;
  bool unreadable = false;
};

Findings examine(const format::ByteSource& source, const Arguments& arguments) {
  Findings found;
  format::ValidateOptions options;
  options.threads = arguments.threads;
  format::validate(source, options, [&](const format::Issue& issue) {
    ++(issue.kind->severity == format::Severity::error ? found.errors : found.warnings);
    // Ids below 100 are about getting at the bytes.
    found.unreadable = found.unreadable || issue.kind->id < 100;
    found.issues.push_back(issue);
  });
  return found;
}

nlohmann::ordered_json toJson(const format::Issue& issue) {
  nlohmann::ordered_json json;
  json["id"] = issue.kind->id;
  json["severity"] = issue.kind->severity == format::Severity::error ? "error" : "warning";
  json["name"] = issue.kind->name;
  json["rule"] = issue.kind->summary;
  json["detail"] = issue.detail;
  const format::Place& place = issue.place;
  if (!place.section.empty()) json["section"] = place.section;
  if (place.offset) json["offset"] = *place.offset;
  if (place.page) json["page"] = *place.page;
  if (place.volume) json["volume"] = *place.volume;
  if (place.frame) json["frame"] = *place.frame;
  if (place.grid) json["grid"] = *place.grid;
  if (!place.nodeKind.empty()) json["nodeKind"] = place.nodeKind;
  if (place.node) json["node"] = *place.node;
  return json;
}

void printJson(const Arguments& arguments, const Findings& found, bool valid) {
  nlohmann::ordered_json json;
  json["pack"] = arguments.pack;
  json["valid"] = valid;
  json["errors"] = found.errors;
  json["warnings"] = found.warnings;
  json["issues"] = nlohmann::ordered_json::array();
  for (const format::Issue& issue : found.issues) json["issues"].push_back(toJson(issue));
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void printText(const Arguments& arguments, const Findings& found) {
  for (const format::Issue& issue : found.issues) {
    fmt::print("{}: {} {}\n", arguments.pack, format::toString(issue), issue.kind->summary);
  }
  if (found.issues.empty()) return;
  fmt::print("{}: {} error{}, {} warning{}{}\n", arguments.pack, found.errors, found.errors == 1 ? "" : "s",
             found.warnings, found.warnings == 1 ? "" : "s",
             found.issues.size() == format::ValidateOptions{}.maxIssues ? "; stopped counting" : "");
}

int runValidate(const Arguments& arguments) {
  const auto source = format::openFileSource(arguments.pack);
  if (!source) {
    if (arguments.outputFormat == "json") printJson(arguments, {{source.error()}, 1, 0, true}, false);
    return reportIssue(arguments.pack, source.error());
  }
  const Findings found = examine(**source, arguments);
  const bool valid = found.errors == 0 && (found.warnings == 0 || !arguments.warningsAsErrors);
  if (arguments.outputFormat == "json") {
    printJson(arguments, found, valid);
  } else {
    printText(arguments, found);
  }
  if (valid) return kDone;
  return found.unreadable ? kFile : kInvalid;
}

}  // namespace

void addValidate(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("validate", "Check that a pack is sound; silent when it is");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("PACK", arguments->pack, "The .blw file")->required();
  command->add_option("--format", arguments->outputFormat, "How issues are printed")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command->add_flag("--warnings-as-errors", arguments->warningsAsErrors, "Exit with 3 for warnings too");
  command->add_option("--threads", arguments->threads, "Threads to use (0: all cores)")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command->footer(
      "Checks every byte and every rule of spec/format.md; each issue has a number that spec/issues.md explains.\n"
      "Exit codes: 0 sound, 1 command line, 2 the file cannot be read, 3 not sound.");
  command->callback([&run, arguments] { run = [arguments] { return runValidate(*arguments); }; });
}

}  // namespace billow::command
