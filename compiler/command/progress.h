// A bar on stderr while long work goes on, only where that is a terminal.
#ifndef BILLOW_COMMAND_PROGRESS_H
#define BILLOW_COMMAND_PROGRESS_H

#include <cstddef>
#include <string>

namespace billow::command {

// Redraws the bar; `done` == `total` ends it. Nothing happens where stderr is no terminal.
void drawProgress(std::size_t done, std::size_t total);

// Writes a whole line to stderr, clear of the bar. May be called from any thread.
void printLine(const std::string& line);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_PROGRESS_H
