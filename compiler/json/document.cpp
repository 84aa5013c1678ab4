#include "json/document.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "billow/format/source.h"

namespace billow::json {
namespace {

using Parsed = nlohmann::json;

// Follows the parser, for what nlohmann's own reading passes over: keys that come twice, and depth without end, which
// its writing would follow to the end of the stack.
class Watch {
 public:
  explicit Watch(const std::string& name) : name_(name) {}

  // As nlohmann's parser_callback_t; always keeps the value.
  bool operator()(int depth, Parsed::parse_event_t event, const Parsed& parsed) {
    using Event = Parsed::parse_event_t;
    if (event == Event::object_start || event == Event::array_start) {
      enter(depth, event == Event::array_start);
    } else if (event == Event::key) {
      addKey(parsed.get_ref<const std::string&>());
    } else {
      if (event != Event::value) levels_.pop_back();
      if (!levels_.empty()) ++levels_.back().items;
    }
    return true;
  }

 private:
  struct Level {
    bool array;
    std::string path;
    std::set<std::string> keys = {};
    std::string key = {};  // the last
    std::size_t items = 0;
  };

  void enter(int depth, bool array) {
    const std::string path = levels_.empty() ? "" : childPath(levels_.back());
    if (depth >= kMostLevels) {
      throw Error(fmt::format("{}: {} lies too deep; expected at most {} levels", name_, path, kMostLevels));
    }
    levels_.push_back({array, path});
  }

  void addKey(const std::string& key) {
    Level& level = levels_.back();
    level.key = key;
    if (level.keys.insert(key).second) return;
    throw Error(fmt::format("{}: {} is there twice; expected each key once", name_, childPath(level)));
  }

  static std::string childPath(const Level& level) {
    return level.array ? fmt::format("{}[{}]", level.path, level.items) : memberPath(level.path, level.key);
  }

  const std::string& name_;
  std::vector<Level> levels_;
};

// nlohmann's message without its name for it: "line 3, column 7: syntax error ...".
std::string messageOf(const Parsed::exception& error) {
  std::string_view text = error.what();
  for (const std::string_view start : {"] ", "parse error at "}) {
    const std::size_t at = text.find(start);
    if (at != std::string_view::npos) text.remove_prefix(at + start.size());
  }
  return std::string(text);
}

std::string readFile(const std::string& path) {
  auto text = format::readTextFile(path);
  if (!text) throw FileError(fmt::format("{}: cannot be read: {}", path, text.error().detail));
  return *std::move(text);
}

}  // namespace

Document::Document(const std::string& path) : Document(path, readFile(path)) {}

Document::Document(const std::string& name, const std::string& text) : name_(name) {
  try {
    json_ = std::make_unique<Parsed>(
        Parsed::parse(text, Watch(name_), /*allow_exceptions=*/true, /*ignore_comments=*/true));
  } catch (const Parsed::exception& error) {  // a parse_error, or a number that no double holds
    throw Error(fmt::format("{}: not JSON: {}", name_, messageOf(error)));
  }
}

Document::~Document() = default;

Value Document::root() const {
  return {*json_, name_, ""};
}

}  // namespace billow::json
