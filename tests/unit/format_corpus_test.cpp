// Seeds of the pack fuzzers must be sound, or the fuzzers stop at the tables of every one.
#include <gtest/gtest.h>

#include <filesystem>

#include "billow/format/source.h"
#include "billow/format/validate.h"

namespace billow::format {
namespace {

TEST(FuzzCorpus, PacksAreSound) {
  int packs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BILLOW_SOURCE_DIR "/tests/fuzz/corpus/pack")) {
    validate(**openFileSource(entry.path().string()), {},
             [&](const Issue& issue) { ADD_FAILURE() << entry.path() << ": " << toString(issue); });
    ++packs;
  }
  EXPECT_GE(packs, 4);
}

}  // namespace
}  // namespace billow::format
