// Plays a document's volumes through a streamer, as a game would: the streamer has the clock, and is told only what the
// user changes.
#ifndef BILLOW_VIEWER_PLAYER_H
#define BILLOW_VIEWER_PLAYER_H

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clock.h"
#include "file_watch.h"
#include "traffic.h"

namespace billow::viewer {

using runtime::Interpolation;

struct StreamBudgets {
  std::uint64_t gpu = std::uint64_t{512} << 20;  // of frames
  std::uint64_t cpu = std::uint64_t{64} << 20;   // of what is on its way to the GPU
};

// How the picture is seen that shows the next update().
struct Seen {
  runtime::View view;
  std::uint32_t pixelsHigh = 1;
};

class Player {
 public:
  // `renderer`, `contents` and `request` outlive it; the contents may become others of the same packs. Refuses packs
  // that cannot be opened. `framesInFlight` as the host draws.
  static command::Checked<std::unique_ptr<Player>> make(runtime::Renderer& renderer, const command::Contents& contents,
                                                        const command::RenderRequest& request,
                                                        const StreamBudgets& budgets, std::uint32_t framesInFlight);

  // Once a picture, `seconds` after the one before. What cannot be loaded leaves what was shown before, and an error.
  void update(const Timeline& timeline, double seconds, const Seen& seen);

  // What shows, one for each volume, without layers where nothing does. Until the next update().
  const std::vector<runtime::Drawable>& drawables() const { return drawables_; }
  // Whether that is other than before the last update().
  bool changed() const { return changed_; }
  // Whether it is all that the moment has, in the detail that the picture asks for.
  bool complete() const;
  // Whether something is on its way, so that another update() has something to do.
  bool waiting() const;
  // What the submission that draws must wait for.
  runtime::UploadWait wait() const { return streamer_->wait(); }

  // The grids that `contents` now have for this volume.
  void regrid(std::size_t volume);
  void setBudgets(const StreamBudgets& budgets);
  const StreamBudgets& budgets() const { return budgets_; }
  // True once after packs that were written anew have taken the places of the old ones.
  bool takeRenewed() { return std::exchange(renewed_, false); }

  // Of the first volume's frames, as Streamer::residency() has it.
  std::vector<std::uint8_t> residency() const;
  const Traffic& traffic() const { return traffic_; }
  // Each error once.
  std::optional<std::string> takeError();

 private:
  struct Asset {
    runtime::AssetId id;
    FileWatch file;
    const format::Pack* pack = nullptr;  // that plays
    bool stale = false;                  // the file is another one
  };
  struct Track {
    runtime::InstanceId instance;
    runtime::InstanceId next;  // of other grids, until it has something to draw
    Clock clock;
  };

  Player(const command::Contents& contents, const command::RenderRequest& request, const StreamBudgets& budgets)
      : contents_(contents), request_(request), budgets_(budgets) {}
  runtime::Result<runtime::InstanceId> addInstance(std::size_t volume, const Clock& clock);
  command::Checked<void> open(const command::PlacedVolume& volume);
  bool follow(const Timeline& timeline);
  void swapGrids();
  void look();
  void watch(double seconds);

  const command::Contents& contents_;
  const command::RenderRequest& request_;
  StreamBudgets budgets_;
  std::unique_ptr<runtime::Streamer> streamer_;
  std::map<std::string, Asset> assets_;  // by path
  std::vector<Track> tracks_;            // by volume
  std::vector<runtime::Drawable> drawables_;
  Traffic traffic_;
  std::vector<std::string> errors_;
  std::optional<std::uint32_t> jumps_, seeks_;  // of the time line, as of the last update()
  std::uint32_t updates_ = 0;                   // since a jump
  bool moving_ = false;                         // the time line
  std::chrono::steady_clock::time_point updated_ = std::chrono::steady_clock::now();
  double quiet_ = 0;  // seconds since something changed
  double unwatched_ = 0;
  bool changed_ = false, renewed_ = false;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_PLAYER_H
