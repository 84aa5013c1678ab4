// The viewer sees that a file was written anew, once, and when it is whole.
#include "file_watch.h"

#include <gtest/gtest.h>

#include <fstream>

#include "run_command.h"

namespace billow::viewer {
namespace {

TEST(FileWatch, TellsOnceOfAFileThatHasComeToRest) {
  const tests::TempFolder folder;
  const std::string path = folder / "pack";
  std::ofstream(path) << "one";
  FileWatch watch(path);
  EXPECT_FALSE(watch.changed());
  EXPECT_FALSE(watch.changed());
  std::ofstream(path) << "three";
  EXPECT_FALSE(watch.changed()) << "it may still be written";
  std::ofstream(path) << "thirteen";
  EXPECT_FALSE(watch.changed());
  EXPECT_TRUE(watch.changed());
  EXPECT_FALSE(watch.changed());
  std::filesystem::remove(path);
  EXPECT_FALSE(watch.changed());
  EXPECT_FALSE(watch.changed()) << "what is gone is nothing to play";
}

}  // namespace
}  // namespace billow::viewer
