// Opening packs: tables are read and checked, and clips made, on the calling thread or on another one.
#ifndef BILLOW_RUNTIME_STREAM_OPENING_H
#define BILLOW_RUNTIME_STREAM_OPENING_H

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "clip.h"
#include "page_reads.h"

namespace billow::runtime {

struct Opened {
  std::shared_ptr<OpenPack> pack;
  std::vector<std::shared_ptr<const Clip>> clips;  // by volume
  std::uint64_t bytes = 0;                         // reserved of the CPU budget, given back when the pack is closed
};

// What is kept for a clip, of the CPU budget.
std::uint64_t bookkeepingBytes(const Clip& clip);

// Reserves bytes of the CPU budget; false where they do not fit.
struct Reserve {
  Transport& transport;
  bool operator()(std::uint64_t bytes) const { return transport.reserveCpu(bytes); }
  void giveBack(std::uint64_t bytes) const { transport.releaseCpu(bytes); }
};

// Reads a file on the calling thread.
Result<Opened> openFile(const std::string& path, AssetId asset, Reserve reserve);

// The tables of a host's source: read piece by piece without a thread that waits, each when the one before has come.
class TableReader {
 public:
  // `done` is called once, on the thread of the last read; perhaps before start() returns. It must not throw.
  // `inFlight` counts reads until their callbacks have returned; reader and source live as long.
  static std::shared_ptr<TableReader> make(std::shared_ptr<AsyncSource> source, AssetId asset, Reserve reserve,
                                           ReadsInFlight& inFlight, std::function<void()> done);
  virtual ~TableReader() = default;
  virtual void start() = 0;
  // After `done`: checks what was read.
  virtual Result<Opened> open() = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_OPENING_H
