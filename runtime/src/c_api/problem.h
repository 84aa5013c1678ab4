// What goes wrong inside of a function of billow.h, and how it reaches the host.
#ifndef BILLOW_RUNTIME_C_API_PROBLEM_H
#define BILLOW_RUNTIME_C_API_PROBLEM_H

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "billow/billow.h"
#include "billow/runtime/runtime.h"

namespace billow::c_api {

struct Problem {
  BillowResult result = BILLOW_ERROR_MEMORY;
  std::string message = {};
  std::uint32_t pack = 0, volume = BILLOW_NONE, frame = BILLOW_NONE, page = BILLOW_NONE;
};

template <class T>
using Outcome = tl::expected<T, Problem>;

BillowResult resultOf(runtime::ErrorCode code);
tl::unexpected<Problem> problem(const runtime::Error& error);
tl::unexpected<Problem> badArgument(std::string message);
tl::unexpected<Problem> notReady(std::string message);

// Fills *error where there is one, and returns the result.
BillowResult report(const Problem& problem, BillowError* error) noexcept;

// Runs what a function of billow.h does; no exception passes.
template <class Work>
BillowResult answering(BillowError* error, const Work& work) noexcept {
  try {
    const Outcome<void> done = work();
    return done ? BILLOW_OK : report(done.error(), error);
  } catch (...) {
    return report({.result = BILLOW_ERROR_MEMORY}, error);
  }
}

// The same for those that have no result.
template <class Work>
void quietly(const Work& work) noexcept {
  answering(nullptr, [&]() -> Outcome<void> {
    work();
    return {};
  });
}

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_PROBLEM_H
