// `billow render --method metavoxel`: volumes, effects, and both in one picture.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>

#include "effect_tables.h"
#include "run_command.h"
#include "sample_pack.h"

namespace billow::tests {
namespace {

// Two frames of a cube of smoke around (9, 9, 9), half a second apart, and an effect of balls that rise from (9, 12,
// 9).
std::vector<std::byte> smokeAndBalls() {
  return writePack({.effects = true}, [](format::PackWriter& writer) {
    format::EffectTables effects = plainEffect();
    const float place[3] = {9, 12, 9};
    std::copy(place, place + 3, effects.emitters[0].position);
    effects.emitters[0].speed[0] = effects.emitters[0].speed[1] = 1;
    effects.emitters[0].radius[0] = effects.emitters[0].radius[1] = 0.4f;
    format::PackTables tables = sampleTables("smoke", {"density"}, 2);
    tables.effects = std::move(effects);
    tables.effects.effects[0].name = tables.addString("balls");
    tables.effects.emitters[0].name = tables.addString("emitter");
    tables.frames[1].time = 0.5;
    for (std::uint32_t frame = 0; frame < 2; ++frame) {
      GridFrameBuilder smoke(writer, 0);
      for (std::uint32_t i = 0; i < 8; ++i) {
        smoke.brick({10 + i % 2, 10 + i / 2 % 2, 10 + i / 4}, format::kEncodingConstant, {}, frame == 0 ? 1.0f : 1.5f,
                    0, format::kMaskAll);
      }
      tables.gridFrames.push_back(smoke.finish(tables));
    }
    return tables;
  });
}

class RenderMetavoxel : public testing::Test {
 protected:
  RenderMetavoxel() {
    const std::vector<std::byte> bytes = smokeAndBalls();
    std::ofstream(pack_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  // The picture's bytes; empty where it was refused.
  std::string picture(const std::string& arguments) {
    const std::string out = folder_ / "picture.png";
    const CommandResult result =
        billow("render '" + pack_ + "' --size 40x30 --up y " + arguments + " -o '" + out + "'");
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.err;
    return readFile(out);
  }
  void expectRefused(const std::string& arguments, const std::string& named, int code = 1) {
    const std::size_t before = folder_.fileCount();
    const CommandResult result = billow("render '" + pack_ + "' " + arguments + " -o '" + (folder_ / "x.png") + "'");
    EXPECT_EQ(result.code, code) << arguments << "\n" << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << arguments << "\n" << result.err;
    EXPECT_EQ(folder_.fileCount(), before) << "something was written by " << arguments;
  }

  TempFolder folder_;
  std::string pack_ = folder_ / "p.blw";
};

TEST_F(RenderMetavoxel, DrawsVolumesAndEffectsAloneAndTogether) {
  const std::string camera = " --camera 9,10,30:9,10,9:40";
  std::set<std::string> pictures;
  for (const char* what :
       {"--frame 7", "--frame 7 --method metavoxel", "--frame 8 --method metavoxel",
        "--frame 7 --method metavoxel --shadows none", "--frame 8 --effect balls", "--effect balls --time 0.5",
        "--effect balls --time 2", "--frame 7 --method metavoxel --surroundings 1",
        "--frame 7 --method metavoxel --surroundings 1 --bounces 5", "--frame 7 --method metavoxel --surroundings 0.5",
        "--effect balls --time 2 --voxel-size 0.2", "--effect balls --time 2 --sun 1,0,0"}) {
    const std::string drawn = picture(what + camera);
    EXPECT_EQ(drawn.substr(1, 3), "PNG");
    EXPECT_TRUE(pictures.insert(drawn).second) << what << " is like another";
  }
  EXPECT_EQ(picture("--frame 7 --effect balls" + camera), picture("--frame 7 --method metavoxel" + camera))
      << "nothing is alive at the first moment";
  EXPECT_EQ(picture("--frame 7 --method metavoxel --surroundings 0" + camera),
            picture("--frame 7 --method metavoxel" + camera));
}

TEST_F(RenderMetavoxel, RefusesWhatItCannotDo) {
  expectRefused("--frame 7 --method voxels", "--method");
  expectRefused("", "--frame or --time of a volume, or --effect");
  expectRefused("--effect balls", "--time");
  expectRefused("--frame 7 --effect balls --time 1", "--time");
  expectRefused("--frame 7 --effect balls --method direct", "direct");
  expectRefused("--effect steam --time 1", "there is: balls");
  expectRefused("--effect balls --time -1", "--time");
  expectRefused("--effect balls --time nan", "not a finite number");
  expectRefused("--frame 7 --method metavoxel --voxel-size 0", "--voxel-size");
  expectRefused("--frame 7 --method metavoxel --surroundings 1.1", "--surroundings");
  expectRefused("--frame 7 --method metavoxel --surroundings nan", "not a finite number");
  expectRefused("--frame 7 --method metavoxel --surroundings 1 --bounces 0", "--bounces");
  expectRefused("--frame 7 --surroundings 1", "direct");
  expectRefused("--frame 7 --method metavoxel --gpu-budget 1MB", "memoryBudget", 4);
}

}  // namespace
}  // namespace billow::tests
