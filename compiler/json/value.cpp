#include "json/value.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "billow/format/text.h"

namespace billow::json {
namespace {

using Parsed = nlohmann::json;

constexpr std::size_t kLongestShown = 60;  // characters of a value in a message

std::string shown(const Parsed& json) {
  std::string text = json.dump(-1, ' ', /*ensure_ascii=*/true, Parsed::error_handler_t::replace);
  if (text.size() > kLongestShown) text = text.substr(0, kLongestShown - 3) + "...";
  return text;
}

// Insertions, deletions, replacements and exchanges of neighbours that make b of a, without regard to case (the optimal
// string alignment of Damerau 1964).
std::size_t editDistance(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  std::vector<std::size_t> before, above, row(b.size() + 1);  // of the table, the last being row i
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::exchange(above, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = above[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      row[j] = std::min({replaced, above[j] + 1, row[j - 1] + 1});
      const bool exchanged = i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]);
      if (exchanged) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

// The known name that `key` was perhaps meant to be; "" where none is near.
std::string_view nearest(std::string_view key, std::span<const std::string_view> known) {
  constexpr std::size_t kLongestKey = 64;  // longer ones are no misspelling, and the distance costs their product
  if (key.size() > kLongestKey) return "";
  std::string_view best;
  std::size_t least = key.size() / 2 + 1;  // half of it may be wrong
  for (const std::string_view name : known) {
    const std::size_t distance = editDistance(key, name);
    if (distance >= least) continue;
    least = distance;
    best = name;
  }
  return best;
}

std::string describe(const Range& range) {
  return range.open ? fmt::format("a number between {:.9g} and {:.9g}", range.low, range.high)
                    : fmt::format("a number from {:.9g} to {:.9g}", range.low, range.high);
}

template <class T>
bool contains(const Range& range, T number) {
  const auto low = static_cast<T>(range.low), high = static_cast<T>(range.high);
  return range.open ? number > low && number < high : number >= low && number <= high;
}

}  // namespace

std::string memberPath(std::string_view path, std::string_view key) {
  const auto plain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$'; };
  if (key.empty() || !std::all_of(key.begin(), key.end(), plain)) {
    return fmt::format("{}[{}]", path, shown(Parsed(key)));
  }
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

std::string Value::place() const {
  return path_.empty() ? *file_ : fmt::format("{}: {}", *file_, path_);
}

void Value::fail(std::string_view expected) const {
  throw Error(fmt::format("{}: {} is {}; expected {}", *file_, path_.empty() ? "the document" : path_, shown(*json_),
                          expected));
}

bool Value::isObject() const {
  return json_->is_object();
}
bool Value::isArray() const {
  return json_->is_array();
}
bool Value::isString() const {
  return json_->is_string();
}
bool Value::isNumber() const {
  return json_->is_number();
}

void Value::requireKeys(std::initializer_list<std::string_view> keys) const {
  requireKeys(std::span(keys.begin(), keys.size()));
}

void Value::requireKeys(std::span<const std::string_view> keys) const {
  if (!isObject()) fail("an object");
  for (const auto& [key, ignored] : json_->items()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    const std::string_view near = nearest(key, keys);
    throw Error(fmt::format("{}: {} is not known{}; expected one of {}", *file_, memberPath(path_, key),
                            near.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", near), fmt::join(keys, ", ")));
  }
}

Value Value::child(const Parsed& json, std::string_view key) const {
  return {json, *file_, memberPath(path_, key)};
}

std::optional<Value> Value::find(std::string_view key) const {
  if (!isObject()) fail("an object");
  const auto member = json_->find(key);
  if (member == json_->end()) return std::nullopt;
  return child(*member, key);
}

Value Value::at(std::string_view key) const {
  const auto member = find(key);
  if (!member) throw Error(fmt::format("{}: {} is missing", *file_, memberPath(path_, key)));
  return *member;
}

std::vector<Value> Value::items(std::string_view expected) const {
  if (!isArray() || json_->empty()) fail(expected);
  std::vector<Value> values;
  values.reserve(json_->size());
  for (std::size_t i = 0; i < json_->size(); ++i) {
    values.emplace_back((*json_)[i], *file_, fmt::format("{}[{}]", path_, i));
  }
  return values;
}

std::vector<Value> Value::items(std::size_t count, std::string_view expected) const {
  if (!isArray() || json_->size() != count) fail(expected);
  return items(expected);
}

std::string Value::text(std::string_view expected) const {
  if (!isString() || json_->get_ref<const std::string&>().empty()) fail(expected);
  return json_->get<std::string>();
}

std::string Value::name(std::string_view expected) const {
  std::string result = text(expected);
  if (std::any_of(result.begin(), result.end(), format::isControl)) {
    fail(fmt::format("{} without control characters", expected));
  }
  return result;
}

std::size_t Value::word(std::initializer_list<std::string_view> words) const {
  if (isString()) {
    const auto* found = std::find(words.begin(), words.end(), json_->get_ref<const std::string&>());
    if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  }
  std::string expected;
  for (const std::string_view candidate : words) {
    expected += fmt::format("{}\"{}\"", expected.empty() ? "" : " or ", candidate);
  }
  fail(expected);
}

bool Value::boolean() const {
  if (!json_->is_boolean()) fail("true or false");
  return json_->get<bool>();
}

double Value::number(const Range& range) const {
  if (!isNumber()) fail(describe(range));
  const auto number = json_->get<double>();
  if (!contains(range, number)) fail(describe(range));
  return number;
}

float Value::single(const Range& range) const {
  const auto rounded = static_cast<float>(number(range));
  if (!contains(range, rounded)) fail(describe(range));
  return rounded;
}

std::int64_t Value::integer(std::int64_t low, std::int64_t high) const {
  const auto expected = [&] { return fmt::format("a whole number from {} to {}", low, high); };
  if (!json_->is_number_integer()) fail(expected());
  const bool fits = !json_->is_number_unsigned() ||
                    json_->get<std::uint64_t>() <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const std::int64_t number = fits ? json_->get<std::int64_t>() : 0;
  if (!fits || number < low || number > high) fail(expected());
  return number;
}

std::string Value::countedNumbers(std::size_t count) {
  return fmt::format("a list of {} numbers", count);
}

}  // namespace billow::json
