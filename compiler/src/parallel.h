// Loops shared among TBB's threads.
#ifndef BILLOW_COMPILER_PARALLEL_H
#define BILLOW_COMPILER_PARALLEL_H

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <cstddef>

namespace billow::compiler {

// Calls function(begin, end) on ranges of about `grain` that cover [0, count). Always to its end, unless function
// itself throws: a loop inside a pipeline would be cancelled silently, half done, as soon as another frame fails.
template <class Function>
void parallelRanges(std::size_t count, std::size_t grain, const Function& function) {
  tbb::task_group_context context(tbb::task_group_context::isolated);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, grain),
      [&](const auto& range) { function(range.begin(), range.end()); }, context);
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PARALLEL_H
