// A display without a screen (Xvfb), what it shows, and hands for it (xdotool).
#ifndef BILLOW_TESTS_VIRTUAL_SCREEN_H
#define BILLOW_TESTS_VIRTUAL_SCREEN_H

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "run_command.h"

namespace billow::tests {

// Tries until `holds` does; false where it never did. Long enough for a slow and busy machine: nothing is timed.
template <class Condition>
bool eventually(const Condition& holds, std::chrono::seconds most = std::chrono::seconds(300)) {
  const auto end = std::chrono::steady_clock::now() + most;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

// A program that runs beside the test, ended with it.
class Process {
 public:
  // Through the shell, whose place the program takes; variables may stand before it. `inherited` stays open in it.
  explicit Process(const std::string& line, int inherited = -1) {
    pid_ = fork();
    if (pid_ != 0) return;
    if (inherited >= 0) fcntl(inherited, F_SETFD, 0);
    const std::string text = "exec env " + line;
    execl("/bin/sh", "sh", "-c", text.c_str(), nullptr);
    _exit(127);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (running()) kill(pid_, SIGKILL);
    wait();
  }

  bool running() { return !ended_ && !reap(WNOHANG); }
  // Its exit code; 128 + signal when a signal ended it.
  int wait() {
    if (!ended_) reap(0);
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  bool reap(int flags) { return ended_ = waitpid(pid_, &status_, flags) == pid_; }

  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

// Pixels of a part of the screen, three bytes each.
struct Shot {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  bool operator==(const Shot&) const = default;

  const std::uint8_t* at(std::uint32_t x, std::uint32_t y) const { return &rgb[(std::size_t{y} * width + x) * 3]; }
};

class VirtualScreen {
 public:
  VirtualScreen(std::uint32_t width, std::uint32_t height) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    server_ = std::make_unique<Process>(
        // Of this process alone: servers that look for a free number at the same time take each other's sockets away.
        "Xvfb :" + std::to_string(1000 + getpid() % 50000) + " -displayfd " + std::to_string(ends[1]) + " -screen 0 " +
            std::to_string(width) + "x" + std::to_string(height) + "x24 -nolisten tcp -fbdir '" +
            folder_.path().string() + "' >/dev/null 2>&1",
        ends[1]);
    close(ends[1]);
    std::string number;
    for (char digit = 0; read(ends[0], &digit, 1) == 1 && digit != '\n';) number += digit;
    close(ends[0]);
    EXPECT_FALSE(number.empty()) << "Xvfb (Debian package xvfb) does not start";
    display_ = ":" + number;
  }

  // DISPLAY=... for the shell.
  std::string environment() const { return "DISPLAY=" + display_ + " "; }

  // What xdotool says to these arguments.
  std::string hand(const std::string& arguments) const {
    std::string out = shell(environment() + "xdotool " + arguments).out;
    while (!out.empty() && out.back() == '\n') out.pop_back();
    return out;
  }

  // The upper left part of what is on the screen. It is a file of the X server's own memory, in the format of xwd.
  Shot look(std::uint32_t width, std::uint32_t height) const {
    const std::string file = readFile(folder_ / "Xvfb_screen0");
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<std::uint8_t>(file.at(4 * at + i));
      return value;
    };
    const std::size_t first = word(0) + std::size_t{12} * word(19), line = word(12);
    Shot shot{.width = width, .height = height, .rgb = {}};
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        for (std::size_t c = 3; c-- > 0;) {
          shot.rgb.push_back(static_cast<std::uint8_t>(file.at(first + y * line + std::size_t{4} * x + c)));
        }
      }
    }
    return shot;
  }

 private:
  TempFolder folder_;
  std::unique_ptr<Process> server_;
  std::string display_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_VIRTUAL_SCREEN_H
