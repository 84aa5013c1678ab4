#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include "command.h"
#include "render_request.h"

namespace billow::command {
namespace {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <class T>
std::optional<T> parseNumber(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::array<double, 3>> parseVector(std::string_view text) {
  const auto parts = split(text, ',');
  if (parts.size() != 3) return std::nullopt;
  std::array<double, 3> values;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = parseNumber<double>(parts[i]);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    values[i] = *value;
  }
  return values;
}

bool within(const std::array<double, 3>& values, const Bounds& bounds) {
  return std::all_of(values.begin(), values.end(),
                     [&](double value) { return value >= bounds.low && value <= bounds.high; });
}

Triple toTriple(const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

tl::unexpected<Refusal> refuse(const char* option, const std::string& text, const std::string& expected) {
  return tl::unexpected(Refusal{kCommandLine, fmt::format("{} is \"{}\"; expected {}", option, text, expected)});
}

}  // namespace

Checked<void> parseFrames(const std::string& text, RenderRequest& request) {
  static constexpr const char* kExpected = "a frame number, or a range such as 5-12";
  // A minus after the first digit separates; before it, it is a sign.
  const std::size_t dash = text.find('-', 1);
  const auto first = parseNumber<std::int32_t>(std::string_view(text).substr(0, dash));
  if (!first) return refuse("--frame", text, kExpected);
  request.firstFrame = request.lastFrame = *first;
  request.range = dash != std::string::npos;
  if (!request.range) return {};
  const auto last = parseNumber<std::int32_t>(std::string_view(text).substr(dash + 1));
  if (!last || *last < *first) return refuse("--frame", text, kExpected);
  request.lastFrame = *last;
  return {};
}

Checked<void> parseSize(const std::string& text, RenderRequest& request) {
  const auto parts = split(text, 'x');
  const auto edge = [](std::string_view digits) { return parseNumber<std::uint32_t>(digits).value_or(0); };
  request.width = edge(parts.front());
  request.height = parts.size() == 2 ? edge(parts.back()) : 0;
  const auto fits = [](std::uint32_t pixels) { return pixels >= 1 && pixels <= kLargestPicture; };
  if (!fits(request.width) || !fits(request.height)) {
    return refuse("--size", text, "WIDTHxHEIGHT in pixels, such as 1280x720, each from 1 to 16384");
  }
  return {};
}

Checked<void> parseCamera(const std::string& text, RenderRequest& request) {
  static constexpr const char* kExpected = "eyeX,eyeY,eyeZ:targetX,targetY,targetZ, perhaps :degrees from 1 to 170";
  const auto parts = split(text, ':');
  if (parts.size() < 2 || parts.size() > 3) return refuse("--camera", text, kExpected);
  const auto eye = parseVector(parts[0]);
  const auto target = parseVector(parts[1]);
  if (!eye || !target || *eye == *target) return refuse("--camera", text, kExpected);
  request.camera.eye = *eye;
  request.camera.target = *target;
  if (parts.size() == 2) return {};
  const auto degrees = parseNumber<float>(parts[2]);
  if (!degrees || !(*degrees >= 1 && *degrees <= 170)) return refuse("--camera", text, kExpected);
  request.camera.fieldOfView = *degrees;
  return {};
}

Checked<void> parseBackground(const std::string& text, RenderRequest& request) {
  BackgroundRequest& background = request.background;
  if (text == "none") {
    background.kind = BackgroundRequest::Kind::none;
    return {};
  }
  const auto parts = split(text, ':');
  const auto bottom = parseVector(parts.front());
  const auto top = parseVector(parts.back());
  const Bounds bounds{0, kLargest};
  if (parts.size() > 2 || !bottom || !top || !within(*bottom, bounds) || !within(*top, bounds)) {
    return refuse("--background", text, "none, r,g,b, or r,g,b:r,g,b (bottom and top, linear, each 0 or more)");
  }
  background = {BackgroundRequest::Kind::colors, toTriple(*bottom), toTriple(*top)};
  return {};
}

Checked<Triple> parseTriple(const std::string& text, const char* option, const Bounds& bounds) {
  const auto vector = parseVector(text);
  if (!vector || !within(*vector, bounds)) {
    return refuse(option, text,
                  fmt::format("three numbers such as 1,0.5,0, each from {} to {}", bounds.low, bounds.high));
  }
  return toTriple(*vector);
}

}  // namespace billow::command
