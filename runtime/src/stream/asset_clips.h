// The clips of an asset that instances may play, as numbers of Players: one for each volume, and those of other grids
// or of a level alone, which are made for the first instance that asks for them and go with the last. While a reload
// is under way each may have a successor.
#ifndef BILLOW_RUNTIME_STREAM_ASSET_CLIPS_H
#define BILLOW_RUNTIME_STREAM_ASSET_CLIPS_H

#include <optional>
#include <vector>

#include "opening.h"
#include "players.h"

namespace billow::runtime {

class AssetClips {
 public:
  // Bytes of what is made later are reserved of the transport, where there is one, and added to those of `opened`.
  struct Home {
    AssetId asset;
    Players& players;
    Transport* transport;
  };

  void open(const Opened& opened, Home home);
  void close(Home home);
  // The clip for an instance that asks for this. `next`: what is to take the place of `opened`, null where nothing is.
  Result<std::uint32_t> find(const InstanceInfo& info, Opened& opened, Opened* next, Home home);
  // Closes what was made for instances that are gone.
  void dropUnused(Opened& opened, Opened* next, Home home);

  // Successors of all clips that there can be.
  void openNext(const Opened& opened, Opened& next, Home home);
  std::vector<Succession> successions() const;
  void closeNext(Home home);
  // They take the places.
  void succeed(Home home);

 private:
  struct Made {
    GridChoice grids = {};
    std::uint32_t clip = format::kNone;
    std::uint64_t bytes = 0;
  };
  struct Chosen {
    std::uint32_t volume = 0;
    Made now, next;
  };
  static Result<Made> make(std::uint32_t volume, const GridChoice& grids, Opened& opened, Home home);
  static void drop(const Made& made, Opened& opened, Home home);
  static void makeNext(Chosen& chosen, const Opened& opened, Opened& next, Home home);

  std::vector<std::uint32_t> volumes_, nextVolumes_;  // by volume; kNone where nothing plays
  std::vector<Chosen> chosen_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_ASSET_CLIPS_H
