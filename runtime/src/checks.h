// What the arguments of the recording functions allow, and no exception past them.
#ifndef BILLOW_RUNTIME_CHECKS_H
#define BILLOW_RUNTIME_CHECKS_H

#include <new>
#include <stdexcept>
#include <system_error>

#include "billow/runtime/runtime.h"

namespace billow::runtime {

bool finite(const std::array<float, 3>& v);
bool positive(float value);

// These name the first field that is outside of what runtime.h allows, or give null.
const char* badView(const View& view);
const char* badSun(const Sun& sun);
const char* badBackground(const Background& background);
const char* badLook(const Look& look);
const char* badQuality(const Quality& quality);

// What work() returns, or ErrorCode::memory where the standard library threw.
template <class T, class Work>
Result<T> guarded(const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return tl::unexpected(Error{.code = ErrorCode::memory, .message = "out of memory"});
  } catch (const std::length_error&) {
    return tl::unexpected(Error{.code = ErrorCode::memory, .message = "out of memory"});
  } catch (const std::system_error&) {
    return tl::unexpected(Error{.code = ErrorCode::memory, .message = "system error"});
  }
}

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_CHECKS_H
