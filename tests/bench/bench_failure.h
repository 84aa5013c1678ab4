// How a benchmark ends that cannot go on.
#ifndef BILLOW_TESTS_BENCH_FAILURE_H
#define BILLOW_TESTS_BENCH_FAILURE_H

#include <errno.h>
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "billow/format/issue.h"

namespace billow::bench {

[[noreturn]] inline void fail(const std::string& message) {
  fmt::print(stderr, "{}: {}\n", program_invocation_short_name, message);
  std::exit(1);
}

// What `result` holds, or the end: with the runtime's error or the pack's issue.
template <class Expected>
auto valueOf(Expected result) {
  if (!result) {
    if constexpr (requires { result.error().message; })
      fail(result.error().message);
    else
      fail(toString(result.error()));
  }
  return std::move(*result);
}

// The same where there is no value.
template <class Expected>
void require(const Expected& result) {
  if (!result) fail(result.error().message);
}

}  // namespace billow::bench

#endif  // BILLOW_TESTS_BENCH_FAILURE_H
