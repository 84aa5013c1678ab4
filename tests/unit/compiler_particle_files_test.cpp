// Particles from files, from their frames to what a pack says of them at any time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "compile.h"
#include "effect/read.h"
#include "effect_document.h"
#include "ply_file.h"
#include "stages.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::PlyColumn;
namespace fs = std::filesystem;

struct Point {
  double x, y, z, radius;
};
using Cloud = std::map<int, Point>;  // by id

class ParticleFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("billow_particles_" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::vector<PlyColumn> columnsOf(const Cloud& cloud) {
    std::vector<PlyColumn> columns{
        {"float", "x", {}}, {"float", "y", {}}, {"float", "z", {}}, {"float", "pscale", {}}, {"int", "id", {}}};
    for (auto point = cloud.rbegin(); point != cloud.rend(); ++point) {  // backward: order must not matter
      const double values[] = {point->second.x, point->second.y, point->second.z, point->second.radius,
                               static_cast<double>(point->first)};
      for (std::size_t c = 0; c < 5; ++c) columns[c].values.push_back(values[c]);
    }
    return columns;
  }
  void write(int number, const std::vector<PlyColumn>& columns, const std::string& encoding = "binary_big_endian") {
    const std::string name = "dust_" + std::string(number < 10 ? "000" : "00") + std::to_string(number) + ".ply";
    std::ofstream(folder_ / name, std::ios::binary) << tests::plyText(encoding, columns);
  }
  void write(const std::vector<Cloud>& clouds, int first = 1) {
    for (std::size_t f = 0; f < clouds.size(); ++f) write(first + static_cast<int>(f), columnsOf(clouds[f]));
  }

  static json document() {
    return json::parse(R"({"name": "test", "duration": 2, "emitters": [{"name": "dust",
      "particles": {"files": "dust_####.ply", "framesPerSecond": 10, "error": 0.01},
      "primitive": {"kind": "sphere", "density": {"extinction": 2}}}]})");
  }
  EffectDescription readDescription(const json& text) {
    const std::string path = (folder_ / "test.effect.json").string();
    std::ofstream(path) << text.dump();
    return readEffect(path);
  }
  format::EffectTables tablesOf(const json& text) {
    format::PackTables tables;
    const EffectDescription effect = readDescription(text);
    bakeEffects({&effect, 1}, tables);
    return tables.effects;
  }
  std::string errorOf(const json& text, Fault fault = Fault::input) {
    try {
      tablesOf(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), fault) << error.what();
      return error.what();
    }
    return "";
  }
  void expectError(const json& text, const std::string& expected) {
    const std::string error = errorOf(text);
    EXPECT_NE(error.find(expected), std::string::npos) << error;
  }

  fs::path folder_;
};

// Particles that drift and shrink; id 5 vanishes in frame 4 and is back in frame 6, id 9 is born in frame 2.
std::vector<Cloud> sequence() {
  std::vector<Cloud> clouds(8);
  for (int f = 0; f < 8; ++f) {
    for (const int id : {3, 5, 9, 70000, -2}) {
      if ((id == 5 && (f == 4 || f == 5)) || (id == 9 && f < 2)) continue;
      clouds[static_cast<std::size_t>(f)][id] = {(id & 15) + f * f * 0.1, std::sin(id + f), f * 0.5,
                                                 0.5 / (1 + f * 0.1 * (id == 3))};
    }
  }
  return clouds;
}

double distance(const format::Particle& particle, const Point& point) {
  const double x = static_cast<double>(particle.center[0]) - point.x,
               y = static_cast<double>(particle.center[1]) - point.y,
               z = static_cast<double>(particle.center[2]) - point.z;
  return std::sqrt(x * x + y * y + z * z);
}

// The points of two frames mixed, those alone that are in the first.
Cloud between(const Cloud& a, const Cloud& b, double share) {
  Cloud mixed;
  for (const auto& [id, p] : a) {
    const Point& q = b.contains(id) ? b.at(id) : p;
    mixed[id] = {p.x + (q.x - p.x) * share, p.y + (q.y - p.y) * share, p.z + (q.z - p.z) * share,
                 p.radius + (q.radius - p.radius) * share};
  }
  return mixed;
}

// Each particle is near a point of its own.
void expectCloud(const std::vector<format::Particle>& particles, const Cloud& cloud, double error, double time) {
  ASSERT_EQ(particles.size(), cloud.size()) << time;
  for (const auto& [id, point] : cloud) {
    const auto nearest =
        std::min_element(particles.begin(), particles.end(),
                         [&, p = point](const auto& a, const auto& b) { return distance(a, p) < distance(b, p); });
    EXPECT_LE(distance(*nearest, point), error) << "id " << id << " at " << time;
    EXPECT_NEAR(static_cast<double>(nearest->radius), point.radius, error) << "id " << id << " at " << time;
  }
}

TEST_F(ParticleFiles, AreWhereTheFilesSayAtFramesAndBetween) {
  const std::vector<Cloud> clouds = sequence();
  write(clouds);
  for (const double error : {0.05, 0.001}) {
    json text = document();
    text["emitters"][0]["particles"]["error"] = error;
    const format::EffectTables tables = tablesOf(text);
    for (std::size_t f = 0; f < clouds.size(); ++f) {
      const Cloud& next = clouds[std::min(f + 1, clouds.size() - 1)];
      for (const double share : {0.0, 0.3, 0.99}) {
        const double time = (static_cast<double>(f) + share) / 10;
        expectCloud(format::particlesAt(tables, 0, time), between(clouds[f], next, share), error + 1e-6, time);
      }
    }
    EXPECT_TRUE(format::particlesAt(tables, 0, 0.81).empty());
  }
}

TEST_F(ParticleFiles, ComeBackAsOthersWithTheSameRandomNumbers) {
  write(sequence());
  const format::EffectTables tables = tablesOf(document());
  ASSERT_EQ(tables.given.size(), 6u);
  std::vector<format::GivenParticle> fives;
  for (const auto& given : tables.given) {
    if (given.id == 5) fives.push_back(given);
  }
  ASSERT_EQ(fives.size(), 2u);
  EXPECT_EQ(fives[0].time, 0);
  EXPECT_NEAR(fives[0].lifetime, 0.4f, 1e-6f);
  EXPECT_NEAR(fives[1].time, 0.6f, 1e-6f);
  EXPECT_NEAR(fives[1].lifetime, 0.2f, 1e-6f);
  // In order of birth, then of ids.
  EXPECT_EQ(tables.given[0].id, static_cast<std::uint32_t>(-2));
  EXPECT_EQ(tables.given[1].id, 3u);
  EXPECT_EQ(tables.given[4].id, 9u);
  const auto seedNear = [&](double time) {
    std::vector<std::uint32_t> seeds;
    for (const auto& particle : format::particlesAt(tables, 0, time)) seeds.push_back(particle.seed);
    std::sort(seeds.begin(), seeds.end());
    return seeds;
  };
  EXPECT_EQ(seedNear(0.35), seedNear(0.75));
  EXPECT_EQ(seedNear(0.45).size(), 4u);
}

TEST_F(ParticleFiles, RunsOfALoopAreAlike) {
  write(sequence());
  json text = document();
  text["loop"] = true;
  text["duration"] = 0.8;
  const format::EffectTables tables = tablesOf(text);
  const auto once = format::particlesAt(tables, 0, 0.25), again = format::particlesAt(tables, 0, 0.25 + 0.8f * 4.0);
  ASSERT_EQ(once.size(), again.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].seed, again[i].seed);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(once[i].center[a], again[i].center[a], 1e-5f);
  }
  EXPECT_FALSE(format::particlesAt(tables, 0, 0.799).empty());
}

// A last frame at the end of the run leads to the first of the next: nobody is there twice, nor rests.
TEST_F(ParticleFiles, ALoopIsClosedByALastFrameLikeTheFirst) {
  std::vector<Cloud> clouds(5);
  for (int f = 0; f < 5; ++f) clouds[static_cast<std::size_t>(f)] = {{1 + 10 * (f / 4), {2.0 * (f % 4), 0, 0, 1}}};
  clouds[4][1] = {8, 0, 0, 1};
  write(clouds);
  json text = document();
  text["loop"] = true;
  text["duration"] = 0.4;
  const format::EffectTables tables = tablesOf(text);
  EXPECT_EQ(tables.given.size(), 1u);
  for (const double time : {0.05, 0.35, 0.39, 0.45, 0.79}) {
    const auto particles = format::particlesAt(tables, 0, time);
    ASSERT_EQ(particles.size(), 1u) << time;
    EXPECT_NEAR(particles[0].center[0], 20 * std::fmod(time, 0.4), 0.011) << time;
  }
}

TEST_F(ParticleFiles, MostAliveIsABound) {
  std::mt19937 random(3);
  std::vector<Cloud> clouds(12);
  for (int id = 0; id < 200; ++id) {
    const std::size_t first = random() % 12, last = first + random() % 5;
    for (std::size_t f = first; f <= last && f < 12; ++f) clouds[f][id] = {1.0 * id, 0, 0, 1};
  }
  write(clouds);
  for (const bool loop : {false, true}) {
    json text = document();
    text["duration"] = 1.15;
    text["loop"] = loop;
    const format::EffectTables tables = tablesOf(text);
    const std::uint64_t bound = format::mostAlive(tables, tables.effects[0]);
    std::size_t most = 0;
    for (int i = 0; i < 700; ++i) most = std::max(most, format::particlesAt(tables, 0, i * 0.0051).size());
    EXPECT_LE(most, bound);
    EXPECT_LT(bound, 2 * most);
  }
}

TEST_F(ParticleFiles, GapsAreTreatedAsAsked) {
  const std::vector<Cloud> clouds = sequence();
  write(clouds);
  fs::remove(folder_ / "dust_0003.ply");
  expectError(document(), "frames are missing between 1 and 8: 3");
  json text = document();
  text["emitters"][0]["particles"]["missing"] = "hold";
  expectCloud(format::particlesAt(tablesOf(text), 0, 0.2), clouds[1], 0.011, 0.2);
  text["emitters"][0]["particles"]["missing"] = "blank";
  const format::EffectTables blank = tablesOf(text);
  EXPECT_TRUE(format::particlesAt(blank, 0, 0.21).empty());
  expectCloud(format::particlesAt(blank, 0, 0.3), clouds[3], 0.011, 0.3);
  text["emitters"][0]["particles"]["frames"] = "2-8:2";
  const format::EffectTables every = tablesOf(text);
  EXPECT_EQ(every.tracks[0].framesPerSecond, 5);
  expectCloud(format::particlesAt(every, 0, 0.4), clouds[5], 0.011, 0.4);
}

TEST_F(ParticleFiles, WithoutIdsTheOrderTellsWhileTheCountIsTheSame) {
  for (int f = 0; f < 3; ++f) {
    write(f, {{"float", "x", {0.0 + f, 10.0 + f, 20.0 + f}}, {"float", "y", {0, 0, 0}}, {"float", "z", {0, 0, 0}}});
  }
  const format::EffectTables tables = tablesOf(document());
  ASSERT_EQ(tables.given.size(), 3u);
  expectCloud(format::particlesAt(tables, 0, 0.15), {{0, {1.5, 0, 0, 1}}, {1, {11.5, 0, 0, 1}}, {2, {21.5, 0, 0, 1}}},
              0.011, 0.15);
  write(2, {{"float", "x", {0, 1}}, {"float", "y", {0, 0}}, {"float", "z", {0, 0}}});
  expectError(document(), "dust_0002.ply: frame 2: 2 particles, and 3 in frame 0: without ids nobody knows which");
}

TEST_F(ParticleFiles, AFileAloneIsACloudThatStays) {
  write(1, columnsOf(sequence()[0]));
  json text = document();
  text["emitters"][0]["particles"]["files"] = "dust_0001.ply";
  text["emitters"][0]["primitive"]["radius"] = 2;
  const format::EffectTables tables = tablesOf(text);
  Cloud cloud = sequence()[0];
  for (auto& [id, point] : cloud) point.radius *= 2;
  for (const double time : {0.0, 1.0, 1.99}) expectCloud(format::particlesAt(tables, 0, time), cloud, 0.011, time);
}

TEST_F(ParticleFiles, LookFollowsAgeLifeAndColour) {
  for (int f = 0; f < 4; ++f) {
    write(f, {{"float", "x", {1.0 * f}},
              {"float", "y", {0}},
              {"float", "z", {0}},
              {"int", "id", {8}},
              {"float", "age", {0.5 + f * 0.1}},
              {"float", "life", {2}},
              {"float", "Cd_r", {0.5}},
              {"float", "Cd_g", {1}},
              {"float", "Cd_b", {3}}});
  }
  json text = document();
  text["emitters"][0]["primitive"]["radiusOverLife"] = json::parse("[[0, 0], [1, 4]]");
  text["emitters"][0]["primitive"]["rotation"] = {{"alongVelocity", true}};
  const format::EffectTables tables = tablesOf(text);
  const auto particles = format::particlesAt(tables, 0, 0.1);
  ASSERT_EQ(particles.size(), 1u);
  EXPECT_NEAR(particles[0].age, 0.3f, 1e-5f);
  EXPECT_NEAR(particles[0].radius, 1.2f, 1e-4f);
  EXPECT_NEAR(particles[0].diffuse[0], 0.4f, 1e-6f);
  EXPECT_NEAR(particles[0].diffuse[2], 0.8f, 1e-6f);
  EXPECT_NEAR(particles[0].rotation[3], 1, 1e-3f);  // it goes along x
  text["emitters"][0]["particles"]["colour"] = false;
  EXPECT_NEAR(format::particlesAt(tablesOf(text), 0, 0.1)[0].diffuse[0], 0.8f, 1e-6f);
}

TEST_F(ParticleFiles, RadiiAreStoredForEachPointOnlyWhereTheyChange) {
  std::vector<Cloud> clouds = sequence();
  write(clouds);
  EXPECT_EQ(tablesOf(document()).tracks[0].flags, format::kTrackRadii);
  for (Cloud& cloud : clouds) {
    for (auto& [id, point] : cloud) point.radius = 0.1 + (id & 7);
  }
  write(clouds);
  const format::EffectTables tables = tablesOf(document());
  EXPECT_EQ(tables.tracks[0].flags, 0u);
  expectCloud(format::particlesAt(tables, 0, 0.2), clouds[2], 0.011, 0.2);
}

TEST_F(ParticleFiles, WhatCannotBeIsNamed) {
  const std::vector<Cloud> clouds = sequence();
  const auto broken = [&](const std::string& column, double value) {
    write(clouds);
    std::vector<PlyColumn> columns = columnsOf(clouds[2]);
    for (PlyColumn& one : columns) {
      if (one.name == column) one.values[1] = value;
    }
    write(3, columns);
  };
  broken("y", std::nan(""));
  expectError(document(), "dust_0003.ply: frame 3: particle 1 (id 9): its place is nan");
  broken("pscale", -1);
  expectError(document(), "frame 3: particle 1 (id 9): its radius is -1; expected 0 to 1000000");
  broken("id", 5);
  expectError(document(), "has the same id");
  write(clouds);
  std::vector<PlyColumn> columns = columnsOf(clouds[2]);
  columns.pop_back();
  write(3, columns);
  expectError(document(), "frame 3: its attributes are others than those of frame 1");
  write(clouds);
  json text = document();
  text["duration"] = 0.5;
  expectError(text, "emitters[0].particles: frames 1 to 8 last 0.7 s; expected at most the effect's duration, 0.5 s");
  text = document();
  text["emitters"][0]["rate"] = 5;
  expectError(text, "emitters[0].rate is 5; expected none beside \"particles\"");
  text = document();
  text["emitters"][0]["particles"]["radius"] = "size";
  expectError(text, "no attribute 'size'");
  text["emitters"][0]["particles"]["radius"] = true;
  expectError(text, "emitters[0].particles.radius is true");
  text = document();
  text["emitters"][0]["particles"]["frames"] = "1-8:20";
  expectError(text, "every 20th of 10 frames a second are 0.5 a second; expected at least 1");
  text = document();
  text["emitters"][0]["particles"]["error"] = 1e-6;
  text["emitters"][0]["particles"]["scale"] = 1e4;
  expectError(text, "give a larger one");
  text = document();
  text["emitters"][0]["particles"]["files"] = "test.effect.json";
  expectError(text, "particles are read from .ply and .vdb files");
  text["emitters"][0]["particles"]["files"] = "none_##.ply";
  EXPECT_NE(errorOf(text, Fault::file).find("no file matches"), std::string::npos);
}

TEST_F(ParticleFiles, TooManyAreRefusedByTheirNumber) {
  std::ofstream(folder_ / "dust_0001.ply", std::ios::binary)
      << "ply\nformat binary_little_endian 1.0\nelement vertex 70000\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n"
      << std::string(70000 * 12, '\0');
  expectError(document(), "dust_0001.ply: frame 1: 70000 particles; expected at most 65536");
}

TEST_F(ParticleFiles, PacksAreSoundAndTheSameFromAnyThreadCount) {
  write(sequence());
  const std::string input = (folder_ / "test.effect.json").string();
  std::ofstream(input) << document().dump();
  std::string bytes[2];
  for (const unsigned threads : {1u, 2u}) {
    const std::string output = (folder_ / "out.blw").string();
    CompileOptions options;
    options.threads = threads;
    const CompileReport report = compile({input}, output, options, [](const std::string&) {});
    EXPECT_EQ(report.effects[0].mostAlive, 5u);
    std::ifstream file(output, std::ios::binary);
    bytes[threads - 1] = {std::istreambuf_iterator<char>(file), {}};
  }
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_LT(bytes[0].size(), 5000u);
}

}  // namespace
}  // namespace billow
