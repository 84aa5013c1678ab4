#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>

#include "billow/format/source.h"
#include "billow/format/text.h"
#include "import/roles.h"
#include "import/volume_request.h"

namespace billow::compiler {
namespace {

using nlohmann::json;

// A value in the manifest together with where it stands, so that every complaint names the place.
class Node {
 public:
  Node(const json& value, const std::string& file, std::string path)
      : value_(value), file_(file), path_(std::move(path)) {}

  // "FILE: /volumes/0", for messages.
  std::string place() const { return fmt::format("{}: {}", file_, path_.empty() ? "/" : path_); }

  [[noreturn]] void fail(const std::string& expected) const {
    std::string text = value_.dump(-1, ' ', false, json::error_handler_t::replace);
    if (text.size() > 80) text = text.substr(0, 77) + "...";
    throw Error(Fault::input,
                fmt::format("{}: {}: found {}, expected {}", file_, path_.empty() ? "/" : path_, text, expected));
  }

  // An object with no other keys than these.
  void requireObject(std::initializer_list<std::string_view> keys) const {
    if (!value_.is_object()) fail("an object");
    for (const auto& [key, ignored] : value_.items()) {
      if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
      throw Error(Fault::input,
                  fmt::format("{}: {}/{}: unknown key, expected one of {}", file_, path_, key, fmt::join(keys, ", ")));
    }
  }

  bool has(const char* key) const { return value_.contains(key); }

  Node at(const char* key) const {
    if (!has(key)) fail(fmt::format("an object with the key \"{}\"", key));
    return {value_.at(key), file_, path_ + "/" + key};
  }

  std::vector<Node> items(const char* what) const {
    if (!value_.is_array() || value_.empty()) fail(what);
    std::vector<Node> nodes;
    for (std::size_t i = 0; i < value_.size(); ++i)
      nodes.emplace_back(value_[i], file_, fmt::format("{}/{}", path_, i));
    return nodes;
  }

  std::string string(const char* what) const {
    if (!value_.is_string() || value_.get_ref<const std::string&>().empty()) fail(what);
    return value_.get<std::string>();
  }

  // A text that can name something in a pack; JSON has seen to it that it is UTF-8.
  std::string name(const std::string& what) const {
    const std::string text = string(what.c_str());
    if (std::any_of(text.begin(), text.end(), format::isControl)) fail(what + " without control characters");
    return text;
  }

  // A number in [low, high], or strictly between them where `open`; in single precision too, which may round it.
  float number(double low, double high, bool open, const char* what) const {
    if (!value_.is_number()) fail(what);
    const auto check = [&](auto number, auto least, auto most) {
      const bool inside = open ? number > least && number < most : number >= least && number <= most;
      if (!inside) fail(what);
    };
    const double number = value_.get<double>();
    check(number, low, high);
    const auto rounded = static_cast<float>(number);
    check(rounded, static_cast<float>(low), static_cast<float>(high));
    return rounded;
  }

 private:
  const json& value_;
  const std::string& file_;
  std::string path_;
};

constexpr double kLargest = 1e30;  // of a look's factors; far beyond use, and finite in single precision

void readVector(const Node& node, double high, const char* what, float (&into)[3]) {
  const auto items = node.items(what);
  if (items.size() != 3) node.fail(what);
  for (std::size_t i = 0; i < 3; ++i) into[i] = items[i].number(0, high, false, what);
}

// The bits of `set` are the fields' order in LookRecord.
format::LookRecord readLook(const Node& node) {
  node.requireObject(
      {"extinctionScale", "albedo", "anisotropy", "emissionScale", "temperatureScale", "temperatureOffset", "ambient"});
  format::LookRecord look{};
  const auto take = [&](std::uint32_t bit, const char* key, const auto& read) {
    if (!node.has(key)) return;
    look.set |= 1u << bit;
    read(node.at(key));
  };
  const auto positive = [](float& field) {
    return [&field](const Node& n) { field = n.number(0, kLargest, false, "a number of 0 or more"); };
  };
  const auto any = [](float& field) {
    return [&field](const Node& n) { field = n.number(-kLargest, kLargest, false, "a number"); };
  };
  take(0, "extinctionScale", positive(look.extinctionScale));
  take(1, "albedo", [&](const Node& n) { readVector(n, 1, "three numbers in [0, 1]", look.albedo); });
  take(2, "anisotropy", [&](const Node& n) { look.anisotropy = n.number(-1, 1, true, "a number between -1 and 1"); });
  take(3, "emissionScale", positive(look.emissionScale));
  take(4, "temperatureScale", any(look.temperatureScale));
  take(5, "temperatureOffset", any(look.temperatureOffset));
  take(6, "ambient", [&](const Node& n) { readVector(n, kLargest, "three numbers of 0 or more", look.ambient); });
  return look;
}

// "A", "A-B" or "A-B:STEP", A and B of 0 or more, STEP of 1 or more.
void readFrames(const Node& node, ImportOptions& options) {
  constexpr const char* kExpected = "frames as \"A-B\" or \"A-B:STEP\", with 0 <= A <= B and STEP of 1 or more";
  const std::string text = node.string(kExpected);
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

void readMissing(const Node& node, ImportOptions& options) {
  constexpr const char* kExpected = "\"error\", \"hold\" or \"blank\"";
  const std::string word = node.string(kExpected);
  MissingFrames missing = MissingFrames::error;
  if (word == "hold") {
    missing = MissingFrames::hold;
  } else if (word == "blank") {
    missing = MissingFrames::blank;
  } else if (word != "error") {
    node.fail(kExpected);
  }
  if (options.missing == MissingFrames::error) options.missing = missing;
}

GridRequest readGrid(const Node& node) {
  node.requireObject({"name", "source", "role"});
  GridRequest grid;
  grid.place = node.place();
  grid.name = node.at("name").name("a grid's name");
  grid.source = node.has("source") ? node.at("source").string("a grid's name in the files") : grid.name;
  if (!node.has("role")) return grid;
  const std::string expected = "one of " + roleWords();
  const Node role = node.at("role");
  grid.role = roleByWord(role.string(expected.c_str()));
  if (!grid.role) role.fail(expected);
  return grid;
}

std::vector<GridRequest> readGrids(const Node& node) {
  std::vector<GridRequest> grids;
  std::set<std::string> names, sources;
  for (const Node& item : node.items("a list of grids")) {
    grids.push_back(readGrid(item));
    if (!names.insert(grids.back().name).second) item.at("name").fail("a name that no other grid has");
    if (!sources.insert(grids.back().source).second) item.fail("a source that no other grid has");
  }
  return grids;
}

VolumeRequest readVolume(const Node& node, const std::filesystem::path& folder, const ImportOptions& options) {
  node.requireObject({"name", "inputs", "grids", "fps", "frames", "missing", "look"});
  VolumeRequest volume;
  volume.options = options;
  volume.name = node.at("name").name("a volume's name");
  for (const Node& input : node.at("inputs").items("a list of files, directories or patterns")) {
    volume.inputs.push_back((folder / input.string("a file, a directory or a pattern")).string());
  }
  if (node.has("grids")) volume.grids = readGrids(node.at("grids"));
  if (node.has("fps")) {
    const float fps = node.at("fps").number(0.001, 1e6, false, "frames per second in [0.001, 1000000]");
    if (!options.framesPerSecond) volume.options.framesPerSecond = static_cast<double>(fps);
  }
  if (node.has("frames")) readFrames(node.at("frames"), volume.options);
  if (node.has("missing")) readMissing(node.at("missing"), volume.options);
  if (node.has("look")) volume.look = readLook(node.at("look"));
  return volume;
}

json parse(const std::string& path) {
  const auto read = format::readTextFile(path);
  if (!read) throw Error(Fault::file, fmt::format("{}: cannot be read: {}", path, read.error().detail));
  const std::string& text = *read;
  try {
    return json::parse(text, nullptr, /*allow_exceptions=*/true, /*ignore_comments=*/true);
  } catch (const json::parse_error& error) {
    const auto begin = text.begin();
    const auto end = begin + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    throw Error(Fault::input,
                fmt::format("{}: not JSON at line {}: {}", path, 1 + std::count(begin, end, '\n'), error.what()));
  } catch (const json::exception& error) {  // a number that no double holds
    throw Error(Fault::input, fmt::format("{}: not usable JSON: {}", path, error.what()));
  }
}

}  // namespace

std::vector<VolumeRequest> readManifest(const std::string& path, const ImportOptions& options) {
  const json document = parse(path);
  const Node root(document, path, "");
  root.requireObject({"$schema", "volumes"});
  std::vector<VolumeRequest> volumes;
  std::set<std::string> names;
  for (const Node& item : root.at("volumes").items("a list of volumes")) {
    volumes.push_back(readVolume(item, std::filesystem::path(path).parent_path(), options));
    if (!names.insert(volumes.back().name).second) item.at("name").fail("a name that no other volume has");
  }
  return volumes;
}

}  // namespace billow::compiler
