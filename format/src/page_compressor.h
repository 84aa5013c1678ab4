// Compresses pages on a few threads and gives them back in the order in which they came.
#ifndef BILLOW_FORMAT_SRC_PAGE_COMPRESSOR_H
#define BILLOW_FORMAT_SRC_PAGE_COMPRESSOR_H

#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "billow/format/writer.h"

namespace billow::format {

using PageRuns = std::array<StreamRange, kStreamCount>;

struct CompressedPage {
  std::vector<std::byte> stored;
  Codec codec = Codec::raw;
};

// Memory is bounded: the caller takes the oldest page whenever full() says so.
class PageCompressor {
 public:
  PageCompressor(Compression compression, unsigned threads);  // 0: as many as the machine has, at most 8
  PageCompressor(const PageCompressor&) = delete;
  PageCompressor& operator=(const PageCompressor&) = delete;
  ~PageCompressor();

  void submit(std::vector<std::byte> raw, const PageRuns& runs);
  bool empty() const { return jobs_.empty(); }  // only submit() and take() change it, and one thread calls them
  bool full() const { return jobs_.size() >= 4 * threadLimit_; }
  // Waits for the oldest page. Throws what its compression threw.
  CompressedPage take();

 private:
  struct Job {
    std::vector<std::byte> raw;
    PageRuns runs;
    CompressedPage page;
    std::exception_ptr failure;
    bool done = false;
  };
  void work();

  const Compression compression_;
  const std::size_t threadLimit_;
  std::deque<std::shared_ptr<Job>> jobs_;     // all that were submitted and not taken
  std::deque<std::shared_ptr<Job>> waiting_;  // of them, those that no thread has begun
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_PAGE_COMPRESSOR_H
