#include "import/frame_choice.h"

#include <charconv>
#include <string>

namespace billow::compiler {

void readFrames(const json::Value& node, ImportOptions& options) {
  constexpr const char* kExpected = "frames as \"A-B\" or \"A-B:STEP\", with 0 <= A <= B and STEP of 1 or more";
  const std::string text = node.text(kExpected);
  const char* at = text.data();
  const char* end = at + text.size();
  const auto number = [&] {
    std::int32_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || value < 0) node.fail(kExpected);
    at = next;
    return value;
  };
  const auto follows = [&](char separator) { return at != end && *at == separator && (++at, true); };
  const std::int32_t first = number();
  const std::int32_t last = follows('-') ? number() : first;
  const std::int32_t step = follows(':') ? number() : 1;
  if (at != end || last < first || step < 1) node.fail(kExpected);
  if (options.firstFrame || options.lastFrame) return;
  options.firstFrame = first;
  options.lastFrame = last;
  options.frameStep = step;
}

void readMissing(const json::Value& node, ImportOptions& options) {
  static constexpr MissingFrames kMeanings[] = {MissingFrames::error, MissingFrames::hold, MissingFrames::blank};
  const MissingFrames missing = kMeanings[node.word({"error", "hold", "blank"})];
  if (options.missing == MissingFrames::error) options.missing = missing;
}

}  // namespace billow::compiler
