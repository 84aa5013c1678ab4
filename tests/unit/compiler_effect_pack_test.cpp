// Effects in packs, and as grids.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "billow/format/pack.h"
#include "billow/format/validate.h"
#include "compile.h"
#include "effect/rasterise.h"
#include "effect_document.h"

namespace billow {
namespace {

using namespace compiler;
using nlohmann::json;
using tests::bake;
using tests::smallest;
namespace fs = std::filesystem;

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
  ASSERT_EQ(sampleEffects().size(), 8u);
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
