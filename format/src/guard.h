// Where the library's callers enter: what the standard library throws becomes an issue.
#ifndef BILLOW_FORMAT_SRC_GUARD_H
#define BILLOW_FORMAT_SRC_GUARD_H

#include <new>
#include <stdexcept>
#include <system_error>

#include "billow/format/result.h"
#include "rules.h"

namespace billow::format {

// What work() returns, or Rule::memory where memory or a system resource ran out. The details fit std::string's own
// buffer, so that telling allocates nothing.
template <class T, class Work>
Result<T> guarded(const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return tl::make_unexpected(makeIssue(Rule::memory, {}, "Out of memory."));
  } catch (const std::length_error&) {
    return tl::make_unexpected(makeIssue(Rule::memory, {}, "Out of memory."));
  } catch (const std::system_error&) {
    return tl::make_unexpected(makeIssue(Rule::memory, {}, "System error."));
  }
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_GUARD_H
