#include "page_compressor.h"

#define ZSTD_STATIC_LINKING_ONLY  // how literals are coded
#include <zstd.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "billow/format/page_codec.h"

namespace billow::format {
namespace {

using Context = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;

struct ZstdSettings {
  int level;
  ZSTD_literalCompressionMode_e literals;
};
constexpr ZstdSettings kUsual{9, ZSTD_lcm_auto}, kQuickLook{1, ZSTD_lcm_auto};
// What is not found again is left as it is: reading is half as fast again, and a longer search makes up for the size.
constexpr ZstdSettings kFastReading{9, ZSTD_lcm_uncompressed};

std::size_t checked(std::size_t result) {
  if (ZSTD_isError(result)) throw std::runtime_error(ZSTD_getErrorName(result));
  return result;
}

std::vector<std::byte> compressZstd(ZSTD_CCtx* context, std::span<const std::byte> raw, const ZstdSettings& settings) {
  checked(ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters));
  checked(ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, settings.level));
  checked(ZSTD_CCtx_setParameter(context, ZSTD_c_literalCompressionMode, settings.literals));
  std::vector<std::byte> stored(ZSTD_compressBound(raw.size()));
  stored.resize(checked(ZSTD_compress2(context, stored.data(), stored.size(), raw.data(), raw.size())));
  return stored;
}

// Whether the model did so well on a page of the usual size that zstd needs fewer bytes only where content repeats: a
// quick look tells, at a fraction of the time.
constexpr bool isWell(std::size_t stored, std::size_t raw) {
  return raw >= std::size_t{1} << 15 && stored <= raw / 8 * 5;
}

CompressedPage compress(ZSTD_CCtx* context, std::vector<std::byte> raw, const PageRuns& runs, Compression compression) {
  if (compression == Compression::none) return {std::move(raw), Codec::raw};
  std::vector<std::byte> modelled;
  if (compression == Compression::small) {
    modelled = encodePage(runs, raw);
    if (isWell(modelled.size(), raw.size()) && compressZstd(context, raw, kQuickLook).size() >= modelled.size())
      return {std::move(modelled), Codec::model};
  }
  const ZstdSettings& settings = compression == Compression::small ? kUsual : kFastReading;
  CompressedPage page{compressZstd(context, raw, settings), Codec::zstd};
  if (compression == Compression::small && modelled.size() < page.stored.size())
    page = {std::move(modelled), Codec::model};
  if (page.stored.size() >= raw.size()) return {std::move(raw), Codec::raw};
  return page;
}

}  // namespace

PageCompressor::PageCompressor(Compression compression, unsigned threads)
    : compression_(compression),
      threadLimit_(std::clamp<std::size_t>(threads != 0 ? threads : std::thread::hardware_concurrency(), 1, 8)) {}

PageCompressor::~PageCompressor() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void PageCompressor::submit(std::vector<std::byte> raw, const PageRuns& runs) {
  auto job = std::make_shared<Job>();
  job->raw = std::move(raw);
  job->runs = runs;
  jobs_.push_back(job);
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(job));
  }
  changed_.notify_all();
  if (threads_.size() < std::min(threadLimit_, jobs_.size())) threads_.emplace_back([this] { work(); });
}

CompressedPage PageCompressor::take() {
  const std::shared_ptr<Job> job = std::move(jobs_.front());
  jobs_.pop_front();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return job->done; });
  if (job->failure) std::rethrow_exception(job->failure);
  return std::move(job->page);
}

void PageCompressor::work() {
  const Context context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return closing_ || !waiting_.empty(); });
    if (closing_) return;
    const std::shared_ptr<Job> job = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    try {
      if (!context) throw std::bad_alloc();
      job->page = compress(context.get(), std::move(job->raw), job->runs, compression_);
    } catch (...) {
      job->failure = std::current_exception();
    }
    lock.lock();
    job->done = true;
    changed_.notify_all();
  }
}

}  // namespace billow::format
