// Packs that are being opened on other threads, for update() to find.
#ifndef BILLOW_RUNTIME_STREAM_OPENINGS_H
#define BILLOW_RUNTIME_STREAM_OPENINGS_H

#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "opening.h"

namespace billow::runtime {

struct OpenDone {
  AssetId asset = {};
  bool reload = false;
  Result<Opened> opened;
};

// All but the jobs that it runs is for one thread at a time.
class Openings {
 public:
  Openings() = default;
  Openings(const Openings&) = delete;
  Openings& operator=(const Openings&) = delete;

  void start(Transport& transport);
  // Waits for the packs that are on their way, reads of the host's included. take() still gives them.
  void stop();

  // On the calling thread, which waits for the host's reads.
  Result<Opened> openHere(const PackSource& source, AssetId asset);
  void openLater(const PackSource& source, AssetId asset, bool reload);
  // Those that have ended since; none while one is just being handed over.
  void take(std::vector<OpenDone>& done);

 private:
  struct Opening {
    Openings& self;
    AssetId asset;
    bool reload;
    std::string path;
    std::unique_ptr<TableReader> reader;  // of a host's source
  };
  static void finish(void* opening);
  void end(const Opening& opening, Result<Opened> opened);

  Transport* transport_ = nullptr;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::uint32_t running_ = 0;   // by mutex_
  std::vector<OpenDone> done_;  // by mutex_
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_OPENINGS_H
