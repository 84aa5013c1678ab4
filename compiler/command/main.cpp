#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <system_error>

#include "billow/format/temp_file.h"
#include "command.h"
#include "progress.h"
#ifdef BILLOW_WITH_COMPILER
#include "stages.h"
#endif

namespace billow::command {
namespace {

constexpr char kInterrupted[] = "billow: error: interrupted; no unfinished file is left\n";

// Outputs are whole or not at all, also here: what is unfinished goes, what was there before stays.
extern "C" void onInterrupt(int) {
  format::removeUnfinishedFiles();
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kInterrupted, sizeof(kInterrupted) - 1);
  std::_Exit(kFile);
}

int complain(const std::string& what, int code) {
  printLine("billow: error: " + what);
  return code;
}

int runGuarded(const Run& run) {
  try {
    return run();
#ifdef BILLOW_WITH_COMPILER
  } catch (const compiler::Error& error) {
    return complain(error.what(), static_cast<int>(error.fault()));
#endif
  } catch (const std::system_error& error) {
    return complain(error.what(), kFile);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", kInternal);
  } catch (const std::exception& error) {
    return complain(fmt::format("{} (this is a fault of billow's own; please report it)", error.what()), kInternal);
  }
}

}  // namespace

int reportIssue(const std::string& path, const format::Issue& issue) {
  // Ids below 100 are about getting at the bytes, not about what they say.
  const bool unreadable = issue.kind != nullptr && issue.kind->id < 100;
  return complain(fmt::format("{}: {}", path, format::toString(issue)), unreadable ? kFile : kInvalid);
}

}  // namespace billow::command

namespace {

void addCommands(CLI::App& app, billow::command::Run& run) {
  using namespace billow::command;
#ifdef BILLOW_WITH_COMPILER
  addCompile(app, run);
#endif
  addInfo(app, run);
  addValidate(app, run);
#ifdef BILLOW_WITH_COMPILER
  addExtract(app, run);
  addCompare(app, run);
#endif
#ifdef BILLOW_WITH_RUNTIME
  addRender(app, run);
#endif
#ifdef BILLOW_WITH_VIEWER
  addView(app, run);
#endif
}

int runCommandLine(int argc, char** argv) {
  using namespace billow::command;
  CLI::App app{
      "billow turns OpenVDB sequences into packs that games play.\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read or written, 3 invalid input or pack,\n"
      "4 no usable GPU or GPU failure, 5 billow's own fault."};
  app.name("billow");
  app.set_version_flag("--version", "billow " BILLOW_VERSION);
  app.require_subcommand(1);
  Run run;
  addCommands(app, run);
  // Without arguments, what a newcomer wants to see first.
  if (argc <= 1) {
    fmt::print(stderr, "{}", app.help());
    return kCommandLine;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kCommandLine;
  }
  const int code = runGuarded(run);
  // What a full disk kept from standard output must not pass for success.
  const bool flushed = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return flushed || code != kDone ? code : complain("standard output cannot be written", kFile);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace billow::command;
  // A file that grows past a limit is then a failed write with a message, as on a full disk, not a silent death.
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(number, onInterrupt) == SIG_IGN) std::signal(number, SIG_IGN);  // nohup stays in force
  }
  try {
    return runCommandLine(argc, argv);
  } catch (...) {
    return kInternal;
  }
}
