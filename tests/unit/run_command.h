// Runs the built `billow` (its path in the environment variable BILLOW) as a user would, through the shell.
#ifndef BILLOW_TESTS_RUN_COMMAND_H
#define BILLOW_TESTS_RUN_COMMAND_H

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace billow::tests {

inline std::string readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// A folder of the test's own, removed with it.
class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "billow_test_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() { std::filesystem::remove_all(path_); }

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  const std::filesystem::path& path() const { return path_; }
  std::size_t fileCount() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path path_;
};

struct CommandResult {
  int code = -1;  // exit code; 128 + signal when a signal ended it
  std::string out, err;
};

// Runs shell text with the built command as $BILLOW.
inline CommandResult shell(const std::string& script) {
  EXPECT_NE(std::getenv("BILLOW"), nullptr) << "BILLOW must name the built command";
  const TempFolder folder;
  const std::string line = "{ " + script + "\n} >'" + (folder / "out") + "' 2>'" + (folder / "err") + "' </dev/null";
  const int status = std::system(line.c_str());
  CommandResult result;
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = readFile(folder / "out");
  result.err = readFile(folder / "err");
  return result;
}

// `arguments` follow `billow`; `prefix` goes before the command ("ulimit -f 1; ").
inline CommandResult billow(const std::string& arguments, const std::string& prefix = "") {
  return shell(prefix + "\"$BILLOW\" " + arguments);
}

inline std::string sampleFire() {
  return std::string(BILLOW_SOURCE_DIR) + "/samples/fire/fire_####.vdb";
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_RUN_COMMAND_H
