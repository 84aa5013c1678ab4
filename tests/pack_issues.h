// What validator and loader find in a pack, and packs in which one thing is wrong.
#ifndef BILLOW_TESTS_PACK_ISSUES_H
#define BILLOW_TESTS_PACK_ISSUES_H

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "billow/format/grid_view.h"
#include "billow/format/validate.h"
#include "pack_image.h"
#include "sample_pack.h"

namespace billow::tests {

inline std::vector<format::Issue> issuesOf(std::vector<std::byte> bytes, unsigned threads = 1) {
  std::vector<format::Issue> issues;
  format::ValidateOptions options;
  options.threads = threads;
  format::validate(*format::makeMemorySource(std::move(bytes)), options,
                   [&](const format::Issue& issue) { issues.push_back(issue); });
  return issues;
}

inline std::multiset<int> idsOf(const std::vector<std::byte>& bytes) {
  std::multiset<int> ids;
  for (const format::Issue& issue : issuesOf(bytes)) ids.insert(issue.kind->id);
  return ids;
}

inline bool hasError(const std::vector<std::byte>& bytes) {
  const std::vector<format::Issue> issues = issuesOf(bytes);
  return std::any_of(issues.begin(), issues.end(),
                     [](const format::Issue& issue) { return issue.kind->severity == format::Severity::error; });
}

inline const std::vector<std::byte>& sample() {
  static const std::vector<std::byte> bytes = samplePack();
  return bytes;
}

// What opening the pack and loading all of it stops at; 0 when it doesn't.
inline int loaderStop(const std::vector<std::byte>& bytes) {
  const format::Result<format::Pack> pack = format::Pack::open(format::makeMemorySource(bytes));
  if (!pack) return pack.error().kind->id;
  for (const format::GridFrame& frame : pack->gridFrames()) {
    const format::Result<format::GridView> view = format::GridView::load(*pack, frame);
    if (!view) return view.error().kind->id;
  }
  return 0;
}

// The one issue that the change brings, found by validator and loader alike.
inline void expectIssue(int id, const std::function<void(PackImage&)>& change) {
  PackImage image = PackImage::of(sample());
  change(image);
  const std::vector<std::byte> bytes = image.assemble();
  std::string all;
  for (const format::Issue& issue : issuesOf(bytes)) all += format::toString(issue) + "\n";
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{id}) << all;
  const auto catalogue = format::issueCatalogue();
  const auto kind =
      std::find_if(catalogue.begin(), catalogue.end(), [&](const format::IssueKind& k) { return k.id == id; });
  ASSERT_NE(kind, catalogue.end());
  EXPECT_EQ(loaderStop(bytes), kind->severity == format::Severity::error ? id : 0) << all;
}

// The same for changes of the finished bytes.
inline void expectBytesIssue(int id, const std::function<void(std::vector<std::byte>&)>& change, bool opens = false) {
  std::vector<std::byte> bytes = sample();
  change(bytes);
  std::string all;
  for (const format::Issue& issue : issuesOf(bytes)) all += format::toString(issue) + "\n";
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{id}) << all;
  EXPECT_EQ(loaderStop(bytes), opens ? 0 : id) << all;
}

inline void editHeader(std::vector<std::byte>& bytes, const std::function<void(format::FileHeader&)>& edit) {
  auto header = getAt<format::FileHeader>(bytes, 0);
  edit(header);
  putAt(bytes, 0, header);
  sealHeader(bytes);
}

inline void editEntry(std::vector<std::byte>& bytes, std::size_t entry,
                      const std::function<void(format::SectionEntry&)>& edit) {
  const std::size_t at = sizeof(format::FileHeader) + entry * sizeof(format::SectionEntry);
  auto section = getAt<format::SectionEntry>(bytes, at);
  edit(section);
  putAt(bytes, at, section);
  sealHeader(bytes);
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_PACK_ISSUES_H
