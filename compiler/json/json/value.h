// A value of a JSON document together with its place in it, so that every complaint names both.
#ifndef BILLOW_JSON_VALUE_H
#define BILLOW_JSON_VALUE_H

#include <array>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace billow::json {

// One line: file, place, value found, what was expected.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Which numbers are taken: [low, high], or strictly between them where `open`.
struct Range {
  double low, high;
  bool open = false;
};

// Its functions throw Error where the value is not what they are asked for.
class Value {
 public:
  // For Document.
  Value(const nlohmann::json& json, const std::string& file, std::string path)
      : json_(&json), file_(&file), path_(std::move(path)) {}

  // "emitters[2].rate"; "" for the whole document.
  const std::string& path() const { return path_; }
  // "FILE: emitters[2].rate", for messages that are found out later.
  std::string place() const;
  // Throws "FILE: emitters[2].rate is -1; expected ...".
  [[noreturn]] void fail(std::string_view expected) const;

  bool isObject() const;
  bool isArray() const;
  bool isString() const;
  bool isNumber() const;

  // An object without other keys than these; for an unknown one the nearest of them is proposed.
  void requireKeys(std::initializer_list<std::string_view> keys) const;
  void requireKeys(std::span<const std::string_view> keys) const;
  // An object's member.
  Value at(std::string_view key) const;
  std::optional<Value> find(std::string_view key) const;  // nullopt: it has none

  // An array's items, at least one; `expected` as in "a list of grids".
  std::vector<Value> items(std::string_view expected) const;
  // An array of so many items.
  std::vector<Value> items(std::size_t count, std::string_view expected) const;

  // A text that is not empty.
  std::string text(std::string_view expected) const;
  // The same without control characters: one that can be a name in a pack.
  std::string name(std::string_view expected) const;
  // Which of the words it is.
  std::size_t word(std::initializer_list<std::string_view> words) const;

  bool boolean() const;
  double number(const Range& range) const;
  // Within the range also as single precision rounds it.
  float single(const Range& range) const;
  // A number without a fraction, in [low, high].
  std::int64_t integer(std::int64_t low, std::int64_t high) const;

  // An array of N numbers.
  template <std::size_t N>
  std::array<double, N> numbers(const Range& range) const {
    std::array<double, N> result;
    for (std::size_t i = 0; const Value& item : items(N, countedNumbers(N))) result[i++] = item.number(range);
    return result;
  }
  template <std::size_t N>
  std::array<float, N> singles(const Range& range) const {
    std::array<float, N> result;
    for (std::size_t i = 0; const Value& item : items(N, countedNumbers(N))) result[i++] = item.single(range);
    return result;
  }

 private:
  static std::string countedNumbers(std::size_t count);
  Value child(const nlohmann::json& json, std::string_view key) const;

  const nlohmann::json* json_;
  const std::string* file_;
  std::string path_;
};

// `key` of the object at `path`, as a place: "path.key", or path["a key"] where it is not an identifier.
std::string memberPath(std::string_view path, std::string_view key);

}  // namespace billow::json

#endif  // BILLOW_JSON_VALUE_H
