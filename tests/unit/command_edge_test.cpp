// What every file and sequence under edge/ of the shared data gives: the promise to whoever drops such a file in.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "unit/run_command.h"

namespace billow::tests {
namespace {

struct EdgeCase {
  const char* input;         // under edge/
  int code = 0;              // of compile
  const char* says[6] = {};  // each must be in what it prints on stderr; none: it prints nothing
  const char* options = "";  // of compile and of compare
};

constexpr double kPsnr = 45;  // that compare must find at least, or an exact copy

void PrintTo(const EdgeCase& edge, std::ostream* out) {
  *out << edge.input << " " << edge.options;
}

// Plain constants: a table of strings takes a sanitizer's compiler ten minutes.
constexpr EdgeCase kCases[] = {
    // Sound files of every kind, without a word of warning.
    {"active_zeros.vdb"},  // active zeros are kept as active: topology is the artist's
    {"alias_names.vdb"},
    {"background_nonzero.vdb"},
    {"checkerboard.vdb"},
    {"comp_blosc.vdb"},
    {"comp_mask_only.vdb"},
    {"comp_none_raw.vdb"},
    {"comp_zip.vdb"},
    {"comp_zip_half.vdb"},
    {"comp_zip_nomask.vdb"},
    {"empty_grid.vdb"},    // the first frame of many a simulation
    {"empty_leaves.vdb"},  // as empty
    {"half_float.vdb"},
    {"inactive_values.vdb"},  // inactive values are nobody's: the background is stored
    {"metadata.vdb"},
    {"negative_coords.vdb"},
    {"no_stats_metadata.vdb"},  // statistics in the file are never trusted
    {"one_voxel_sheet.vdb"},
    {"scattered_voxels.vdb"},
    {"single_voxel.vdb"},
    {"tiles_constant.vdb"},
    {"tiles_root_huge.vdb"},  // 6.9e10 voxels in one tile cost one node
    {"type_bool.vdb"},
    {"type_double.vdb"},
    {"type_int32.vdb"},
    {"type_mask.vdb"},
    {"unnamed.vdb"},
    {"unnamed_two.vdb"},
    {"values_huge_1e6.vdb"},
    {"values_negative.vdb"},
    {"values_tiny_1e-8.vdb"},
    {"vec3f_only.vdb"},
    {"vec3f_velocity.vdb"},
    {"xform_nonuniform.vdb"},
    {"xform_rotated.vdb"},
    {"xform_shear_affine.vdb"},
    {"bad_appended_garbage.vdb"},  // bytes after the last grid hurt nobody, and OpenVDB never looks at them

    // Something is left out or changed, and said.
    {"type_points.vdb", 0, {"warning", "type_points.vdb", "'points'", "skipped"}},
    {"types_int_bool_double_mixed.vdb", 0, {"warning", "'d'", "1e+300", "(7, 8, 9)", "skipped"}},
    {"values_denormal.vdb", 0, {"warning", "'density'", "denormal"}},

    // Choices that only the user can make: refused, naming the option.
    {"level_set_sphere.vdb", 3, {"level_set_sphere.vdb", "'surface'", "level set", "--sdf-to-fog"}},
    {"level_set_sphere.vdb", 0, {}, "--sdf-to-fog"},
    {"nan_inf.vdb", 3, {"nan_inf.vdb", "'density'", "(-40, 3, 3)", "nan", "--non-finite zero"}},
    {"nan_inf.vdb", 0, {}, "--non-finite zero"},

    // What does not fit the format.
    {"huge_extent_6000.vdb", 3, {"huge_extent_6000.vdb", "4096"}},  // a grid spans 4096 voxels a frame, by design
    {"xform_frustum.vdb", 3, {"xform_frustum.vdb", "'density'", "frustum"}},
    {"no_grids.vdb", 3, {"no_grids.vdb", "no grids"}},
    {"tree_nonstandard_4_3_2.vdb", 3, {"tree_nonstandard_4_3_2.vdb", "Tree_float_4_3_2", "no grids"}},
    {"bad_unknown_tree_type.vdb", 3, {"bad_unknown_tree_type.vdb", "Tree_float_9_9_9", "no grids"}},

    // Damaged and foreign files.
    {"bad_magic.vdb", 3, {"bad_magic.vdb", "not an OpenVDB file"}},
    {"bad_not_vdb_png.vdb", 3, {"bad_not_vdb_png.vdb", "not an OpenVDB file"}},
    {"bad_not_vdb_text.vdb", 3, {"bad_not_vdb_text.vdb", "not an OpenVDB file"}},
    {"bad_offsets.vdb", 3, {"bad_offsets.vdb", "damaged"}},
    {"bad_random_middle_blosc.vdb", 3, {"bad_random_middle_blosc.vdb", "damaged"}},
    {"bad_random_middle_zip.vdb", 3, {"bad_random_middle_zip.vdb", "damaged"}},
    {"bad_truncated_60pct.vdb", 3, {"bad_truncated_60pct.vdb", "truncated"}},
    {"bad_truncated_header.vdb", 3, {"bad_truncated_header.vdb", "truncated"}},  // OpenVDB calls it an empty file
    {"bad_version_999.vdb", 3, {"bad_version_999.vdb", "version 999"}},  // the rest may be intact; nobody can know
    {"bad_zero_bytes.vdb", 3, {"bad_zero_bytes.vdb", "empty"}},

    // Sequences.
    {"seq_static", 0},
    {"seq_grids", 0},      // grids come, go, are empty and change type; absent is not empty
    {"seq_transform", 0},  // each frame has its own transform
    {"seq_badframe", 3, {"seq_badframe_0003.vdb", "truncated"}},  // found before the first frame is compiled
    {"seq_badframe", 0, {}, "--frames 1-2"},
    {"seq_missing", 3, {"4, 7", "--missing hold", "--missing blank"}},
    {"seq_missing", 0, {}, "--missing hold"},
    {"seq_missing", 0, {}, "--missing blank"},
    {"seq_missing", 0, {}, "--frames 2-8:3"},
};

std::string dataFolder() {
  const char* data = std::getenv("BILLOW_DATA");
  const std::filesystem::path folder = data == nullptr ? "" : std::filesystem::path(data) / "edge";
  return std::filesystem::is_directory(folder) ? folder.string() : "";
}

class Edge : public testing::TestWithParam<EdgeCase> {};

// Everything that compare says about the pack holds for the case.
void expectFaithful(const std::string& pack, const std::string& input, const EdgeCase& edge) {
  const std::string line = "compare '" + pack + "' '" + input + "' --json " + edge.options;
  const CommandResult compared = billow(line);
  ASSERT_EQ(compared.code, 0) << "billow " << line << "\n" << compared.err << compared.out;
  const auto report = nlohmann::json::parse(compared.out);
  ASSERT_FALSE(report.at("grids").empty()) << compared.out;
  for (const auto& grid : report.at("grids")) {
    EXPECT_EQ(grid.at("mismatchedVoxels"), 0) << grid;
    const bool exact = grid.at("exact");
    EXPECT_TRUE(exact || (grid.at("psnr").is_number() && grid.at("psnr") >= kPsnr)) << grid;
  }
}

TEST_P(Edge, GivesWhatTheTableSays) {
  const EdgeCase& edge = GetParam();
  if (dataFolder().empty()) {
    std::cout << "skipped: BILLOW_DATA has no edge folder\n";
    GTEST_SKIP();
  }
  const TempFolder folder;
  const std::string input = dataFolder() + "/" + edge.input, pack = folder / "out.blw";
  const std::string line = "compile '" + input + "' -o '" + pack + "' " + edge.options;
  const CommandResult compiled = billow(line, "ulimit -t 60; ");
  const std::string context = "billow " + line + "\nexit code " + std::to_string(compiled.code) + "\n" + compiled.err;
  ASSERT_EQ(compiled.code, edge.code) << context;
  for (const char* text : edge.says) {
    if (text == nullptr) break;
    EXPECT_NE(compiled.err.find(text), std::string::npos) << "expected: " << text << "\n" << context;
  }
  if (edge.says[0] == nullptr) {
    EXPECT_EQ(compiled.err, "") << context;
  }
  if (edge.code != 0) {
    EXPECT_EQ(folder.fileCount(), 0u) << "partial output was left\n" << context;
    return;
  }
  EXPECT_EQ(folder.fileCount(), 1u) << context;
  const CommandResult validated = billow("validate '" + pack + "'");
  EXPECT_EQ(validated.code, 0) << validated.err << validated.out;
  expectFaithful(pack, input, edge);
}

INSTANTIATE_TEST_SUITE_P(Table, Edge, testing::ValuesIn(kCases));

// No file of the folder is without a row.
TEST(EdgeTable, IsComplete) {
  if (dataFolder().empty()) {
    std::cout << "skipped: BILLOW_DATA has no edge folder\n";
    GTEST_SKIP();
  }
  for (const auto& entry : std::filesystem::directory_iterator(dataFolder())) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(std::any_of(std::begin(kCases), std::end(kCases), [&](const EdgeCase& edge) {
      return edge.input == name;
    })) << name;
  }
}

}  // namespace
}  // namespace billow::tests
