#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <mutex>

namespace billow::command {
namespace {

std::mutex mutex;
std::string bar;  // as it stands on the terminal; "" where none does

}  // namespace

void drawProgress(std::size_t done, std::size_t total) {
  static const bool terminal = isatty(STDERR_FILENO) != 0;
  if (!terminal || total == 0) return;
  constexpr std::size_t kWidth = 32;
  const std::size_t filled = done * kWidth / total;
  const std::lock_guard lock(mutex);
  bar = fmt::format("[{:#<{}}{:.<{}}] {}/{} frames", "", filled, "", kWidth - filled, done, total);
  fmt::print(stderr, "\r{}{}", bar, done == total ? "\n" : "");
  std::fflush(stderr);
  if (done == total) bar.clear();
}

void printLine(const std::string& line) {
  const std::lock_guard lock(mutex);
  // Over the bar, which then stands below.
  fmt::print(stderr, "{}{}\n{}", bar.empty() ? "" : "\r\033[K", line, bar);
  std::fflush(stderr);
}

}  // namespace billow::command
