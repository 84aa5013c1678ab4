// Packs that are being opened on other threads, for update() to find.
#ifndef BILLOW_RUNTIME_STREAM_OPENINGS_H
#define BILLOW_RUNTIME_STREAM_OPENINGS_H

#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
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

  // Goes on with what stop() left.
  void start(Transport& transport);
  // Waits for the host's reads in flight and for jobs that have begun; those that have not do nothing any more. take()
  // still gives what has ended.
  void stop();

  // On the calling thread, which waits for the host's reads.
  Result<Opened> openHere(const PackSource& source, AssetId asset);
  // Throws std::bad_alloc, and then opens nothing.
  void openLater(const PackSource& source, AssetId asset, bool reload);
  // Those that have ended since; none while one is just being handed over.
  void take(std::vector<OpenDone>& done);

 private:
  struct Opening {
    Openings& self;
    PackSource source;
    AssetId asset;
    bool reload;
    std::shared_ptr<TableReader> reader = {};  // of a host's source
    // By mutex_.
    bool begun = false, dropped = false;
    std::optional<Result<Opened>> opened = {};  // it has ended
  };
  void post(Opening& opening);
  static void tablesCame(Opening& opening);
  static void finish(void* opening);
  void end(Opening& opening, Result<Opened> opened);

  Transport* transport_ = nullptr;
  ReadsInFlight reads_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::uint32_t running_ = 0;    // by mutex_
  std::list<Opening> openings_;  // by mutex_
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_OPENINGS_H
