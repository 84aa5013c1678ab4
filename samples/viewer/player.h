// The frames of a document's volumes, on the device when they are to be drawn.
#ifndef BILLOW_VIEWER_PLAYER_H
#define BILLOW_VIEWER_PLAYER_H

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "billow/runtime/stream.h"
#include "render_contents.h"

namespace billow::viewer {

using runtime::Interpolation;

// What is on the device.
struct Residency {
  std::vector<bool> frames;  // of the first volume, in its order
  std::uint64_t bytes = 0;   // of all volumes' frames
  std::uint32_t resident = 0;
  std::uint64_t late = 0;  // moments that were shown by other frames than theirs
};

class Player {
 public:
  // `contents` and `renderer` outlive it. `framesInFlight` as the host draws.
  Player(runtime::Renderer& renderer, const command::Contents& contents, std::uint64_t budget,
         std::uint32_t framesInFlight, Interpolation interpolation);

  // What shows at a time of the scene, one for each volume, without layers where nothing does. `velocity` says which
  // frames come next: scene seconds a second. What cannot be loaded leaves what was shown before, and an error. Frames
  // stay as long as commands that draw them may be pending. Once a picture; waits for the disk.
  const std::vector<runtime::Drawable>& update(double time, double velocity);

  // Whether further frames are to come, so that another update() has something to do.
  bool waiting() const { return waiting_; }
  Interpolation interpolation() const { return interpolation_; }
  // What the submission that draws must wait for.
  std::uint64_t uploadValue() const { return uploadValue_; }
  Residency residency() const;
  // Each error once.
  std::optional<std::string> takeError();

 private:
  struct Resident {
    std::unique_ptr<runtime::Frame> frame;
    std::uint64_t used = 0;  // the update that drew it last
  };
  struct Volume {
    std::map<std::uint32_t, Resident> residents;
    std::set<std::uint32_t> failed;
  };

  runtime::Drawable drawableOf(std::size_t volume, double time);
  void prefetch(double time, double velocity);
  const runtime::Frame* load(std::size_t volume, std::uint32_t frame);
  bool makeRoom();
  void touch(const runtime::Drawable& drawable);
  std::uint64_t bytes() const;

  runtime::Renderer& renderer_;
  const command::Contents& contents_;
  std::uint64_t budget_;
  std::uint32_t framesInFlight_;
  Interpolation interpolation_;
  std::vector<Volume> volumes_;
  std::vector<runtime::Drawable> shown_;
  std::deque<std::string> errors_;
  std::uint64_t updates_ = 0, uploadValue_ = 0, late_ = 0;
  bool waiting_ = false;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_PLAYER_H
