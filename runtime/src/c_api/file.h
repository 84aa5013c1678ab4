// Where a host's pack comes from.
#ifndef BILLOW_RUNTIME_C_API_FILE_H
#define BILLOW_RUNTIME_C_API_FILE_H

#include "billow/runtime/stream.h"
#include "c_api/problem.h"

namespace billow::c_api {

Outcome<runtime::PackSource> sourceOf(const BillowOpenInfo& info);

// From now on the host's file is closed once nobody can read it any more; before it stays the host's. Called while
// `source` keeps it.
void takeFile(const runtime::PackSource& source);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_FILE_H
