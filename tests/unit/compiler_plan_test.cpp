// Planning: which files, frames, grids and roles come out of what the user typed.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "import/roles.h"
#include "planned.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using format::Role;
using namespace tests;

using Numbers = std::vector<std::int32_t>;
using Names = std::vector<std::string>;

TEST(PlanFrames, AreFoundByNumberHoweverTheyAreGiven) {
  const TempFolder folder;
  for (const char* name : {"a_8.vdb", "a_9.vdb", "a_10.vdb"}) writeGrids(folder / name, {"density"});
  const Numbers expected{8, 9, 10};
  EXPECT_EQ(numbersOf(plan({folder.path().string()})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_#.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_%d.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_*.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_10.vdb", folder / "a_8.vdb", folder / "a_9.vdb"})), expected);
  EXPECT_EQ(numbersOf(plan({folder / "a_##.vdb"})), Numbers{10});
  EXPECT_EQ(numbersOf(plan({folder / "a_%02d.vdb"})), Numbers{10});
  EXPECT_EQ(numbersOf(plan({folder / "a_9.vdb"})), Numbers{9});
  EXPECT_EQ(plan({folder.path().string()}).volumes[0].name, "a");
  std::ofstream(folder / "._a_9.vdb") << "a Mac's";
  EXPECT_EQ(numbersOf(plan({folder.path().string()})), expected);
}

TEST(PlanFrames, PatternTakesTheNumberAtItsPlace) {
  const TempFolder folder;
  writeGrids(folder / "fire_0001_v2.vdb", {"density"});
  writeGrids(folder / "fire_0002_v2.vdb", {"density"});
  EXPECT_EQ(numbersOf(plan({folder / "fire_####_v2.vdb"})), (Numbers{1, 2}));
}

TEST(PlanFrames, FileWithoutNumberIsFrameZeroAlone) {
  const TempFolder folder;
  writeGrids(folder / "cloud.vdb", {"density"});
  writeGrids(folder / "vec3_cloud.vdb", {"density"});
  EXPECT_EQ(numbersOf(plan({folder / "cloud.vdb"})), Numbers{0});
  EXPECT_EQ(numbersOf(plan({folder / "vec3_cloud.vdb"})), Numbers{0});  // the 3 does not end the name
  const Planned two = plan({folder / "cloud.vdb", folder / "vec3_cloud.vdb"});
  EXPECT_EQ(two.fault, 3);
  EXPECT_TRUE(has(two.error, "cloud.vdb") && has(two.error, "no frame number")) << two.error;
}

TEST(PlanFrames, GapsAreAnErrorOrHeldOrBlank) {
  const TempFolder folder;
  for (const char* name : {"a_1.vdb", "a_2.vdb", "a_5.vdb"}) writeGrids(folder / name, {"density"});
  ImportOptions options;
  const Planned gap = plan({folder.path().string()}, options);
  EXPECT_EQ(gap.fault, 3);
  EXPECT_TRUE(has(gap.error, "3, 4")) << gap.error;

  options.missing = MissingFrames::hold;
  const Planned held = plan({folder.path().string()}, options);
  ASSERT_EQ(numbersOf(held), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(held.volumes[0].frames[3].flags, format::kFrameHeld);
  EXPECT_EQ(held.volumes[0].frames[3].files, held.volumes[0].frames[1].files);

  options.missing = MissingFrames::blank;
  const Planned blank = plan({folder.path().string()}, options);
  ASSERT_EQ(numbersOf(blank), (Numbers{1, 2, 3, 4, 5}));
  EXPECT_EQ(blank.volumes[0].frames[2].flags, format::kFrameBlank);
  EXPECT_TRUE(blank.volumes[0].frames[2].files.empty());

  options.missing = MissingFrames::hold;
  options.firstFrame = 0;
  EXPECT_TRUE(has(plan({folder.path().string()}, options).error, "no frame before"));
}

TEST(PlanFrames, StepSelectsAndIsProposed) {
  const TempFolder folder;
  for (const char* name : {"a_2.vdb", "a_4.vdb", "a_6.vdb"}) writeGrids(folder / name, {"density"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "--frames 2-6:2"));
  ImportOptions options;
  options.firstFrame = 2;
  options.lastFrame = 6;
  options.frameStep = 2;
  EXPECT_EQ(numbersOf(plan({folder.path().string()}, options)), (Numbers{2, 4, 6}));
  options.frameStep = 4;
  EXPECT_EQ(numbersOf(plan({folder.path().string()}, options)), (Numbers{2, 6}));
}

TEST(PlanFrames, LayersMergeWhereTheyCountTheSameFrames) {
  const TempFolder folder;
  writeGrids(folder / "smoke_1.vdb", {"density"});
  writeGrids(folder / "smoke_2.vdb", {"density"});
  writeGrids(folder / "vel_1.vdb", {"vel*"});
  const Planned uneven = plan({folder.path().string()});
  EXPECT_EQ(uneven.fault, 3);
  EXPECT_TRUE(has(uneven.error, "smoke_#") && has(uneven.error, "vel_#")) << uneven.error;
  writeGrids(folder / "vel_2.vdb", {"vel*"});
  const Planned merged = plan({folder.path().string()});
  EXPECT_EQ(namesOf(merged), (Names{"density", "vel.x", "vel.y", "vel.z"})) << merged.error;
  EXPECT_EQ(merged.volumes.at(0).frames.at(1).files.size(), 2u);
  writeGrids(folder / "vel_2.vdb", {"vel*", "density"});
  const Planned clash = plan({folder.path().string()});
  EXPECT_EQ(clash.fault, 3);
  EXPECT_TRUE(has(clash.error, "'density'") && has(clash.error, "smoke_2.vdb")) << clash.error;
}

TEST(PlanFrames, OneNumberTwiceIsAnError) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"density"});
  writeGrids(folder / "a_01.vdb", {"density"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "twice"));
}

TEST(PlanFrames, NothingThereIsAFileError) {
  const TempFolder folder;
  EXPECT_EQ(plan({folder.path().string()}).fault, 2);
  EXPECT_EQ(plan({folder / "none.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "none_####.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "*.vdb"}).fault, 2);
  EXPECT_EQ(plan({folder / "none.json"}).fault, 2);
}

TEST(PlanGrids, AreTheUnionOverFramesInOrderOfName) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"fuel", "density"});
  writeGrids(folder / "a_2.vdb", {"vel*"});
  EXPECT_EQ(namesOf(plan({folder.path().string()})), (Names{"density", "fuel", "vel.x", "vel.y", "vel.z"}));
}

TEST(PlanGrids, RepeatedAndMissingNamesAreNumbered) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"", "", "x", "x"});
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"})), (Names{"unnamed", "unnamed_1", "x", "x_1"}));
}

TEST(PlanGrids, FilterTakesNamesBaseNamesAndComponents) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  ImportOptions options;
  options.grids = {"vel"};
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"}, options)), (Names{"vel.x", "vel.y", "vel.z"}));
  options.grids = {"vel.y"};
  EXPECT_EQ(namesOf(plan({folder / "a.vdb"}, options)), Names{"vel.y"});
  EXPECT_EQ(roleOf(plan({folder / "a.vdb"}, options), "vel.y"), Role::velocityY);
  options.grids = {"smoke"};
  const Planned unknown = plan({folder / "a.vdb"}, options);
  EXPECT_EQ(unknown.fault, 1);
  EXPECT_TRUE(has(unknown.error, "density, vel")) << unknown.error;
}

// Names come from anywhere; a pack's are UTF-8 without control characters.
TEST(PlanGrids, NamesThatAPackCannotHoldAreMended) {
  const TempFolder folder;
  writeGrids(folder / "smoke\xff\x01_7.vdb", {"den\nsity", "h\xc3\xa9t", "t\xc3"});
  const Planned planned = plan({folder.path().string()});
  EXPECT_EQ(namesOf(planned), (Names{"den_sity", "h\xc3\xa9t", "t_"})) << planned.error;
  EXPECT_EQ(planned.volumes.at(0).name, "smoke__");
  EXPECT_EQ(planned.volumes.at(0).grids[0].source, "den\nsity");
  EXPECT_EQ(planned.warnings.size(), 3u);
  ImportOptions options;
  options.grids = {"den_sity"};
  EXPECT_EQ(namesOf(plan({folder.path().string()}, options)), Names{"den_sity"});
}

TEST(PlanFrames, RatesThatAPackCannotHoldAreRefused) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density"});
  ImportOptions options;
  for (const double rate : {0.0, 1e-50, 0.0009, 1.1e6, std::nan("")}) {
    options.framesPerSecond = rate;
    EXPECT_EQ(plan({folder / "a.vdb"}, options).fault, 1) << rate;
  }
  options.framesPerSecond = 0.001;
  EXPECT_EQ(plan({folder / "a.vdb"}, options).fault, 0);
}

TEST(PlanGrids, OneNameMustNotBeScalarAndVector) {
  const TempFolder folder;
  writeGrids(folder / "a_1.vdb", {"v"});
  writeGrids(folder / "a_2.vdb", {"v*"});
  EXPECT_TRUE(has(plan({folder.path().string()}).error, "component"));
  writeGrids(folder / "b.vdb", {"v.x", "v*"});
  EXPECT_TRUE(has(plan({folder / "b.vdb"}).error, "two grids are named 'v.x'"));
}

std::vector<PlannedGrid> rolesFor(const std::vector<std::string>& names) {
  std::vector<PlannedGrid> grids;
  for (const std::string& name : names) {
    const bool vector = name.ends_with('*');
    const std::string base = vector ? name.substr(0, name.size() - 1) : name;
    for (std::uint32_t c = 0; c < (vector ? 3u : 1u); ++c) {
      PlannedGrid grid;
      grid.name = vector ? base + "." + static_cast<char>('x' + c) : base;
      grid.component = vector ? c : format::kNone;
      grids.push_back(grid);
    }
  }
  assignRoles(grids, std::vector<bool>(grids.size(), false));
  return grids;
}

TEST(PlanRoles, FollowTheNamesThatToolsUse) {
  const auto grids = rolesFor({"Density", "HEAT", "flames", "fuel", "Vel*", "Cd*"});
  const Role expected[] = {Role::extinction, Role::temperature, Role::flames, Role::fuel,   Role::velocityX,
                           Role::velocityY,  Role::velocityZ,   Role::colorR, Role::colorG, Role::colorB};
  for (std::size_t i = 0; i < grids.size(); ++i) EXPECT_EQ(grids[i].role, expected[i]) << grids[i].name;
}

TEST(PlanRoles, AreGivenOnceByPreference) {
  const auto grids = rolesFor({"density", "density_noise", "smoke"});
  EXPECT_EQ(grids[0].role, Role::none);
  EXPECT_EQ(grids[1].role, Role::extinction);
  EXPECT_EQ(grids[2].role, Role::none);
}

TEST(PlanRoles, ALoneUnknownScalarIsTheExtinction) {
  EXPECT_EQ(rolesFor({"mask"})[0].role, Role::extinction);
  EXPECT_EQ(rolesFor({"mask", "vel*"})[0].role, Role::extinction);
  EXPECT_EQ(rolesFor({"mask", "temperature"})[0].role, Role::none);
  EXPECT_EQ(rolesFor({"a", "b"})[0].role, Role::none);
  EXPECT_EQ(rolesFor({"fuel"})[0].role, Role::fuel);
}

}  // namespace
}  // namespace billow::compiler
