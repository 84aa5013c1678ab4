// Effect descriptions: what is refused and how, what becomes of the rest.
#include <gtest/gtest.h>
#include <unistd.h>
#include <xxhash.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "billow/format/pack.h"
#include "billow/format/validate.h"
#include "compile.h"
#include "effect/bake_effect.h"
#include "effect/bc4.h"
#include "effect/black_body.h"
#include "effect/noise_map.h"
#include "effect/rasterise.h"
#include "effect/read.h"
#include "effect/simulate.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
namespace fs = std::filesystem;

class EffectFile {
 public:
  explicit EffectFile(const std::string& text) {
    path_ = (fs::temp_directory_path() / ("billow_effect_" + std::to_string(::getpid()) + ".effect.json")).string();
    std::ofstream(path_) << text;
  }
  EffectFile(const EffectFile&) = delete;
  EffectFile& operator=(const EffectFile&) = delete;
  ~EffectFile() { fs::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

json smallest() {
  return json::parse(R"({"name": "test", "duration": 2, "emitters": [{
    "name": "puffs", "rate": 10, "lifetime": 1,
    "primitive": {"kind": "sphere", "radius": 1, "density": {"extinction": 2}}}]})");
}

EffectDescription read(const json& document) {
  return readEffect(EffectFile(document.dump()).path());
}

format::PackTables bake(const json& document) {
  format::PackTables tables;
  const EffectDescription effect = read(document);
  bakeEffects({&effect, 1}, tables);
  return tables;
}

// ---- What is refused

struct Refusal {
  const char* pointer;   // where `value` is put; as in JSON pointers
  const char* value;     // JSON, or "" to take the member away
  const char* expected;  // in the message
};

TEST(EffectSchema, RefusalsNamePlaceValueAndWhatWasExpected) {
  const Refusal refusals[] = {
      {"/name", "", "name is missing"},
      {"/name", "\"\"", "name is \"\""},
      {"/duration", "0", "duration is 0"},
      {"/duration", "1e9", "3600"},
      {"/seed", "-1", "seed is -1"},
      {"/loop", "1", "loop is 1"},
      {"/prewarm", "true", "\"loop\": true beside it"},
      {"/emiters", "[]", "emitters"},
      {"/emitters", "[]", "emitters is []"},
      {"/emitters/0/rate", "-1", "emitters[0].rate is -1"},
      {"/emitters/0/rate", "[[0, 1], [0, 2]]", "emitters[0].rate[1][0] is 0"},
      {"/emitters/0/rate", "[[0, 1], [3, 2]]", "emitters[0].rate[1][0] is 3"},
      {"/emitters/0/rate", "[[0, 1, 2]]", "emitters[0].rate[0]"},
      {"/emitters/0/rate", "1e6", "1048576 particles in one run"},
      {"/emitters/0/rate", "0", "at least one particle"},
      {"/emitters/0/rates", "1", "rate"},
      {"/emitters/0/bursts", "[{\"time\": 5, \"count\": 1}]", "emitters[0].bursts[0].time is 5"},
      {"/emitters/0/bursts", "[{\"time\": 0, \"count\": 0}]", "emitters[0].bursts[0].count is 0"},
      {"/emitters/0/bursts", "[{\"time\": 0, \"count\": 70000}]", "at most 65536"},
      {"/emitters/0/lifetime", "601", "emitters[0].lifetime is 601"},
      {"/emitters/0/lifetime", "[2, 1]", "the smaller number first"},
      {"/emitters/0/lifetime", "0", "emitters[0].lifetime is 0"},
      {"/emitters/0/shape", "{\"type\": \"mesh\"}", "emitters[0].shape.type is \"mesh\""},
      {"/emitters/0/shape", "{\"type\": \"box\", \"radius\": 1}", "radius"},
      {"/emitters/0/velocity", "{\"speed\": 1, \"direction\": [0, 0, 0]}", "emitters[0].velocity.direction is [0,0,0]"},
      {"/emitters/0/velocity", "{\"speed\": 1, \"spread\": 181}", "emitters[0].velocity.spread is 181"},
      {"/emitters/0/forces", "{\"wind\": [1, 0, 0]}", "a drag above 0"},
      {"/emitters/0/forces", "{\"drag\": \"much\"}", "emitters[0].forces.drag is \"much\""},
      {"/emitters/0/forces", "{\"curlNoise\": {\"speed\": 1, \"frequency\": 1}}", "a drag above 0"},
      {"/emitters/0/forces", "{\"drag\": 1, \"curlNoise\": {\"speed\": 1}}", "curlNoise.frequency is missing"},
      {"/emitters/0/forces", "{\"attractor\": {\"position\": [0, 0, 0], \"strength\": 1, \"radius\": 0}}",
       "attractor.radius is 0"},
      {"/emitters/0/forces", "{\"vortex\": {}}", "vortex"},
      {"/emitters/0/tracks", "{\"error\": 0.1}", "other motion needs no track"},
      {"/emitters/0/primitive/kind", "\"cube\"", "primitive.kind is \"cube\""},
      {"/emitters/0/primitive/kind", "\"box\"", "\"proportions\""},
      {"/emitters/0/primitive/proportions", "[1, 1, 1]", "no proportions of a sphere"},
      {"/emitters/0/primitive/radius", "-1", "primitive.radius is -1"},
      {"/emitters/0/primitive/density/extinction", "", "density.extinction is missing"},
      {"/emitters/0/primitive/density/profile", "\"soft\"", "density.profile is \"soft\""},
      {"/emitters/0/primitive/density/profile", "[[0, 2]]", "density.profile[0][1] is 2"},
      {"/emitters/0/primitive/diffuse", "{\"colour\": [1, 2, 0]}", "diffuse.colour[1] is 2"},
      {"/emitters/0/primitive/diffuse", "{\"ramp\": [{\"age\": 0}]}", "diffuse.ramp[0]"},
      {"/emitters/0/primitive/emission", "{}", "emission.strength is missing"},
      {"/emitters/0/primitive/emission", "{\"strength\": 1, \"temperature\": 20}", "emission.temperature is 20"},
      {"/emitters/0/primitive/displacement", "{\"amount\": 1}", "displacement.amount is 1"},
      {"/emitters/0/primitive/displacement", "{\"amount\": 0.5, \"noise\": {\"kind\": \"perlin\"}}",
       "noise.kind is \"perlin\""},
      {"/emitters/0/primitive/displacement",
       "{\"amount\": 0.5, \"noise\": {\"kind\": \"fbm\", \"framesPerSecond\": 2}}", "2 or more frames"},
  };
  ASSERT_NO_THROW(read(smallest()));
  for (const Refusal& refusal : refusals) {
    json document = smallest();
    const json::json_pointer pointer(refusal.pointer);
    if (*refusal.value == 0) {
      document[pointer.parent_pointer()].erase(pointer.back());
    } else {
      document[pointer] = json::parse(refusal.value);
    }
    try {
      read(document);
      ADD_FAILURE() << refusal.pointer << " " << refusal.value << " passed";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      const std::string message = error.what();
      EXPECT_NE(message.find(refusal.expected), std::string::npos) << refusal.pointer << " gave " << message;
      EXPECT_NE(message.find(".effect.json: "), std::string::npos) << message;
    }
  }
}

TEST(EffectSchema, TooManyAliveAreCounted) {
  json document = smallest();
  document["loop"] = true;
  document["emitters"][0]["rate"] = 1000;
  document["emitters"][0]["lifetime"] = 100;
  try {
    read(document);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("10000"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("at most 65536"), std::string::npos) << error.what();
  }
}

TEST(EffectSchema, MissingAndBrokenFiles) {
  EXPECT_THROW(
      try { readEffect("/nowhere.effect.json"); } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::file);
        throw;
      },
      Error);
  EXPECT_THROW(readEffect(EffectFile("{ \"name\": ").path()), Error);
}

// ---- What is baked

TEST(EffectBake, RateCurvesLoseNoParticle) {
  json document = smallest();
  document["emitters"][0]["rate"] = json::parse("[[0.2, 0], [1, 37], [1.5, 3]]");
  const EffectDescription effect = read(document);
  const auto& spans = effect.emitters[0].spans;
  std::uint32_t born = 0;
  for (const format::SpawnSpan& span : spans) {
    EXPECT_EQ(span.first, born);
    born += span.count;
  }
  EXPECT_EQ(born, std::lround(0.8 * 37 / 2 + 0.5 * 20 + 0.5 * 3));
  EXPECT_GE(spans.front().begin, 0.19f);
}

TEST(EffectBake, CurvesAndRampsAreSampled) {
  json document = smallest();
  json& primitive = document["emitters"][0]["primitive"];
  primitive["density"]["opacity"] = json::parse("[[0, 0], [1, 63]]");
  primitive["diffuse"] = json::parse(R"({"ramp": [{"age": 0, "stops": [[0, [0, 0, 0]], [1, [1, 0, 0]]]},
                                                   {"age": 1, "stops": [[0, [0, 1, 0]]]}]})");
  primitive["emission"] = json::parse(R"({"strength": [[0, 2], [1, 0]], "colour": [1, 0.5, 0]})");
  const format::PackTables tables = bake(document);
  const format::EmitterRecord& emitter = tables.effects.emitters[0];
  ASSERT_NE(emitter.opacityRow, format::kNoRow);
  for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
    EXPECT_NEAR(tables.effects.curves[emitter.opacityRow].values[i], static_cast<float>(i), 1e-4f);
    EXPECT_NEAR(tables.effects.curves[emitter.emissionRow + 1].values[i], 1 - static_cast<float>(i) / 63, 1e-5f);
  }
  const format::RampTable& ramp = tables.effects.ramps[tables.effects.materials[0].diffuseRamp];
  EXPECT_EQ(ramp.values[0][31][0], 1);
  EXPECT_NEAR(ramp.values[5][31][1], 1.0f / 3, 1e-6f);
  EXPECT_EQ(emitter.radiusRow, format::kNoRow);
}

TEST(EffectBake, EqualThingsAreStoredOnce) {
  json document = smallest();
  json& emitters = document["emitters"];
  emitters[0]["primitive"]["radiusOverLife"] = json::parse("[[0, 0], [1, 1]]");
  emitters[0]["primitive"]["displacement"] = json::parse(R"({"amount": 0.3, "noise": {"kind": "fbm"}})");
  emitters.push_back(emitters[0]);
  emitters[1]["name"] = "more puffs";
  const format::PackTables tables = bake(document);
  EXPECT_EQ(tables.effects.materials.size(), 1u);
  EXPECT_EQ(tables.effects.curves.size(), 1u);
  EXPECT_EQ(tables.effects.maps.size(), 1u);
}

TEST(EffectBake, HeatHasItsColours) {
  const auto candle = blackBody(1900), day = blackBody(6500), blue = blackBody(15000);
  EXPECT_GT(candle[0], 2 * candle[1]);
  EXPECT_GT(candle[1], 2 * candle[2]);
  EXPECT_NEAR(day[1] / day[0], 1, 0.08);
  EXPECT_NEAR(day[2] / day[0], 1, 0.08);
  EXPECT_GT(blue[2], blue[0]);
  EXPECT_GT(largest(day), 100 * largest(candle));
}

// ---- Tracks

json whirling() {
  json document = smallest();
  document["emitters"][0]["velocity"] = json::parse(R"({"speed": [1, 2], "spread": 40})");
  document["emitters"][0]["forces"] = json::parse(R"({"gravity": [0, -1, 0], "drag": 0.8, "wind": [1, 0, 0],
                                                      "curlNoise": {"speed": 0, "frequency": 0.7}})");
  return document;
}

// Without whirls, the steps must arrive where the closed form does.
TEST(EffectTracks, SimulationAgreesWithTheClosedForm) {
  json document = whirling();
  document["emitters"][0]["tracks"] = {{"framesPerSecond", 60}, {"error", 0.001}};
  format::EffectTables tables = bake(document).effects;
  for (const double time : {0.05, 0.5, 0.777, 1.5, 2.4}) {
    const auto sampled = format::particlesAt(tables, 0, time);
    tables.emitters[0].track = format::kNoTrack;
    const auto exact = format::particlesAt(tables, 0, time);
    tables.emitters[0].track = 0;
    ASSERT_EQ(sampled.size(), exact.size());
    ASSERT_FALSE(sampled.empty());
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_EQ(sampled[i].seed, exact[i].seed);
      for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(sampled[i].center[a], exact[i].center[a], 0.005f) << time;
    }
  }
}

TEST(EffectTracks, PlacesKeepTheErrorAskedFor) {
  json document = whirling();
  document["emitters"][0]["forces"]["curlNoise"]["speed"] = 3;
  const EffectDescription effect = read(document);
  const format::EffectTables tables = bake(document).effects;
  const auto births = format::birthsOf(tables, tables.effects[0], 0);
  const TrackPoints points = simulate(births, effect.emitters[0], "test");
  ASSERT_EQ(points.size(), tables.trackPoints.size());
  double worst = 0;
  std::size_t count = 0;
  for (std::size_t f = 0; f < points.size(); ++f) {
    ASSERT_EQ(points[f].size(), tables.trackPoints[f].size());
    for (std::size_t i = 0; i < points[f].size(); ++i, ++count) {
      EXPECT_EQ(points[f][i].number, tables.trackPoints[f][i].number);
      double square = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double off = static_cast<double>(points[f][i].position[a] - tables.trackPoints[f][i].position[a]);
        square += off * off;
      }
      worst = std::max(worst, std::sqrt(square));
    }
  }
  EXPECT_GT(count, 200u);
  EXPECT_LE(worst, effect.emitters[0].trackError * 1.0001);
  EXPECT_GT(worst, effect.emitters[0].trackError * 0.05);
}

TEST(EffectTracks, WhirlsDoNotGatherAndAttractorsDo) {
  const auto extent = [](const json& document) {
    const auto particles = format::particlesAt(bake(document).effects, 0, 1.99);
    double sum = 0;
    for (const format::Particle& p : particles) {
      sum += static_cast<double>(p.center[0] * p.center[0] + p.center[1] * p.center[1] + p.center[2] * p.center[2]);
    }
    return std::sqrt(sum / static_cast<double>(particles.size()));
  };
  json still = smallest();
  still["emitters"][0]["shape"] = json::parse(R"({"type": "box", "halfSides": [4, 4, 4]})");
  still["emitters"][0]["rate"] = 300;
  json whirls = still, pulled = still;
  whirls["emitters"][0]["forces"] = json::parse(R"({"drag": 5, "curlNoise": {"speed": 2, "frequency": 0.5}})");
  pulled["emitters"][0]["forces"] =
      json::parse(R"({"drag": 1, "attractor": {"position": [0, 0, 0], "strength": 20, "radius": 2}})");
  const double before = extent(still);
  EXPECT_NEAR(extent(whirls) / before, 1, 0.15);
  EXPECT_LT(extent(pulled), 0.85 * before);
}

TEST(EffectTracks, TheirSizeIsLimited) {
  json document = whirling();
  document["emitters"][0]["rate"] = 4000;
  document["emitters"][0]["tracks"] = {{"framesPerSecond", 240}};
  document["emitters"][0]["lifetime"] = 8;
  try {
    bake(document);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("emitters[0]: its track would have"), std::string::npos) << error.what();
  }
  document["emitters"][0]["rate"] = 10;
  document["emitters"][0]["tracks"] = {{"error", 1e-6}};
  document["emitters"][0]["velocity"]["speed"] = 1000;
  EXPECT_THROW(bake(document), Error);
}

// ---- Displacement

TEST(EffectMaps, Bc4IsNearItsTexels) {
  std::uint32_t state = 1;
  for (int round = 0; round < 2000; ++round) {
    std::array<std::uint8_t, 16> texels{};
    const std::uint32_t base = state >> 24, span = round % 5 == 0 ? 0 : state >> 12 & 127;
    for (std::uint8_t& texel : texels) {
      state = state * 1664525 + 1013904223;
      texel = static_cast<std::uint8_t>(std::min(255u, base + (span == 0 ? 0 : (state >> 16) % (span + 1))));
    }
    const auto [least, most] = std::minmax_element(texels.begin(), texels.end());
    const float bound = (static_cast<float>(*most - *least) / 14 + (span == 0 ? 0 : 4.01f)) / 255;
    std::array<float, 16> decoded{};
    format::decodeBc4(encodeBc4(texels), decoded);
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(decoded[i], static_cast<float>(texels[i]) / 255, bound + 1e-6f);
  }
}

TEST(EffectMaps, NoiseFillsItsRangeAndIsTheSameEverywhere) {
  std::uint64_t hash = 0;
  for (const NoiseKind kind : {NoiseKind::fbm, NoiseKind::ridged, NoiseKind::worley}) {
    NoiseMap noise;
    noise.kind = kind;
    noise.frames = kind == NoiseKind::fbm ? 6 : 1;
    const auto maps = makeNoiseMaps(noise);
    ASSERT_EQ(maps.size(), noise.frames);
    float least = 1, most = 0;
    for (const format::CubeMap& map : maps) {
      const format::DecodedCube cube(map);
      for (std::uint32_t t = 0; t < 6 * 64 * 64; ++t) {
        const float value = cube.texel(t / 4096, t % 64, t / 64 % 64);
        least = std::min(least, value);
        most = std::max(most, value);
      }
      hash = XXH3_64bits_withSeed(map.blocks.data(), map.blocks.size(), hash);
    }
    EXPECT_LT(least, 0.02f);
    EXPECT_GT(most, 0.98f);
  }
  EXPECT_EQ(hash, 13903595054640316176u);
}

// ---- Pictures

template <class T>
void put(std::string& text, T value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void attribute(std::string& text, const std::string& name, const std::string& type, const std::string& value) {
  text += name + '\0' + type + '\0';
  put(text, static_cast<std::int32_t>(value.size()));
  text += value;
}

// The simplest EXR: one channel of floats, not compressed.
std::string exrBytes(std::int32_t width, std::int32_t height, const std::vector<float>& values) {
  const auto numbers = [](auto... all) {
    std::string text;
    (put(text, all), ...);
    return text;
  };
  std::string text = numbers(20000630, 2);
  const std::string channel = std::string("Y") + '\0' + numbers(2, 0, 1, 1) + '\0';  // type float, linear, every pixel
  attribute(text, "channels", "chlist", channel);
  attribute(text, "compression", "compression", std::string(1, '\0'));
  attribute(text, "dataWindow", "box2i", numbers(0, 0, width - 1, height - 1));
  attribute(text, "displayWindow", "box2i", numbers(0, 0, width - 1, height - 1));
  attribute(text, "lineOrder", "lineOrder", std::string(1, '\0'));
  attribute(text, "pixelAspectRatio", "float", numbers(1.0f));
  attribute(text, "screenWindowCenter", "v2f", numbers(0.0f, 0.0f));
  attribute(text, "screenWindowWidth", "float", numbers(1.0f));
  text += '\0';
  const std::size_t line = 8 + static_cast<std::size_t>(width) * 4;
  const std::size_t first = text.size() + static_cast<std::size_t>(height) * 8;
  for (std::int32_t y = 0; y < height; ++y)
    put(text, static_cast<std::uint64_t>(first + line * static_cast<std::size_t>(y)));
  for (std::int32_t y = 0; y < height; ++y) {
    text += numbers(y, width * 4);
    for (std::int32_t x = 0; x < width; ++x) put(text, values[static_cast<std::size_t>(y * width + x)]);
  }
  return text;
}

class Picture {
 public:
  explicit Picture(const std::string& bytes, const std::string& extension = ".exr")
      : name_("billow_" + std::to_string(::getpid()) + extension) {
    std::ofstream(fs::temp_directory_path() / name_, std::ios::binary) << bytes;
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;
  ~Picture() { fs::remove(fs::temp_directory_path() / name_); }
  const std::string& name() const { return name_; }

 private:
  std::string name_;  // relative to the description's folder
};

TEST(EffectPictures, DisplaceInTheirDirections) {
  std::vector<float> values(16 * 8);
  for (const std::size_t row : {3u, 4u}) values[row * 16 + 11] = values[row * 16 + 12] = 5;  // about +X
  const Picture picture(exrBytes(16, 8, values));
  json document = smallest();
  document["emitters"][0]["primitive"]["displacement"] = {{"amount", 0.5}, {"picture", picture.name()}};
  const format::PackTables tables = bake(document);
  ASSERT_EQ(tables.effects.maps.size(), 1u);
  const format::DecodedCube cube(tables.effects.maps[0]);
  EXPECT_NEAR(cube.sample({1, 0, 0}), 1, 0.02f);
  EXPECT_NEAR(cube.sample({1, 0.05f, -0.05f}), 1, 0.02f);
  for (const std::array<float, 3>& direction :
       {std::array<float, 3>{-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
    EXPECT_NEAR(cube.sample(direction), 0, 0.02f);
  }
}

TEST(EffectPictures, AreRamps) {
  const Picture picture(exrBytes(2, 2, {0, 1, 0, 0}));
  json document = smallest();
  document["emitters"][0]["primitive"]["diffuse"] = {{"ramp", picture.name()}};
  const format::PackTables tables = bake(document);
  const format::RampTable& ramp = tables.effects.ramps.at(0);
  EXPECT_EQ(ramp.values[0][0][0], 0);
  EXPECT_EQ(ramp.values[0][31][1], 1);
  EXPECT_EQ(ramp.values[15][31][2], 0);
}

TEST(EffectPictures, BrokenOnesAreNamed) {
  const std::string sound = exrBytes(4, 4, std::vector<float>(16, 1));
  const auto refuse = [](const std::string& name, const std::string& expected, Fault fault) {
    json document = smallest();
    document["emitters"][0]["primitive"]["displacement"] = {{"amount", 0.5}, {"picture", name}};
    try {
      read(document);
      ADD_FAILURE() << name << " passed; expected " << expected;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), fault);
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  };
  refuse("nowhere.exr", "nowhere.exr", Fault::file);
  const Picture jpg("text", ".jpg"), png("text", ".png");
  refuse(jpg.name(), "*.exr or *.png", Fault::input);
  refuse(png.name(), "not a PNG", Fault::input);
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{40}, sound.size() / 2, sound.size() - 5}) {
    const Picture cut(sound.substr(0, size));
    refuse(cut.name(), "not a usable EXR", Fault::input);
  }
  const Picture infinite(exrBytes(1, 1, {std::numeric_limits<float>::infinity()}));
  refuse(infinite.name(), "pixel 0,0 is inf", Fault::input);
  std::string huge = sound;  // the data window says 30000 x 30000
  const std::size_t window = huge.find("box2i") + 6 + 4 + 8;
  const std::int32_t edge = 30000;
  for (const std::size_t at : {window, window + 4}) std::memcpy(huge.data() + at, &edge, 4);
  const Picture large(huge);
  refuse(large.name(), large.name(), Fault::input);
}

// ---- Grids

TEST(EffectGrids, ASphereHasItsMass) {
  json document = smallest();
  document["emitters"][0]["bursts"] = json::parse(R"([{"time": 0, "count": 1}])");
  document["emitters"][0].erase("rate");
  document["emitters"][0]["primitive"]["density"]["softness"] = 0.001;
  const format::PackTables tables = bake(document);
  const auto particles = format::particlesAt(tables.effects, 0, 0.5);
  const RasterisedEffect grids = rasterise(tables.effects, particles, 0.05);
  double mass = 0;
  for (const Leaf& leaf : grids.density.leaves) {
    for (const float value : leaf.values) mass += static_cast<double>(value) * 0.05 * 0.05 * 0.05;
  }
  EXPECT_NEAR(mass, 2 * 4 / 3.0 * std::numbers::pi, 0.05);
  EXPECT_EQ(grids.density.max, 2);
  EXPECT_EQ(grids.colour[0].max, 0.8f);
  EXPECT_EQ(grids.emission[0].max, 0);
  EXPECT_THROW(rasterise(tables.effects, particles, 1e-4), Error);
}

// ---- Packs

std::vector<std::string> sampleEffects() {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(fs::path(BILLOW_SOURCE_DIR) / "samples/effects")) {
    if (entry.path().string().ends_with(".effect.json")) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<char> compiled(const std::vector<std::string>& inputs, unsigned threads) {
  const std::string path = (fs::temp_directory_path() / ("billow_" + std::to_string(::getpid()) + ".blw")).string();
  CompileOptions options;
  options.threads = threads;
  compile(inputs, path, options, [](const std::string&) {});
  const auto source = format::openFileSource(path);
  std::vector<std::string> issues;
  format::validate(**source, {}, [&](const format::Issue& issue) { issues.push_back(toString(issue)); });
  EXPECT_EQ(issues, std::vector<std::string>{});
  std::ifstream file(path, std::ios::binary);
  std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  fs::remove(path);
  return bytes;
}

TEST(EffectPacks, TheSamplesCompileToTheSameBytesOnAnyThreads) {
  ASSERT_EQ(sampleEffects().size(), 6u);
  const auto one = compiled(sampleEffects(), 1);
  EXPECT_EQ(one, compiled(sampleEffects(), 4));
  EXPECT_LT(one.size(), 2u << 20);
}

TEST(EffectPacks, TheSamplesAreAliveWhenTheyShould) {
  for (const std::string& file : sampleEffects()) {
    const EffectDescription effect = readEffect(file);
    format::PackTables tables;
    bakeEffects({&effect, 1}, tables);
    const std::uint64_t bound = format::mostAlive(tables.effects, tables.effects.effects[0]);
    std::size_t most = 0;
    for (int i = 0; i < 100; ++i) most = std::max(most, format::particlesAt(tables.effects, 0, i * 0.05).size());
    EXPECT_GT(most, 0u) << file;
    EXPECT_LE(most, bound) << file;
  }
}

TEST(EffectPacks, ManifestsNameEffects) {
  const fs::path manifest = fs::temp_directory_path() / ("billow_" + std::to_string(::getpid()) + ".json");
  const json document = {{"effects", {sampleEffects()[0], sampleEffects()[1]}}};
  std::ofstream(manifest) << document;
  EXPECT_EQ(compiled({manifest.string()}, 2), compiled({sampleEffects()[0], sampleEffects()[1]}, 2));
  EXPECT_EQ(compiled({manifest.string(), sampleEffects()[2]}, 2).empty(), false);
  std::ofstream(manifest) << "{}";
  EXPECT_THROW(compiled({manifest.string()}, 2), Error);
  fs::remove(manifest);
}

TEST(EffectPacks, OneNameForTwoEffectsIsRefused) {
  const std::string file = sampleEffects()[0];
  EXPECT_THROW(compiled({file, file}, 1), Error);
}

}  // namespace
}  // namespace billow
