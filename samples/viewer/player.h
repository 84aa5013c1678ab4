// The frames of a document's volumes, on the device when they are to be drawn.
#ifndef BILLOW_VIEWER_PLAYER_H
#define BILLOW_VIEWER_PLAYER_H

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "render_contents.h"

namespace billow::viewer {

// What is on the device.
struct Residency {
  std::vector<bool> frames;  // of the first volume, in its order
  std::uint64_t bytes = 0;   // of all volumes' frames
  std::uint32_t resident = 0;
  std::uint64_t late = 0;  // moments that were shown with another frame than theirs
};

class Player {
 public:
  // `contents` and `renderer` outlive it. `framesInFlight` as the host draws.
  Player(runtime::Renderer& renderer, const command::Contents& contents, std::uint64_t budget,
         std::uint32_t framesInFlight);

  // The frames that show at a time of the scene, one for each volume, null where none does. `velocity` says which come
  // next: scene seconds a second. Frames stay as long as commands that draw them may be pending. Once a picture.
  command::Checked<std::vector<const runtime::Frame*>> update(double time, double velocity);

  // Whether further frames are to come, so that another update() has something to do.
  bool waiting() const { return waiting_; }
  // What the submission that draws must wait for.
  std::uint64_t uploadValue() const { return uploadValue_; }
  Residency residency() const;

 private:
  struct Resident {
    std::unique_ptr<runtime::Frame> frame;
    std::uint64_t used = 0;  // the update that drew it last
  };
  using Residents = std::map<std::uint32_t, Resident>;

  command::Checked<Resident*> load(std::size_t volume, std::uint32_t frame);
  bool makeRoom(std::size_t volume, std::uint32_t wanted);
  command::Checked<void> prefetch(double time, double velocity);
  std::uint64_t bytes() const;

  runtime::Renderer& renderer_;
  const command::Contents& contents_;
  std::uint64_t budget_;
  std::uint32_t framesInFlight_;
  std::vector<Residents> residents_;  // by volume
  std::uint64_t updates_ = 0, uploadValue_ = 0, late_ = 0;
  bool waiting_ = false;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_PLAYER_H
