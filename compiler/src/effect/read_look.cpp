#include <algorithm>
#include <cmath>

#include "effect/black_body.h"
#include "effect/read.h"

namespace billow::compiler {
namespace {

using json::Range;
using json::Value;

constexpr double kMost = static_cast<double>(format::kMaxMagnitude);
constexpr Range kLife{0, 1};
constexpr Range kShare{0, 1};
constexpr Range kPositive{0, kMost};
constexpr Range kTurns{-10000, 10000};
constexpr double kMostDisplacement = 0.95;  // as the format has it

void setColour(const std::array<double, 3>& colour, float (&into)[3]) {
  for (std::size_t i = 0; i < 3; ++i) into[i] = static_cast<float>(colour[i]);
}

// A constant goes into the record, a curve into rows with the record's factor 1.
void takeCurve(const Keys& keys, float& constant, Keys& row) {
  if (keys.times.size() == 1) {
    constant = static_cast<float>(keys.values[0][0]);
  } else {
    constant = 1;
    row = keys;
  }
}

// A picture: radius along its width, age downward.
std::vector<RampRow> rampOfPicture(const Image& picture, double most) {
  std::vector<RampRow> ramp;
  for (std::uint32_t row = 0; row < format::kRampAges; ++row) {
    const double age = static_cast<double>(row) / (format::kRampAges - 1);
    Keys colour;
    for (std::uint32_t i = 0; i < format::kRampRadii; ++i) {
      const double radius = static_cast<double>(i) / (format::kRampRadii - 1);
      std::array<double, 3> value = picture.sample(radius, age, false);
      for (double& component : value) component = std::clamp(component, 0.0, most);
      colour.times.push_back(radius);
      colour.values.push_back(value);
    }
    ramp.push_back({age, colour});
  }
  return ramp;
}

// The name of a picture, or [{"age": A, "stops": [[radius, [r, g, b]], ...]}, ...]
std::vector<RampRow> readRamp(const Value& value, const Range& colours, const std::filesystem::path& folder) {
  if (value.isString()) {
    return rampOfPicture(readImage((folder / value.text("a picture *.exr or *.png")).string()), colours.high);
  }
  std::vector<RampRow> ramp;
  for (const Value& row : value.items("a list of rows with age and stops")) {
    row.requireKeys({"age", "stops"});
    const double age = row.at("age").number(kLife);
    if (!ramp.empty() && age <= ramp.back().age) row.at("age").fail("an age above that of the row before");
    ramp.push_back({age, readVectorCurve(row.at("stops"), kShare, colours)});
  }
  if (ramp.size() > format::kRampAges) value.fail("at most 16 rows");
  return ramp;
}

void readDiffuse(const Value& value, const std::filesystem::path& folder, EmitterDescription& emitter) {
  value.requireKeys({"colour", "ramp", "occlusion"});
  if (const auto colour = value.find("colour")) {
    const Keys keys = readVectorCurve(*colour, kLife, kShare);
    setColour(keys.times.size() == 1 ? keys.values[0] : std::array<double, 3>{1, 1, 1}, emitter.record.diffuse);
    if (keys.times.size() > 1) emitter.diffuse = keys;
  }
  if (const auto ramp = value.find("ramp")) emitter.diffuseRamp = readRamp(*ramp, kShare, folder);
  if (const auto occlusion = value.find("occlusion")) emitter.material.occlusion = occlusion->single(kShare);
}

void readEmission(const Value& value, const std::filesystem::path& folder, EmitterDescription& emitter) {
  value.requireKeys({"colour", "strength", "temperature", "ramp"});
  constexpr Range kFactor{0, 1000};  // two of them and a ramp stay in range
  Emission emission{{{0}, {{1, 1, 1}}}, readCurve(value.at("strength"), kLife, kFactor), {}};
  if (const auto given = value.find("colour")) emission.colour = readVectorCurve(*given, kLife, kFactor);
  if (const auto given = value.find("temperature")) emission.temperature = readCurve(*given, kLife, {500, 20000});
  setColour(emission.constant() ? emission.at(0) : std::array<double, 3>{1, 1, 1}, emitter.record.emission);
  if (!emission.constant()) emitter.emission = emission;
  if (const auto ramp = value.find("ramp")) emitter.emissionRamp = readRamp(*ramp, kFactor, folder);
}

void readRotation(const Value& value, EmitterDescription& emitter) {
  value.requireKeys({"axis", "randomStart", "turns", "alongVelocity"});
  format::EmitterRecord& record = emitter.record;
  if (const auto axis = value.find("axis")) {
    const auto v = axis->numbers<3>({-kMost, kMost});
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 1e-6)) axis->fail("an axis, which is not 0");
    for (std::size_t i = 0; i < 3; ++i) record.axis[i] = static_cast<float>(v[i] / length);
  }
  if (const auto start = value.find("randomStart"); start && start->boolean()) {
    record.flags |= format::kEmitterRandomStart;
  }
  if (const auto along = value.find("alongVelocity"); along && along->boolean()) record.flags |= format::kEmitterAlign;
  const auto turns = value.find("turns");
  if (!turns) return;
  emitter.rotation = readCurve(*turns, kLife, kTurns);
  if (!turns->isArray()) emitter.rotation = {{0, 1}, {{0, 0, 0}, emitter.rotation.values[0]}};
}

void readNoise(const Value& value, EmitterDescription& emitter) {
  value.requireKeys({"kind", "octaves", "frequency", "seed", "frames", "framesPerSecond"});
  NoiseMap map;
  map.kind = static_cast<NoiseKind>(value.at("kind").word({"fbm", "ridged", "worley"}));
  if (const auto octaves = value.find("octaves")) map.octaves = static_cast<std::uint32_t>(octaves->integer(1, 8));
  if (const auto frequency = value.find("frequency")) map.frequency = frequency->number({0.1, 64});
  if (const auto seed = value.find("seed")) map.seed = static_cast<std::uint32_t>(seed->integer(0, 0xffffffff));
  if (const auto frames = value.find("frames")) {
    map.frames = static_cast<std::uint32_t>(frames->integer(1, format::kMaxAnimatedMaps));
  }
  if (const auto speed = value.find("framesPerSecond")) {
    if (map.frames == 1) speed->fail("2 or more frames beside it");
    emitter.record.mapsPerSecond = speed->single({-1000, 1000});
  }
  emitter.map = map;
}

void readDisplacement(const Value& value, const std::filesystem::path& folder, EmitterDescription& emitter) {
  value.requireKeys({"amount", "noise", "picture"});
  const Keys amount = readCurve(value.at("amount"), kLife, {0, kMostDisplacement});
  takeCurve(amount, emitter.record.displacement, emitter.displacement);
  if (!emitter.displacement.empty()) {  // the record's factor is bounded too
    emitter.record.displacement = static_cast<float>(kMostDisplacement);
    for (auto& key : emitter.displacement.values) key[0] /= kMostDisplacement;
  }
  const auto picture = value.find("picture");
  if (!picture) return readNoise(value.at("noise"), emitter);
  if (value.find("noise")) picture->fail("either a picture or noise");
  emitter.picture = readImage((folder / picture->text("a picture *.exr or *.png")).string());
}

// So that the bounding sphere has the radius 1.
void readProportions(const Value& primitive, format::EmitterRecord& record) {
  const auto proportions = primitive.find("proportions");
  if (record.kind == format::kKindSphere) {
    if (proportions) proportions->fail("no proportions of a sphere; \"ellipsoid\" has them");
    return;
  }
  if (!proportions) primitive.fail("\"proportions\": radii (ellipsoid), half axis (capsule) or half sides (box)");
  const auto p = proportions->numbers<3>({0, 1000});
  const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  if (record.kind == format::kKindCapsule) {
    if (!(length <= 0.95)) proportions->fail("a half axis of at most 0.95, as a share of the radius");
    return setColour(p, record.proportions);
  }
  if (!(std::min({p[0], p[1], p[2]}) > 0)) proportions->fail("three numbers above 0");
  const double whole = record.kind == format::kKindBox ? length : largest(p);
  setColour({p[0] / whole, p[1] / whole, p[2] / whole}, record.proportions);
}

void readProfile(const Value& value, EmitterDescription& emitter) {
  if (value.isArray()) {
    emitter.material.profile = format::kProfileCurve;
    emitter.profile = readCurve(value, kShare, kShare);
    return;
  }
  emitter.material.profile = static_cast<std::uint32_t>(value.word({"constant", "radial"}));
}

void readDensity(const Value& value, EmitterDescription& emitter) {
  value.requireKeys({"extinction", "opacity", "profile", "softness", "erosion"});
  emitter.record.extinction = value.at("extinction").single(kPositive);
  if (const auto opacity = value.find("opacity")) emitter.opacity = readCurve(*opacity, kLife, kPositive);
  if (const auto profile = value.find("profile")) readProfile(*profile, emitter);
  if (const auto softness = value.find("softness")) emitter.material.softness = softness->single({0.001, 1});
  if (const auto erosion = value.find("erosion")) {
    erosion->requireKeys({"amount", "frequency"});
    emitter.material.erosion = erosion->at("amount").single(kShare);
    emitter.material.erosionFrequency =
        erosion->at("frequency").single({0.01, static_cast<double>(format::kMaxErosionFrequency)});
  }
}

}  // namespace

std::array<double, 3> Emission::at(double time) const {
  std::array<double, 3> product = colour.at(time);
  std::array<double, 3> heat{1, 1, 1};
  double brightest = 1;
  if (!temperature.empty()) {
    double hottest = 0;
    for (const auto& key : temperature.values) hottest = std::max(hottest, key[0]);
    brightest = largest(blackBody(hottest));
    heat = blackBody(temperature.at(time)[0]);
  }
  for (std::size_t c = 0; c < 3; ++c) product[c] *= strength.at(time)[0] * heat[c] / brightest;
  return product;
}

void readPrimitive(const Value& value, const std::filesystem::path& folder, EmitterDescription& emitter) {
  value.requireKeys({"kind", "proportions", "radius", "radiusOverLife", "density", "diffuse", "emission", "rotation",
                     "displacement"});
  format::EmitterRecord& record = emitter.record;
  record.kind = static_cast<std::uint32_t>(value.at("kind").word({"sphere", "ellipsoid", "capsule", "box"}));
  readProportions(value, record);
  const auto radius = value.find("radius");
  record.radius[0] = record.radius[1] = 1;  // what is given has radii of its own
  if (radius || !emitter.given) readSpan(value.at("radius"), kPositive, record.radius);
  if (const auto curve = value.find("radiusOverLife")) emitter.radius = readCurve(*curve, kLife, {0, 1000});
  emitter.material.softness = 0.25f;
  emitter.material.erosionFrequency = 1;
  std::fill_n(record.diffuse, 3, 0.8f);
  readDensity(value.at("density"), emitter);
  if (const auto diffuse = value.find("diffuse")) readDiffuse(*diffuse, folder, emitter);
  if (const auto emission = value.find("emission")) readEmission(*emission, folder, emitter);
  if (const auto rotation = value.find("rotation")) readRotation(*rotation, emitter);
  if (const auto displacement = value.find("displacement")) readDisplacement(*displacement, folder, emitter);
}

}  // namespace billow::compiler
