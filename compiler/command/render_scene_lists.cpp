#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "billow/format/affine.h"
#include "billow/format/effect.h"
#include "billow/format/similarity.h"
#include "render_scene.h"

namespace billow::command {
namespace {

using json::Range;
using json::Value;
using Vec = std::array<double, 3>;

constexpr Range kAnywhere{-kLargest, kLargest};
constexpr Range kFactor{0, kLargest};
constexpr Range kSeconds{-format::kMaxEffectTime, format::kMaxEffectTime};
constexpr double kMostScale = 1e6, kLeastScale = 1e-6;
constexpr std::size_t kMostVolumes = 8;  // as many as a draw of metavoxels takes
constexpr std::size_t kMostEffects = 64;

// The volume of a matrix's box over that of its edges: 1 where they are square to one another, 0 where they lie in one
// plane.
double squareness(const Matrix& m) {
  double edges = 1;
  for (std::size_t i = 0; i < 3; ++i) edges *= std::sqrt(m[i] * m[i] + m[4 + i] * m[4 + i] + m[8 + i] * m[8 + i]);
  double copy[12];
  std::copy(m.begin(), m.end(), copy);
  return std::abs(format::determinant(copy)) / edges;
}

Matrix readMatrix(const Value& value) {
  Matrix matrix{};
  std::size_t at = 0;
  for (const Value& row : value.items(3, "a list of 3 rows of 4 numbers")) {
    for (const double number : row.numbers<4>(kAnywhere)) matrix[at++] = number;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = std::hypot(matrix[i], matrix[4 + i], matrix[8 + i]);
    if (!(length >= kLeastScale && length <= kMostScale)) {
      value.fail(fmt::format("columns of a length from {} to {}; that of column {} is {}", kLeastScale, kMostScale, i,
                             length));
    }
  }
  if (!(squareness(matrix) >= 1e-6)) value.fail("a matrix that can be turned round; its columns lie in one plane");
  return matrix;
}

double readScaleNumber(const Value& value) {
  const double scale = value.number({-kMostScale, kMostScale});
  if (!(std::abs(scale) >= kLeastScale)) value.fail(fmt::format("a number of at least {} or below 0", kLeastScale));
  return scale;
}

// One number or three; below 0 they mirror.
Vec readScale(const Value& value) {
  Vec scale{};
  if (!value.isArray()) {
    scale.fill(readScaleNumber(value));
    return scale;
  }
  for (std::size_t i = 0; const Value& item : value.items(3, "a number, or a list of 3")) {
    scale[i++] = readScaleNumber(item);
  }
  return scale;
}

// Of the columns, by Rodrigues' formula.
void rotate(const Value& value, Matrix& matrix) {
  value.requireKeys({"axis", "degrees"});
  Vec axis = value.at("axis").numbers<3>(kAnywhere);
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 1e-9)) value.at("axis").fail("a direction, which is not 0");
  for (double& component : axis) component /= length;
  const double angle = value.at("degrees").number({-36000, 36000}) * std::numbers::pi / 180;
  const double sine = std::sin(angle), cosine = std::cos(angle);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec v{matrix[i], matrix[4 + i], matrix[8 + i]};
    const Vec crossed{axis[1] * v[2] - axis[2] * v[1], axis[2] * v[0] - axis[0] * v[2],
                      axis[0] * v[1] - axis[1] * v[0]};
    const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
    for (std::size_t c = 0; c < 3; ++c) {
      matrix[4 * c + i] = v[c] * cosine + crossed[c] * sine + axis[c] * along * (1 - cosine);
    }
  }
}

void readOwnLook(const Value& value, LookRequest& look) {
  for (const char* shared : {"anisotropy", "ambient", "scatteringOrders"}) {
    if (const auto given = value.find(shared)) {
      given->fail("none here but in the scene's look: all that meets in one place scatters alike");
    }
  }
  readLook(value, look);
}

void readFrames(const Value& value, VolumeRequest& volume) {
  if (const auto frame = value.find("frame")) {
    volume.frame = static_cast<std::int32_t>(frame->integer(INT32_MIN, INT32_MAX));
    for (const char* other : {"begin", "framesPerSecond", "after"}) {
      if (value.find(other)) frame->fail(fmt::format("either it or \"{}\": it shows at all times", other));
    }
  }
  if (const auto begin = value.find("begin")) volume.begin = begin->number(kSeconds);
  if (const auto rate = value.find("framesPerSecond")) volume.framesPerSecond = rate->number({0.001, 1000});
  if (const auto after = value.find("after")) {
    constexpr AfterLast kWays[] = {AfterLast::hold, AfterLast::loop, AfterLast::vanish};
    volume.after = kWays[after->word({"hold", "loop", "vanish"})];
  }
}

}  // namespace

Matrix readTransform(const Value& value) {
  value.requireKeys({"translate", "rotate", "scale", "matrix"});
  if (const auto matrix = value.find("matrix")) {
    for (const char* other : {"translate", "rotate", "scale"}) {
      if (value.find(other)) matrix->fail(fmt::format("either a matrix or \"{}\"", other));
    }
    return readMatrix(*matrix);
  }
  Matrix result = kIdentity;
  if (const auto scale = value.find("scale")) {
    const Vec factors = readScale(*scale);
    for (std::size_t i = 0; i < 3; ++i) result[5 * i] = factors[i];
  }
  if (const auto turn = value.find("rotate")) rotate(*turn, result);
  if (const auto way = value.find("translate")) {
    const Vec offset = way->numbers<3>(kAnywhere);
    for (std::size_t i = 0; i < 3; ++i) result[4 * i + 3] = offset[i];
  }
  return result;
}

void readVolumes(const Value& list, const std::filesystem::path& folder, RenderRequest& request) {
  const auto items = list.items("a list of volumes");
  if (items.size() > kMostVolumes) list.fail(fmt::format("at most {} volumes", kMostVolumes));
  for (const Value& item : items) {
    item.requireKeys(
        {"pack", "volume", "level", "grids", "transform", "begin", "framesPerSecond", "after", "frame", "look"});
    VolumeRequest volume;
    volume.place = item.place();
    readSource(item, folder, volume);
    if (const auto transform = item.find("transform")) volume.transform = readTransform(*transform);
    if (const auto look = item.find("look")) readOwnLook(*look, volume.look);
    readFrames(item, volume);
    request.volumes.push_back(std::move(volume));
  }
}

void readEffects(const Value& list, const std::filesystem::path& folder, RenderRequest& request) {
  const auto items = list.items("a list of effects");
  if (items.size() > kMostEffects) list.fail(fmt::format("at most {} effects", kMostEffects));
  for (const Value& item : items) {
    item.requireKeys({"pack", "effect", "transform", "begin", "look"});
    EffectRequest effect;
    effect.place = item.place();
    effect.pack = (folder / item.at("pack").text("the path of a pack")).string();
    effect.name = item.at("effect").text("an effect's name");
    if (const auto transform = item.find("transform")) {
      effect.transform = readTransform(*transform);
      if (!format::similarityOf(effect.transform)) {
        transform->fail("the same scale, above 0, along all axes: particles keep their shapes");
      }
    }
    if (const auto begin = item.find("begin")) effect.begin = begin->number(kSeconds);
    if (const auto look = item.find("look")) {
      look->requireKeys({"density", "fire"});
      readNumber(*look, "density", kFactor, effect.density);
      readNumber(*look, "fire", kFactor, effect.fire);
    }
    request.effects.push_back(std::move(effect));
  }
}

}  // namespace billow::command
