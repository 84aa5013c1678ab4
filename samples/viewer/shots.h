// Pictures that the user asks for, to files.
#ifndef BILLOW_VIEWER_SHOTS_H
#define BILLOW_VIEWER_SHOTS_H

#include <optional>
#include <string>

#include "billow/headless/headless.h"
#include "player.h"

namespace billow::viewer {

class Shots {
 public:
  explicit Shots(std::string folder) : folder_(std::move(folder)) {}

  // `now`: seconds of any clock.
  void ask(double now) { asked_ = asked_.value_or(now); }
  bool asked() const { return asked_.has_value(); }
  // True once after one was asked for, when the picture lacks nothing any more. It waits for that, but not for ever.
  // `player` may be null.
  bool due(const Player* player, double now);

  // Writes it to a file that is not there yet, and gives its path.
  command::Checked<std::string> write(const headless::Picture& picture, const std::string& stem, bool exr,
                                      float exposure) const;

 private:
  std::string folder_;
  std::optional<double> asked_;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_SHOTS_H
