#include "c_api/look_fit.h"

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>

namespace billow::c_api {
namespace {

// One read of an AsyncSource that is waited for.
struct Awaited {
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false, success = false;

  static void end(void* context, bool success) {
    auto& read = *static_cast<Awaited*>(context);
    const std::lock_guard lock(read.mutex);
    read.done = true;
    read.success = success;
    read.ended.notify_all();
  }
};

class WaitingSource final : public format::ByteSource {
 public:
  explicit WaitingSource(std::shared_ptr<runtime::AsyncSource> source) : source_(std::move(source)) {}
  std::uint64_t size() const override { return source_->size(); }
  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    if (offset > size() || into.size() > size() - offset) return false;
    Awaited read;
    source_->read(offset, into, {.call = Awaited::end, .context = &read});
    std::unique_lock lock(read.mutex);
    read.ended.wait(lock, [&] { return read.done; });
    return read.success;
  }

 private:
  std::shared_ptr<runtime::AsyncSource> source_;
};

format::Result<format::Pack> openAgain(const runtime::PackSource& source) {
  if (source.source) return format::Pack::open(std::make_unique<WaitingSource>(source.source));
  return format::Pack::openFile(source.path);
}

std::optional<runtime::Look> fitLook(const format::Pack& pack, const format::VolumeRecord& volume) {
  const auto look = runtime::suggestLook(pack, volume, runtime::chooseGrids(pack, volume));
  return look ? std::optional(*look) : std::nullopt;
}

}  // namespace

void LookFit::run() noexcept {
  try {
    // A pack that cannot be opened is an error of the streamer's, which opens it as well.
    if (const auto pack = openAgain(source_); pack && !stop_) {
      looks_.resize(pack->volumes().size());
      for (std::uint32_t number = 0; number < looks_.size() && !stop_; ++number) {
        if (!pack->isLevel(number)) looks_[number] = fitLook(*pack, pack->volumes()[number]);
      }
    }
  } catch (const std::exception&) {
    looks_.clear();
  }
  source_ = {};
  done_ = true;
}

LookFitter::~LookFitter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    if (running_ != nullptr) running_->abandon();
  }
  more_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void LookFitter::add(std::shared_ptr<LookFit> fit) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(fit));
  more_.notify_all();
  if (thread_.joinable()) return;
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error&) {
    waiting_.pop_back();
    throw;
  }
}

void LookFitter::run() noexcept {
  std::unique_lock lock(mutex_);
  for (;;) {
    more_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    running_ = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    running_->run();
    lock.lock();
    running_.reset();
  }
}

}  // namespace billow::c_api
