#include "openings.h"

#include <utility>

namespace billow::runtime {

void Openings::start(Transport& transport) {
  transport_ = &transport;
  for (Opening& opening : openings_) {
    if (!opening.dropped) continue;
    opening.dropped = false;
    post(opening);
  }
}

void Openings::stop() {
  reads_.waitForNone();
  std::unique_lock lock(mutex_);
  for (Opening& opening : openings_) {
    if (opening.begun || opening.opened) continue;
    opening.dropped = true;
    opening.reader.reset();
  }
  ended_.wait(lock, [this] { return running_ == 0; });
}

Result<Opened> Openings::openHere(const PackSource& source, AssetId asset) {
  if (source.source == nullptr) return openFile(source.path, asset, Reserve{*transport_});
  std::mutex mutex;
  std::condition_variable came;
  bool done = false;
  const auto reader = TableReader::make(source.source, asset, Reserve{*transport_}, reads_, [&] {
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
  std::list<Opening> made;
  made.push_back({.self = *this, .source = source, .asset = asset, .reload = reload});
  Opening& opening = made.front();
  {
    const std::lock_guard lock(mutex_);
    openings_.splice(openings_.end(), made);
  }
  try {
    post(opening);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    openings_.pop_back();
    throw;
  }
}

// Throws std::bad_alloc before anything of it is on its way.
void Openings::post(Opening& opening) {
  if (opening.source.source == nullptr) return transport_->read(&Openings::finish, &opening);
  const auto reader = TableReader::make(opening.source.source, opening.asset, Reserve{*transport_}, reads_,
                                        [&opening] { tablesCame(opening); });
  opening.reader = reader;
  reader->start();  // `opening` may be gone when it returns, by take()
}

void Openings::tablesCame(Opening& opening) {
  try {
    opening.self.transport_->run(&Openings::finish, &opening);
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock(opening.self.mutex_);
    opening.opened = tl::unexpected(Error{.code = ErrorCode::memory, .message = "out of memory"});
    opening.reader.reset();
  }
}

void Openings::finish(void* context) {
  Opening& opening = *static_cast<Opening*>(context);
  {
    const std::lock_guard lock(opening.self.mutex_);
    if (opening.dropped) return;
    opening.begun = true;
    ++opening.self.running_;
  }
  auto opened = opening.reader != nullptr
                    ? opening.reader->open()
                    : openFile(opening.source.path, opening.asset, Reserve{*opening.self.transport_});
  opening.reader.reset();
  opening.self.end(opening, std::move(opened));
}

void Openings::end(Opening& opening, Result<Opened> opened) {
  const std::lock_guard lock(mutex_);
  opening.opened = std::move(opened);
  // Under the lock: who waits may destroy this as soon as none runs.
  if (--running_ == 0) ended_.notify_all();
}

void Openings::take(std::vector<OpenDone>& done) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  for (auto it = openings_.begin(); it != openings_.end();) {
    if (!it->opened) {
      ++it;
      continue;
    }
    done.push_back({it->asset, it->reload, std::move(*it->opened)});
    it = openings_.erase(it);
  }
}

}  // namespace billow::runtime
