// Any bytes: opening and validating must agree, and neither may crash.
#include <cstdlib>

#include "billow/format/pack.h"
#include "billow/format/validate.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace billow::format;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  const std::vector<std::byte> bytes(first, first + size);
  std::uint64_t errors = 0;
  ValidateOptions options;
  options.threads = 1;
  validate(*makeMemorySource(bytes), options, [&](const Issue& issue) {
    errors += issue.kind->severity == Severity::error ? 1 : 0;
    if (toString(issue).empty()) std::abort();
  });
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  if (!pack && errors == 0) std::abort();  // the loader refuses only what the validator reports
  return 0;
}
