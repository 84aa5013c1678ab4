// Is a pack sound? The same rules that Pack::open and GridView::load stop at, all collected.
#ifndef BILLOW_FORMAT_VALIDATE_H
#define BILLOW_FORMAT_VALIDATE_H

#include <cstdint>
#include <functional>
#include <span>

#include "billow/format/issue.h"
#include "billow/format/source.h"

namespace billow::format {

// Every kind of issue there is, by ascending id.
std::span<const IssueKind> issueCatalogue();

struct ValidateOptions {
  std::uint32_t maxIssues = 1000;  // then it stops
  unsigned threads = 0;            // 0: as many as the machine has
};

// Checks every byte of the pack. Issues arrive in the order of the checks (header, contents, tables, sections, pages by
// number, grid frames by number), the same for any thread count. `sink` is called from this thread. Where memory runs
// out, a last issue says so (memory); what the rest of the pack holds is then not known.
// Memory is the tables, for each thread the pages of one grid frame, and one bit for each node, mask and brick unit of
// the pack.
void validate(const ByteSource& source, const ValidateOptions& options, const std::function<void(const Issue&)>& sink);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_VALIDATE_H
