// A frame that fails must not make another frame's loops end half done.
#include <gtest/gtest.h>

#include <atomic>

#include "parallel.h"

namespace billow::compiler {
namespace {

TEST(Parallel, RangesRunToTheirEndInsideACancelledLoop) {
  tbb::task_group_context cancelled;
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(
      0, 1,
      [&](int) {
        cancelled.cancel_group_execution();
        parallelRanges(1000, 16, [&](std::size_t begin, std::size_t end) { done += end - begin; });
      },
      cancelled);
  EXPECT_EQ(done, 1000u);
}

TEST(Parallel, WhatARangeThrowsIsThrown) {
  EXPECT_THROW(parallelRanges(100, 1,
                              [](std::size_t begin, std::size_t) {
                                if (begin == 50) throw 1;
                              }),
               int);
}

}  // namespace
}  // namespace billow::compiler
