// Value-or-error. No exception crosses the API of reading a pack (pack.h, grid_view.h, validate.h) or of the runtime:
// where memory runs out, that is an error too.
#ifndef BILLOW_FORMAT_RESULT_H
#define BILLOW_FORMAT_RESULT_H

#include <tl/expected.hpp>

#include "billow/format/issue.h"

namespace billow::format {

template <class T>
using Result = tl::expected<T, Issue>;

}  // namespace billow::format

#endif  // BILLOW_FORMAT_RESULT_H
