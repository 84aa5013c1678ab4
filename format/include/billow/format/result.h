// Value-or-error. No exception crosses format's or runtime's API.
#ifndef BILLOW_FORMAT_RESULT_H
#define BILLOW_FORMAT_RESULT_H

#include <tl/expected.hpp>

#include "billow/format/issue.h"

namespace billow::format {

template <class T>
using Result = tl::expected<T, Issue>;

}  // namespace billow::format

#endif  // BILLOW_FORMAT_RESULT_H
