#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "mesh/formats.h"
#include "mesh/polygon.h"

namespace billow::compiler {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\\\v\f";

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file) : rest_(text), file_(file) {}

  TriangleList read() {
    while (!rest_.empty()) {
      line_ = nextLine();
      const std::string_view keyword = nextWord();
      if (keyword == "v") readVertex();
      if (keyword == "f") readFace();
    }
    return std::move(triangles_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { failMesh(file_, fmt::format("line {}: {}", number_, what)); }

  // A backslash at its end continues a line.
  std::string_view nextLine() {
    number_ += linesTaken_;
    linesTaken_ = 0;
    std::size_t end = 0;
    bool continued = true;
    for (std::size_t from = 0; continued; from = end + 1) {
      end = std::min(rest_.find('\n', from), rest_.size());
      ++linesTaken_;
      const std::string_view line = rest_.substr(from, end - from);
      const std::size_t last = line.find_last_not_of('\r');
      continued = end < rest_.size() && last != std::string_view::npos && line[last] == '\\';
    }
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return line;
  }

  // Of the line; "" at its end.
  std::string_view nextWord() {
    line_.remove_prefix(std::min(line_.find_first_not_of(kBlanks), line_.size()));
    const std::string_view word = line_.substr(0, line_.find_first_of(kBlanks));
    line_.remove_prefix(word.size());
    return word;
  }

  void readVertex() {
    if (vertices_.size() == kMostVertices) fail(fmt::format("more than {} vertices", kMostVertices));
    Vertex vertex{};
    for (float& coordinate : vertex) {
      const std::string_view word = nextWord();
      const std::string_view digits = word.substr(word.starts_with('+') ? 1 : 0);
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), coordinate);
      if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(coordinate)) {
        fail(fmt::format("a coordinate is \"{}\"; expected a finite number", word));
      }
    }
    vertices_.push_back(vertex);
  }

  // "7", "7/1", "7//3" or "7/1/3": the first number counts from 1, or backward from -1 for the last.
  Vertex corner(std::string_view word) const {
    const std::string_view digits = word.substr(0, word.find('/'));
    const auto count = static_cast<std::int64_t>(vertices_.size());
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    const bool number = error == std::errc{} && end == digits.data() + digits.size();
    if (!number || index == 0 || index > count || index < -count) {
      fail(fmt::format("a corner is \"{}\"; expected the number of one of the {} vertices before it", word, count));
    }
    return vertices_[static_cast<std::size_t>(index > 0 ? index - 1 : count + index)];
  }

  void readFace() {
    corners_.clear();
    for (std::string_view word = nextWord(); !word.empty(); word = nextWord()) {
      if (corners_.size() == kMostCorners) fail(fmt::format("a face has more than {} corners", kMostCorners));
      corners_.push_back(corner(word));
    }
    if (corners_.size() < 3) fail(fmt::format("a face has {} corners; expected at least 3", corners_.size()));
    for (const auto& [a, b, c] : cutPolygon(corners_)) {
      addTriangle({corners_[a], corners_[b], corners_[c]}, file_, triangles_);
    }
  }

  std::string_view rest_, line_;
  const std::string& file_;
  std::size_t number_ = 1, linesTaken_ = 0;  // of the line
  std::vector<Vertex> vertices_, corners_;
  TriangleList triangles_;
};

}  // namespace

TriangleList readObj(std::string_view text, const std::string& file) {
  return ObjReader(text, file).read();
}

}  // namespace billow::compiler
