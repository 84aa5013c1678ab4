// Runs the planner: one pass at a time, on a thread of its own that sleeps until something has changed.
#ifndef BILLOW_RUNTIME_STREAM_PLANNING_H
#define BILLOW_RUNTIME_STREAM_PLANNING_H

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "planner.h"

namespace billow::runtime {

// Where passes are made.
enum class PlanOn {
  thread,
  request,  // inside of request(), on its thread: what tests want, whose steps are to be the same each time
};

class Planning {
 public:
  explicit Planning(PlanOn on) : on_(on) {}
  Planning(const Planning&) = delete;
  Planning& operator=(const Planning&) = delete;
  ~Planning() { stop(); }

  void start(Transport& transport, const StreamConfig& config);
  // Waits for the pass that is being made.
  void stop();
  // After stop(): what has not been taken is gone, frames too.
  void clear();

  // From any thread: a pass is made soon after. Short, and no call into the transport with PlanOn::thread.
  void request();

  // On the frame thread. What planning made since the last time; nothing where it is just handing something over.
  void take(std::vector<Change>& changes, std::vector<StreamError>& errors, PlanStats& stats);
  // Whether a new report is welcome; publish() may then swap it in, and leave an empty one.
  bool wantsReport() const { return !fresh_.load(std::memory_order_acquire); }
  void publish(Report& report);

 private:
  void work();
  void pass();

  PlanOn on_;
  // Of the thread that makes passes.
  std::unique_ptr<Planner> planner_;
  ToldPages told_;
  Report report_;
  Snapshot snapshot_;
  bool came_ = false;   // the report is not in the snapshot yet
  bool began_ = false;  // a report has come
  std::vector<Change> made_;
  std::vector<StreamError> met_;

  std::thread thread_;
  std::mutex turn_;
  std::condition_variable asked_;
  bool wanted_ = false, stopped_ = true;  // by turn_

  std::mutex mutex_;  // of all below; held for swaps alone
  Report pending_;
  std::atomic<bool> fresh_ = false;
  std::vector<Change> changes_;
  std::vector<StreamError> errors_;
  PlanStats stats_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PLANNING_H
