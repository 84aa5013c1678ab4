#include "planning.h"

#include <iterator>
#include <new>
#include <utility>

namespace billow::runtime {

void Snapshot::take(Report& report) {
  static_cast<Situation&>(*this) = report;
  instances.resize(report.moments.size());
  notices.reserve(notices.size() + report.notices.size());
  for (const Report::Placed& placed : report.changed) {
    // Others may have gone since.
    if (placed.index < instances.size()) instances[placed.index] = placed.view;
  }
  for (std::size_t i = 0; i < instances.size(); ++i) static_cast<InstanceMoment&>(instances[i]) = report.moments[i];
  notices.insert(notices.end(), std::make_move_iterator(report.notices.begin()),
                 std::make_move_iterator(report.notices.end()));
  report.changed.clear();
  report.notices.clear();
}

namespace {

template <class T>
void moveOver(std::vector<T>& from, std::vector<T>& to) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  from.clear();
}

}  // namespace

void Planning::start(Transport& transport, const StreamConfig& config) {
  planner_ = std::make_unique<Planner>(transport, config, told_);
  {
    const std::lock_guard lock(turn_);
    wanted_ = stopped_ = false;
  }
  if (on_ == PlanOn::thread) thread_ = std::thread(&Planning::work, this);
}

void Planning::stop() {
  {
    const std::lock_guard lock(turn_);
    stopped_ = true;
  }
  asked_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Planning::clear() {
  const std::lock_guard lock(mutex_);
  planner_.reset();
  report_ = pending_ = {};
  snapshot_ = {};
  came_ = began_ = false;
  fresh_ = false;
  changes_.clear();
  errors_.clear();
  stats_ = {};
}

void Planning::request() {
  {
    const std::lock_guard lock(turn_);
    if (stopped_) return;
    wanted_ = true;
  }
  if (on_ == PlanOn::request) return pass();
  asked_.notify_one();
}

void Planning::work() {
  for (;;) {
    {
      std::unique_lock lock(turn_);
      asked_.wait(lock, [this] { return wanted_ || stopped_; });
      if (stopped_) return;
      wanted_ = false;
    }
    try {
      pass();
    } catch (const std::bad_alloc&) {
      // The next one goes on.
    }
  }
}

void Planning::pass() {
  {
    const std::lock_guard lock(mutex_);
    if (!came_ && fresh_.load(std::memory_order_relaxed)) {
      std::swap(report_, pending_);
      fresh_.store(false, std::memory_order_release);
      came_ = began_ = true;
    }
  }
  if (came_) snapshot_.take(report_);
  came_ = false;
  if (!began_) return;
  planner_->pass(snapshot_, made_, met_);
  const std::lock_guard lock(mutex_);
  moveOver(made_, changes_);
  moveOver(met_, errors_);
  stats_ = planner_->stats();
}

void Planning::take(std::vector<Change>& changes, std::vector<StreamError>& errors, PlanStats& stats) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  // What could not be used the last time goes first.
  moveOver(changes_, changes);
  errors.swap(errors_);
  stats = stats_;
}

void Planning::publish(Report& report) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  std::swap(report, pending_);
  fresh_.store(true, std::memory_order_release);
}

}  // namespace billow::runtime
