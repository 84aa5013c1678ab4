// The command line as users and build farms meet it: exit codes, outputs whole or not at all, JSON that is only JSON.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "run_command.h"

namespace billow::tests {
namespace {

std::string quoted(const std::string& text) {
  return "'" + text + "'";
}

TEST(Cli, HelpNamesEveryCommandAndItsExitCodes) {
  const CommandResult result = billow("--help");
  EXPECT_EQ(result.code, 0);
  for (const char* word : {"compile", "info", "validate", "extract", "compare", "render", "Exit codes"}) {
    EXPECT_NE(result.out.find(word), std::string::npos) << word;
  }
  for (const char* command : {"compile", "info", "validate", "extract", "compare", "render"}) {
    EXPECT_EQ(billow(std::string(command) + " --help").code, 0) << command;
  }
}

TEST(Cli, WrongCommandLinesExitWithOne) {
  for (const char* line :
       {"", "frobnicate", "compile", "compile x.vdb", "compile x.vdb -o y.blw --psnr forty",
        "compile x.vdb -o y.blw --frames 9-1", "compile x.vdb -o y.blw --psnr 45 --gpu-budget 1MB",
        "compile x.vdb -o y.blw --psnr 45 --disk-budget 1MB", "compile x.vdb -o y.blw --missing maybe",
        "compile x.vdb -o y.blw --compress tiny", "validate", "validate a.blw --format yaml"}) {
    const CommandResult result = billow(line);
    EXPECT_EQ(result.code, 1) << line << "\n" << result.err;
    EXPECT_FALSE(result.err.empty()) << line;
  }
}

TEST(Cli, CompressesAsAskedAndSaysSo) {
  const TempFolder folder;
  std::map<std::string, nlohmann::json> infos;
  for (const std::string how : {"small", "fast", "none"}) {
    const std::string pack = folder / (how + ".blw");
    ASSERT_EQ(billow("compile " + quoted(sampleFire()) + " --compress " + how + " -o " + quoted(pack)).code, 0);
    EXPECT_EQ(billow("validate " + quoted(pack)).code, 0);
    infos[how] = nlohmann::json::parse(billow("info --json " + quoted(pack)).out);
    EXPECT_EQ(infos[how]["info"]["compression"], how);
  }
  EXPECT_GT(infos["small"]["pages"]["codecs"]["model"], 0);
  EXPECT_EQ(infos["fast"]["pages"]["codecs"]["model"], 0);
  EXPECT_GT(infos["fast"]["pages"]["codecs"]["zstd"], 0);
  EXPECT_LT(infos["small"]["disk"]["pages"], infos["fast"]["disk"]["pages"]);
  EXPECT_EQ(infos["none"]["pages"]["codecs"]["raw"], infos["none"]["pages"]["count"]);
  EXPECT_EQ(infos["none"]["disk"]["pages"], infos["none"]["pages"]["rawBytes"]);
}

TEST(Cli, MissingFilesExitWithTwoAndAreNamed) {
  const TempFolder folder;
  const std::string absent = folder / "absent.blw";
  for (const std::string& line :
       {"validate " + quoted(absent), "info " + quoted(absent), "compare " + quoted(absent) + " x.vdb",
        "extract " + quoted(absent) + " --frame 1 -o " + quoted(folder / "o.vdb"),
        "render " + quoted(absent) + " --frame 1 -o " + quoted(folder / "o.png")}) {
    const CommandResult result = billow(line);
    EXPECT_EQ(result.code, 2) << line << "\n" << result.err;
    EXPECT_NE(result.err.find("absent.blw"), std::string::npos) << line;
  }
  const CommandResult result = billow("compile " + quoted(folder / "absent.vdb") + " -o " + quoted(folder / "o.blw"));
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_NE(result.err.find("absent.vdb"), std::string::npos);
  EXPECT_EQ(folder.fileCount(), 0u);
}

TEST(Cli, CompilesValidatesAndReports) {
  const TempFolder folder;
  const std::string pack = folder / "fire.blw";
  const CommandResult compiled = billow("compile " + quoted(sampleFire()) + " --json -o " + quoted(pack));
  ASSERT_EQ(compiled.code, 0) << compiled.err;
  EXPECT_EQ(compiled.err, "");
  const auto report = nlohmann::json::parse(compiled.out);
  EXPECT_EQ(report["frames"], 6);
  EXPECT_EQ(report["grids"].size(), 4u);
  for (const auto& grid : report["grids"]) EXPECT_GE(grid["worstPsnr"].get<double>(), 45.0);

  const CommandResult valid = billow("validate --warnings-as-errors " + quoted(pack));
  EXPECT_EQ(valid.code, 0) << valid.err << valid.out;
  EXPECT_EQ(valid.out + valid.err, "");
  EXPECT_EQ(nlohmann::json::parse(billow("validate --format json " + quoted(pack)).out)["issues"].size(), 0u);
  EXPECT_TRUE(nlohmann::json::parse(billow("info --json " + quoted(pack)).out).is_object());
}

TEST(Cli, ThreadCountDoesNotChangeTheBytes) {
  const TempFolder folder;
  for (const char* threads : {"1", "2", "8"}) {
    ASSERT_EQ(billow("compile " + quoted(sampleFire()) + " --frames 7-9 --threads " + threads + " -o " +
                     quoted(folder / threads))
                  .code,
              0);
  }
  EXPECT_EQ(readFile(folder / "1"), readFile(folder / "2"));
  EXPECT_EQ(readFile(folder / "1"), readFile(folder / "8"));
}

TEST(Cli, UnwritableFoldersExitWithTwo) {
  const TempFolder folder;
  const std::string file = folder / "file";
  std::ofstream(file) << "not a folder";
  const CommandResult result = billow("compile " + quoted(sampleFire()) + " -o " + quoted(file + "/out.blw"));
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_NE(result.err.find("out.blw"), std::string::npos) << result.err;
}

TEST(Cli, AFullDiskExitsWithTwoAndLeavesNothing) {
  const TempFolder folder;
  // A file-size limit fails a write as a full disk does.
  const CommandResult result =
      billow("compile " + quoted(sampleFire()) + " -o " + quoted(folder / "out.blw"), "ulimit -f 16; ");
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_NE(result.err.find("out.blw"), std::string::npos) << result.err;
  EXPECT_EQ(folder.fileCount(), 0u);
}

TEST(Cli, AnInterruptedRunLeavesNothing) {
  const TempFolder folder;
  const std::string pack = folder / "out.blw";
  std::ofstream(pack) << "the pack from before";
  // The signal comes as soon as the unfinished file is there; at this effort the rest takes far longer.
  const CommandResult result = shell("\"$BILLOW\" compile " + quoted(sampleFire()) + " --effort 9 -o " + quoted(pack) +
                                     " & pid=$!\n"
                                     "until ls " +
                                     quoted(folder.path().string()) +
                                     "/.out.blw.tmp-* >/dev/null 2>&1; do kill -0 $pid || exit 99; done\n"
                                     "kill -TERM $pid; wait $pid");
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_NE(result.err.find("interrupted"), std::string::npos) << result.err;
  EXPECT_EQ(folder.fileCount(), 1u);
  EXPECT_EQ(readFile(pack), "the pack from before");
}

TEST(Cli, TheErrorAskedForHolds) {
  const TempFolder folder;
  const std::string pack = folder / "out.blw";
  ASSERT_EQ(billow("compile " + quoted(sampleFire()) + " --frames 12 --max-error 0.01 -o " + quoted(pack)).code, 0);
  const auto compared =
      nlohmann::json::parse(billow("compare " + quoted(pack) + " " + quoted(sampleFire()) + " --frames 12 --json").out);
  int rows = 0;
  for (const auto& row : compared["grids"]) {
    EXPECT_LE(row["maxError"].get<double>(), 0.01);
    ++rows;
  }
  EXPECT_EQ(rows, 4);
}

TEST(Cli, BudgetsHoldForTheWholePack) {
  const TempFolder folder;
  const std::string pack = folder / "out.blw";
  const std::string compile = "compile " + quoted(sampleFire()) + " --json -o " + quoted(pack);
  const CommandResult gpu = billow(compile + " --gpu-budget 500000");
  ASSERT_EQ(gpu.code, 0) << gpu.err;
  const auto gpuBytes = nlohmann::json::parse(gpu.out)["gpuBytes"].get<std::uint64_t>();
  EXPECT_LE(gpuBytes, 500000u);
  EXPECT_GE(gpuBytes, 485000u);
  const CommandResult disk = billow(compile + " --disk-budget 300000 --max-error 1");
  ASSERT_EQ(disk.code, 0) << disk.err;
  EXPECT_LE(std::filesystem::file_size(pack), 300000u);
  EXPECT_GE(std::filesystem::file_size(pack), 291000u);
  EXPECT_EQ(billow("validate " + quoted(pack)).code, 0);
  const CommandResult none = billow(compile + " --gpu-budget 1000");
  EXPECT_EQ(none.code, 3);
  EXPECT_NE(none.err.find("the pack needs"), std::string::npos) << none.err;
  const CommandResult both = billow(compile + " --gpu-budget 10MB --max-error 1e-12");
  EXPECT_EQ(both.code, 3);
  EXPECT_NE(both.err.find("the error asked for is out of reach"), std::string::npos) << both.err;
}

TEST(Cli, CompileTellsWhatItChose) {
  const TempFolder folder;
  const std::string line = "compile " + quoted(sampleFire()) + " --frames 7 -o " + quoted(folder / "out.blw");
  const CommandResult text = billow(line);
  EXPECT_NE(text.out.find("encoding"), std::string::npos) << text.out;
  const auto report = nlohmann::json::parse(billow(line + " --json").out);
  for (const auto& grid : report["grids"]) {
    std::uint64_t voxels = 0;
    for (const auto& encoding : grid["encodings"]) voxels += encoding["activeVoxels"].get<std::uint64_t>();
    EXPECT_EQ(voxels, grid["activeVoxels"].get<std::uint64_t>());  // the sample has no tiles
  }
}

TEST(Cli, NumbersThatAreNoneAreRefused) {
  for (const char* option : {"--psnr nan", "--psnr inf", "--max-error nan", "--fps nan", "--fps 1e-50"}) {
    EXPECT_EQ(billow("compile " + quoted(sampleFire()) + " -o /nowhere/out.blw " + option).code, 1) << option;
  }
}

TEST(Cli, AnInputIsNeverReplaced) {
  const TempFolder folder;
  const std::string input = folder / "fire_0012.vdb";
  std::filesystem::copy_file(std::string(BILLOW_SOURCE_DIR) + "/samples/fire/fire_0012.vdb", input);
  const std::string before = readFile(input);
  const CommandResult result = billow("compile " + quoted(input) + " -o " + quoted(input));
  EXPECT_EQ(result.code, 1) << result.err;
  EXPECT_EQ(readFile(input), before);
}

TEST(Cli, AFullStandardOutputExitsWithTwo) {
  const TempFolder folder;
  const std::string pack = folder / "out.blw";
  ASSERT_EQ(billow("compile " + quoted(sampleFire()) + " --frames 7 -o " + quoted(pack)).code, 0);
  EXPECT_EQ(shell("\"$BILLOW\" info --json " + quoted(pack) + " >/dev/full").code, 2);
}

}  // namespace
}  // namespace billow::tests
