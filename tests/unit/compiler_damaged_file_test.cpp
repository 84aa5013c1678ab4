// Damaged OpenVDB files give one clear error, or a grid.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "planned.h"
#include "stages.h"
#include "unit/run_command.h"

namespace billow::compiler {
namespace {

using namespace tests;

// Imports what there is; only Error may come out of it.
void importAll(const std::string& path) {
  try {
    const Warn ignore = [](const std::string&) {};
    for (const PlannedVolume& volume : planInputs({path}, {}, ignore).volumes) {
      for (const PlannedFrame& frame : volume.frames) importFrame(volume, frame, {}, ignore);
    }
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input) << error.what();
    EXPECT_TRUE(has(error.what(), path)) << error.what();
  }
}

TEST(DamagedFile, EveryTruncationIsAnError) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  const std::string whole = readFile(folder / "a.vdb");
  const std::string path = folder / "cut.vdb";
  for (std::size_t size = 0; size < whole.size(); size += size < 1500 ? 1 : 97) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    const Planned planned = plan({path});
    EXPECT_EQ(planned.fault, 3) << size;
    EXPECT_TRUE(has(planned.error, "cut.vdb")) << planned.error;
  }
}

TEST(DamagedFile, RandomDamageGivesOneClearErrorOrAGrid) {
  const TempFolder folder;
  writeGrids(folder / "a.vdb", {"density", "vel*"});
  const std::string whole = readFile(folder / "a.vdb");
  const std::string path = folder / "damaged.vdb";
  std::mt19937 random(1);
  for (int round = 0; round < 500; ++round) {
    std::string bytes = whole;
    const std::size_t zone = round % 2 == 0 ? 1500 : bytes.size();  // the first kilobytes hold all counts and offsets
    for (std::uint32_t i = 0; i < 1 + random() % 4; ++i) bytes[random() % zone] = static_cast<char>(random());
    std::ofstream(path, std::ios::binary) << bytes;
    importAll(path);
  }
}

}  // namespace
}  // namespace billow::compiler
