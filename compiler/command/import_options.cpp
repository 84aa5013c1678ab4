#include "import_options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <set>
#include <string_view>

#include "progress.h"

namespace billow::command {
namespace {

// Takes a number off the front of `text`.
bool takeNumber(std::string_view& text, std::int32_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool takeCharacter(std::string_view& text, char character) {
  if (text.empty() || text.front() != character) return false;
  text.remove_prefix(1);
  return true;
}

// A, A-B or A-B:STEP.
bool parseFrames(std::string_view text, compiler::ImportOptions& options) {
  std::int32_t first = 0;
  if (!takeNumber(text, first)) return false;
  std::int32_t last = first;
  std::int32_t step = 1;
  if (takeCharacter(text, '-') && !takeNumber(text, last)) return false;
  if (takeCharacter(text, ':') && !takeNumber(text, step)) return false;
  if (!text.empty() || last < first || step < 1) return false;
  options.firstFrame = first;
  options.lastFrame = last;
  options.frameStep = step;
  return true;
}

}  // namespace

CLI::Validator finiteNumber() {
  return CLI::Validator(
      [](std::string& text) {
        double number = 0;
        const bool finite = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
        return finite ? std::string() : text + " is not a finite number";
      },
      "");
}

void addImportOptions(CLI::App& command, ImportArguments& arguments) {
  command.add_option("--grid", arguments.options.grids, "Take only this grid; may be given several times")
      ->type_name("NAME");
  command
      .add_option("--frames", arguments.frames, "Take only frames A to B, every STEPth; numbered as the source does")
      ->type_name("A-B[:STEP]");
  command
      .add_option("--missing", arguments.missing,
                  "A frame missing from the sequence is an error, repeats the frame before (hold), or is empty "
                  "(blank)")
      ->check(CLI::IsMember({"error", "hold", "blank"}))
      ->capture_default_str();
  command.add_option("--non-finite", arguments.nonFinite, "A NaN or infinite voxel is an error, or becomes zero")
      ->check(CLI::IsMember({"error", "zero"}))
      ->capture_default_str();
  command.add_flag("--sdf-to-fog", arguments.options.sdfToFog, "Convert level sets (signed distances) to fog volumes");
}

compiler::ImportOptions importOptions(const ImportArguments& arguments) {
  compiler::ImportOptions options = arguments.options;
  if (!arguments.frames.empty() && !parseFrames(arguments.frames, options)) {
    throw compiler::Error(
        compiler::Fault::commandLine,
        fmt::format("--frames {}: expected A-B or A-B:STEP with A <= B and STEP >= 1, such as 10-50:2",
                    arguments.frames));
  }
  if (arguments.missing == "hold") options.missing = compiler::MissingFrames::hold;
  if (arguments.missing == "blank") options.missing = compiler::MissingFrames::blank;
  if (arguments.nonFinite == "zero") options.nonFinite = compiler::NonFinite::zero;
  return options;
}

void printWarning(const std::string& text) {
  static std::mutex mutex;
  static std::set<std::string> said;
  const std::lock_guard lock(mutex);
  if (!said.insert(text).second) return;
  printLine("billow: warning: " + text);
}

}  // namespace billow::command
