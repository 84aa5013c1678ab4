// What the viewer opens, what its time line is, and that what it copies draws the same as a scene.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "billow/format/look.h"
#include "document.h"
#include "effect_tables.h"
#include "run_command.h"
#include "sample_pack.h"

namespace billow::viewer {
namespace {

using nlohmann::json;

// Frames of a volume, and an effect of a second.
std::vector<std::byte> smokeAndEffect(std::uint32_t frames = 3) {
  return tests::writePack({.effects = true}, [&](format::PackWriter& writer) {
    format::PackTables tables = tests::sampleTables("smoke", {"density"}, frames);
    tables.effects = tests::plainEffect();
    tables.effects.effects[0].name = tables.addString("balls");
    tables.effects.emitters[0].name = tables.addString("emitter");
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      tests::GridFrameBuilder builder(writer, 0);
      builder.brick({10, 10, 10}, format::kEncodingConstant, {}, 1 + static_cast<float>(frame), 0, format::kMaskAll);
      tables.gridFrames.push_back(builder.finish(tables));
    }
    return tables;
  });
}

class ViewerDocument : public testing::Test {
 protected:
  ViewerDocument() {
    const std::vector<std::byte> bytes = smokeAndEffect();
    std::ofstream(pack_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  std::unique_ptr<Document> open(const std::string& path, const std::optional<Choice>& choice = {}) {
    auto document = Document::open(path, choice);
    EXPECT_TRUE(document.has_value()) << document.error().message;
    return std::move(*document);
  }
  std::unique_ptr<Document> openScene(const json& scene) {
    std::ofstream(folder_ / "scene.json") << scene.dump();
    return open(folder_ / "scene.json");
  }
  void expectRefused(const std::string& path, const std::optional<Choice>& choice, int code, const std::string& named) {
    const auto document = Document::open(path, choice);
    ASSERT_FALSE(document.has_value());
    EXPECT_EQ(document.error().code, code);
    EXPECT_NE(document.error().message.find(named), std::string::npos) << document.error().message;
  }

  tests::TempFolder folder_;
  std::string pack_ = folder_ / "smoke.blw";
};

TEST_F(ViewerDocument, APackShowsItsFirstVolumeByItsOwnFrames) {
  const auto document = open(pack_);
  ASSERT_EQ(document->choices().size(), 2u);
  EXPECT_EQ(document->choice(), (Choice{false, "smoke"}));
  EXPECT_EQ(document->timeline->ticks().size(), 3u);
  EXPECT_EQ(document->timeline->ticks()[0].number, 7);
  EXPECT_EQ(document->contents().effects().size(), 0u);
  EXPECT_EQ(document->whyNotDirect(), "");
}

TEST_F(ViewerDocument, AnEffectIsChosenByName) {
  const auto document = open(pack_, Choice{true, "balls"});
  EXPECT_EQ(document->contents().volumes().size(), 0u);
  EXPECT_EQ(document->contents().effects().size(), 1u);
  EXPECT_GT(document->needs().particles, 0u);
  EXPECT_FALSE(document->stage().box.empty);
  EXPECT_NE(document->whyNotDirect(), "");
  EXPECT_EQ(document->timeline->begin(), 0);
}

TEST_F(ViewerDocument, ASceneLastsAsLongAsWhatItHolds) {
  const auto document = openScene({{"framesPerSecond", 10},
                                   {"volumes", {{{"pack", "smoke.blw"}, {"begin", 9}}}},
                                   {"effects", {{{"pack", "smoke.blw"}, {"effect", "balls"}, {"begin", 0.5}}}}});
  const auto& record = document->contents().volumes()[0].record();
  const double length = document->contents().volumes()[0].pack->framesOf(record).back().time +
                        1 / static_cast<double>(record.framesPerSecond);
  EXPECT_NEAR(document->timeline->end(), 9 + length, 0.1);
  EXPECT_EQ(document->timeline->ticks()[5].time, 0.5);
  EXPECT_NE(document->whyNotDirect(), "");
}

TEST_F(ViewerDocument, RefusesWhatItCannotShow) {
  expectRefused(folder_ / "none.blw", {}, 2, "none.blw");
  expectRefused(pack_, Choice{false, "fog"}, 1, "fog");
  expectRefused(pack_, Choice{true, "fog"}, 1, "fog");
  std::ofstream(folder_ / "bad.blw") << "not a pack";
  expectRefused(folder_ / "bad.blw", {}, 3, "bad.blw");
  std::ofstream(folder_ / "scene.json") << R"({"pack": "smoke.blw", "tempo": 1})";
  expectRefused(folder_ / "scene.json", {}, 3, "tempo");
  std::ofstream(folder_ / "scene.json") << R"({"pack": "smoke.blw"})";
  expectRefused(folder_ / "scene.json", Choice{false, "smoke"}, 1, "scene");
}

// Whatever has been changed, a scene with the copied members is drawn the same.
TEST_F(ViewerDocument, CopiedMembersDrawTheSame) {
  const auto document = open(pack_);
  command::RenderRequest& request = document->request;
  const float albedo[3] = {0.1f, 0.7f, 0.3f}, g = -0.3f, extinction = 3.14159f, ambient[3] = {0.01f, 0, 7};
  format::setLook(request.volumes[0].look.record, format::kLookAlbedo, albedo);
  format::setLook(request.volumes[0].look.record, format::kLookExtinctionScale, {&extinction, 1});
  format::setLook(request.look.record, format::kLookAnisotropy, {&g, 1});
  format::setLook(request.look.record, format::kLookAmbient, ambient);
  request.volumes[0].look.density = 0.37f;
  request.look.scatteringOrders = 7;
  request.sunDirection = {0.1f, 0.2f, -0.3f};
  request.sunIntensity = 12.3f;
  request.exposure = -1.5f;
  request.voxelSize = 0.3;

  json scene = json::parse(sceneMembers(*document, 0));
  scene["pack"] = "smoke.blw";
  const auto again = openScene(scene);
  EXPECT_EQ(again->request.exposure, request.exposure);
  EXPECT_EQ(again->request.voxelSize, request.voxelSize);
  const runtime::DrawInfo a = document->describe(true), b = again->describe(true);
  EXPECT_EQ(a.sun.direction, b.sun.direction);
  EXPECT_EQ(a.sun.irradiance, b.sun.irradiance);
  const auto lookOf = [](const Document& from) {
    const command::PlacedVolume& volume = from.contents().volumes()[0];
    return command::placed(from.request, volume, {}, from.describe(true).look).look;
  };
  const runtime::Look first = lookOf(*document), second = lookOf(*again);
  EXPECT_FLOAT_EQ(first.extinctionScale, second.extinctionScale);
  EXPECT_EQ(first.albedo, second.albedo);
  EXPECT_EQ(first.anisotropy, second.anisotropy);
  EXPECT_EQ(first.ambient, second.ambient);
  EXPECT_EQ(first.scatteringOrders, second.scatteringOrders);
  EXPECT_EQ(first.temperatureOffset, second.temperatureOffset);
}

// Other grids or other packs: what is drawn changes, where the time line is does not.
TEST_F(ViewerDocument, RenewedItKeepsItsTime) {
  const auto document = open(pack_);
  document->timeline->seek(0.06);
  document->timeline->setSpeed(-2);
  document->request.volumes[0].grids.extinction = "none";
  ASSERT_TRUE(document->renew());
  EXPECT_EQ(document->contents().volumes()[0].grids.extinction, format::kNone);
  EXPECT_EQ(document->timeline->time(), 0.06);

  document->request.volumes[0].grids.extinction = "fog";
  const auto refused = document->renew();
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("fog"), std::string::npos);
  EXPECT_EQ(document->contents().volumes()[0].grids.extinction, format::kNone) << "all is as it was";
  EXPECT_EQ(document->timeline->ticks().size(), 3u);

  document->request.volumes[0].grids = {};
  const std::vector<std::byte> longer = smokeAndEffect(5);
  std::ofstream(pack_, std::ios::binary)
      .write(reinterpret_cast<const char*>(longer.data()), static_cast<std::streamsize>(longer.size()));
  ASSERT_TRUE(document->renew());
  EXPECT_EQ(document->timeline->ticks().size(), 5u);
  EXPECT_EQ(document->timeline->time(), 0.06);
  EXPECT_EQ(document->timeline->speed(), -2);
}

TEST_F(ViewerDocument, ResetTakesBackEveryChangeOfTheLook) {
  const auto document = open(pack_);
  const std::string before = sceneMembers(*document, 0);
  const float albedo[3] = {0.1f, 0.7f, 0.3f};
  format::setLook(document->request.volumes[0].look.record, format::kLookAlbedo, albedo);
  format::setLook(document->request.look.record, format::kLookAmbient, albedo);
  document->request.volumes[0].look.density = 5;
  document->request.sunIntensity = 1;
  document->request.exposure = 2;
  EXPECT_NE(sceneMembers(*document, 0), before);
  document->resetLook();
  EXPECT_EQ(sceneMembers(*document, 0), before);
}

}  // namespace
}  // namespace billow::viewer
