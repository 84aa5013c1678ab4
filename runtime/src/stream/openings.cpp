#include "openings.h"

#include <utility>

namespace billow::runtime {

void Openings::start(Transport& transport) {
  transport_ = &transport;
}

void Openings::stop() {
  std::unique_lock lock(mutex_);
  ended_.wait(lock, [this] { return running_ == 0; });
}

Result<Opened> Openings::openHere(const PackSource& source, AssetId asset) {
  if (source.source == nullptr) return openFile(source.path, asset, Reserve{*transport_});
  std::mutex mutex;
  std::condition_variable came;
  bool done = false;
  const auto reader = TableReader::make(source.source, asset, Reserve{*transport_}, [&] {
    const std::lock_guard lock(mutex);
    done = true;
    came.notify_all();
  });
  reader->start();
  {
    std::unique_lock lock(mutex);
    came.wait(lock, [&] { return done; });
  }
  return reader->open();
}

void Openings::openLater(const PackSource& source, AssetId asset, bool reload) {
  auto opening = std::make_unique<Opening>(Opening{*this, asset, reload, source.path, nullptr});
  Opening* const kept = opening.get();
  if (source.source != nullptr) {
    kept->reader = TableReader::make(source.source, asset, Reserve{*transport_},
                                     [this, kept] { transport_->run(&Openings::finish, kept); });
  }
  {
    const std::lock_guard lock(mutex_);
    ++running_;
  }
  static_cast<void>(opening.release());  // finish() has it
  if (kept->reader != nullptr) {
    kept->reader->start();
  } else {
    transport_->run(&Openings::finish, kept);
  }
}

void Openings::finish(void* context) {
  const std::unique_ptr<Opening> opening(static_cast<Opening*>(context));
  auto opened = opening->reader != nullptr
                    ? opening->reader->open()
                    : openFile(opening->path, opening->asset, Reserve{*opening->self.transport_});
  opening->reader.reset();
  opening->self.end(*opening, std::move(opened));
}

void Openings::end(const Opening& opening, Result<Opened> opened) {
  const std::lock_guard lock(mutex_);
  done_.push_back({opening.asset, opening.reload, std::move(opened)});
  // Under the lock: who waits may destroy this as soon as none runs.
  if (--running_ == 0) ended_.notify_all();
}

void Openings::take(std::vector<OpenDone>& done) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock) done.swap(done_);
}

}  // namespace billow::runtime
