#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <limits>
#include <optional>
#include <type_traits>

#include "import/ply_header.h"
#include "import/points.h"
#include "stages.h"

namespace billow::compiler {
namespace {

// The values behind the header, one after another, with whatever says where they end.
class ValueReader {
 public:
  ValueReader(std::span<const std::byte> bytes, PlyEncoding encoding, const std::string& what)
      : bytes_(bytes), encoding_(encoding), what_(what) {}

  double value(PlyType type) { return encoding_ == PlyEncoding::ascii ? number(type) : binary(type); }

  void skip(const PlyElement& element) {
    if (encoding_ == PlyEncoding::ascii) return skipLines(element.properties.empty() ? 0 : element.count);
    std::uint64_t stride = 0;
    bool lists = false;
    for (const PlyProperty& property : element.properties) {
      stride += plyBytes(property.type);
      lists = lists || property.count;
    }
    if (!lists) {
      if (stride != 0 && element.count > remaining() / stride) failAtEnd();
      at_ += static_cast<std::size_t>(element.count * stride);
      return;
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) skip(property);
    }
  }

  // Each takes at least a byte, so the file's end ends every loop.
  void skip(const PlyProperty& property) {
    if (!property.count) {
      value(property.type);
      return;
    }
    const double count = value(*property.count);
    if (!(count >= 0)) fail("a list has a negative count");
    for (double i = 0; i < count; ++i) value(property.type);
  }

  [[noreturn]] void fail(const std::string& detail) const {
    throw Error(Fault::input, fmt::format("{}: {}, at byte {} of the values", what_, detail, at_));
  }

 private:
  std::size_t remaining() const { return bytes_.size() - at_; }
  [[noreturn]] void failAtEnd() const { fail("the file ends before its values (is it truncated?)"); }

  template <class T>
  double as(std::uint64_t bits) const {
    using Bits =
        std::conditional_t<sizeof(T) == 8, std::uint64_t,
                           std::conditional_t<sizeof(T) == 4, std::uint32_t,
                                              std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
    return static_cast<double>(std::bit_cast<T>(static_cast<Bits>(bits)));
  }

  double binary(PlyType type) {
    const std::size_t size = plyBytes(type);
    if (size > remaining()) failAtEnd();
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t from = encoding_ == PlyEncoding::bigEndian ? i : size - 1 - i;
      bits = bits << 8 | static_cast<std::uint64_t>(bytes_[at_ + from]);
    }
    at_ += size;
    switch (type) {
      case PlyType::int8:
        return as<std::int8_t>(bits);
      case PlyType::uint8:
        return as<std::uint8_t>(bits);
      case PlyType::int16:
        return as<std::int16_t>(bits);
      case PlyType::uint16:
        return as<std::uint16_t>(bits);
      case PlyType::int32:
        return as<std::int32_t>(bits);
      case PlyType::uint32:
        return as<std::uint32_t>(bits);
      case PlyType::float32:
        return as<float>(bits);
      case PlyType::float64:
        return as<double>(bits);
    }
    return 0;
  }

  char charAt(std::size_t i) const { return static_cast<char>(bytes_[i]); }

  double number(PlyType type) {
    const auto isSpace = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
    while (at_ < bytes_.size() && isSpace(charAt(at_))) ++at_;
    if (at_ == bytes_.size()) failAtEnd();
    std::size_t end = at_;
    while (end < bytes_.size() && !isSpace(charAt(end)) && end - at_ < 64) ++end;
    const char* first = reinterpret_cast<const char*>(bytes_.data());
    double result = 0;
    const std::size_t begin = charAt(at_) == '+' ? at_ + 1 : at_;
    const auto [stop, error] = std::from_chars(first + begin, first + end, result);
    if (stop != first + end || error == std::errc::invalid_argument) fail("no number");
    if (error == std::errc::result_out_of_range) result = std::numeric_limits<double>::infinity();
    at_ = end;
    return type == PlyType::float32 ? static_cast<double>(static_cast<float>(result)) : result;
  }

  void skipLines(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      while (at_ < bytes_.size() && charAt(at_) != '\n') ++at_;
      if (at_ == bytes_.size()) failAtEnd();
      ++at_;
    }
  }

  std::span<const std::byte> bytes_;
  PlyEncoding encoding_;
  const std::string& what_;
  std::size_t at_ = 0;
};

constexpr std::size_t kNone = ~std::size_t{0};

std::size_t propertyOf(const PlyElement& element, const std::string& name) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    if (element.properties[i].name == name && !element.properties[i].count) return i;
  }
  return kNone;
}

using Three = std::array<std::size_t, 3>;

Three propertiesOf(const PlyElement& element, const std::string& name, const char* const (&ends)[3]) {
  const Three found{propertyOf(element, name + ends[0]), propertyOf(element, name + ends[1]),
                    propertyOf(element, name + ends[2])};
  return std::find(found.begin(), found.end(), kNone) == found.end() ? found : Three{kNone, kNone, kNone};
}

// A colour's three properties, as programs name them; red, green and blue where it has no name.
Three colourOf(const PlyElement& element, const std::string& name) {
  static constexpr const char* kNameless[3] = {"red", "green", "blue"};
  if (name.empty()) return propertiesOf(element, name, kNameless);
  static constexpr const char* kEnds[][3] = {{"_r", "_g", "_b"}, {".r", ".g", ".b"},    {"_x", "_y", "_z"},
                                             {".x", ".y", ".z"}, {"x", "y", "z"},       {"r", "g", "b"},
                                             {"_0", "_1", "_2"}, {"[0]", "[1]", "[2]"}, {"0", "1", "2"}};
  for (const auto& ends : kEnds) {
    if (const Three found = propertiesOf(element, name, ends); found[0] != kNone) return found;
  }
  return {kNone, kNone, kNone};
}

// Of a number in (0, 1], by Newton's steps from above: the same bits on every machine, as std::pow's are not.
double fifthRoot(double x) {
  double root = 1;
  for (int i = 0; i < 24; ++i) {
    const double square = root * root;
    root -= (square * square * root - x) / (5 * square * square);
  }
  return root;
}

// A colour as stored to linear: integers are shares of their greatest, in sRGB.
double linearOf(double value, PlyType type) {
  if (type == PlyType::float32 || type == PlyType::float64) return value;
  const bool isSigned = type == PlyType::int8 || type == PlyType::int16 || type == PlyType::int32;
  const auto bits = 8 * plyBytes(type) - (isSigned ? 1 : 0);
  const auto greatest = static_cast<double>((std::uint64_t{1} << bits) - 1);
  const double encoded = std::clamp(value / greatest, 0.0, 1.0);
  if (encoded <= 0.04045) return encoded / 12.92;
  const double base = (encoded + 0.055) / 1.055;
  return base * base * fifthRoot(base * base);
}

class PlyReader {
 public:
  PlyReader(const PlyElement& element, const std::string& what, const PointAttributes& attributes)
      : element_(element), what_(what) {
    place_ = propertiesOf(element, "", {"x", "y", "z"});
    if (place_[0] == kNone) {
      throw Error(Fault::input, fmt::format("{}: its vertices have no properties x, y and z", what));
    }
    id_ = find(attributes.id);
    radius_ = find(attributes.radius);
    age_ = find(attributes.age);
    life_ = find(attributes.life);
    colour_ = findColour(attributes.colour);
  }

  PointFrame read(ValueReader& values) const {
    PointFrame frame;
    frame.ordered = true;
    std::vector<double> row(element_.properties.size());
    for (std::size_t i = 0; i < element_.count; ++i) {
      for (std::size_t p = 0; p < row.size(); ++p) {
        const PlyProperty& property = element_.properties[p];
        if (property.count) {
          values.skip(property);
        } else {
          row[p] = values.value(property.type);
        }
      }
      take(row, frame);
    }
    return frame;
  }

 private:
  std::size_t find(const AttributeChoice& choice) const {
    for (const std::string& name : choice.names) {
      if (const std::size_t found = propertyOf(element_, name); found != kNone) return found;
    }
    if (choice.required) fail(choice);
    return kNone;
  }
  Three findColour(const AttributeChoice& choice) const {
    for (const std::string& name : choice.names) {
      if (const Three found = colourOf(element_, name); found[0] != kNone) return found;
    }
    if (choice.required) fail(choice);
    return {kNone, kNone, kNone};
  }
  [[noreturn]] void fail(const AttributeChoice& choice) const {
    std::vector<std::string> names;
    for (const PlyProperty& property : element_.properties) names.push_back(property.name);
    failWithoutAttribute(what_, choice, names);
  }

  void take(const std::vector<double>& row, PointFrame& frame) const {
    const auto single = [&](std::size_t p) { return static_cast<float>(row[p]); };
    const std::size_t number = frame.places.size();
    frame.places.push_back({single(place_[0]), single(place_[1]), single(place_[2])});
    if (id_ != kNone) frame.ids.push_back(idOf(row[id_], what_, number));
    if (radius_ != kNone) frame.radii.push_back(single(radius_));
    if (age_ != kNone) frame.ages.push_back(single(age_));
    if (life_ != kNone) frame.lives.push_back(single(life_));
    if (colour_[0] == kNone) return;
    std::array<float, 3> colour;
    for (std::size_t c = 0; c < 3; ++c) {
      colour[c] = static_cast<float>(linearOf(row[colour_[c]], element_.properties[colour_[c]].type));
    }
    frame.colours.push_back(colour);
  }

  const PlyElement& element_;
  const std::string& what_;
  Three place_, colour_;
  std::size_t id_, radius_, age_, life_;
};

}  // namespace

PointFrame readPly(std::span<const std::byte> bytes, const std::string& what, const PointAttributes& attributes,
                   std::uint32_t most) {
  const PlyHeader header = readPlyHeader(bytes, what);
  ValueReader values(bytes.subspan(header.size), header.encoding, what);
  for (const PlyElement& element : header.elements) {
    if (element.name != "vertex") {
      values.skip(element);
      continue;
    }
    if (element.count > most) {
      throw Error(Fault::input, fmt::format("{}: {} particles; expected at most {}", what, element.count, most));
    }
    return PlyReader(element, what, attributes).read(values);
  }
  throw Error(Fault::input, fmt::format("{}: no element 'vertex', which holds the particles", what));
}

}  // namespace billow::compiler
