// The standard and the code say the same: byte tables and the list of rules.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "billow/format/validate.h"
#include "spec_document.h"
#include "struct_layouts.h"

namespace billow {
namespace {

using namespace format;
using tests::expectDocument;
using tests::Field;
using tests::Layout;
using tests::layouts;
using tests::readSpec;

// ---- Byte tables

// Byte tables of format.md: "### `Name` (N bytes)", then rows "| offset | size | `field` | ...".
std::map<std::string, Layout> documentedLayouts() {
  std::map<std::string, Layout> all;
  std::istringstream text(readSpec("format.md"));
  std::string line, name;
  while (std::getline(text, line)) {
    if (line.rfind("### `", 0) == 0) {
      const std::size_t end = line.find('`', 5);
      name = line.substr(5, end - 5);
      all[name].size = static_cast<std::size_t>(std::atoi(line.c_str() + end + 3));
    } else if (line.starts_with('#')) {
      name.clear();
    } else if (!name.empty() && line.starts_with("| ") && std::isdigit(static_cast<unsigned char>(line[2])) != 0) {
      std::istringstream row(line);
      std::string bar, field;
      std::size_t offset = 0, size = 0;
      row >> bar >> offset >> bar >> size >> bar >> field;
      all[name].fields.push_back({field.substr(1, field.size() - 2), offset, size});
    }
  }
  return all;
}

TEST(Spec, ByteTablesAreThoseOfTheCode) {
  const std::map<std::string, Layout> documented = documentedLayouts();
  for (const auto& [name, layout] : layouts()) {
    ASSERT_TRUE(documented.contains(name)) << name;
    EXPECT_EQ(documented.at(name).size, layout.size) << name;
    EXPECT_EQ(documented.at(name).fields, layout.fields) << name;
    std::size_t end = 0;
    for (const Field& field : layout.fields) {
      EXPECT_EQ(field.offset, end) << name << "::" << field.name << " follows a gap";
      end = field.offset + field.size;
    }
    EXPECT_EQ(end, layout.size) << name;
  }
  EXPECT_EQ(documented.size(), layouts().size());
}

// ---- Rules

std::string issuesDocument() {
  static const std::map<int, std::string> kParts = {{0, "Getting at the bytes (1–99)"},
                                                    {1, "Header and contents (1xx)"},
                                                    {2, "Tables (2xx)"},
                                                    {3, "Pages (3xx)"},
                                                    {4, "Nodes (4xx)"},
                                                    {5, "Bricks (5xx)"},
                                                    {6, "Grid frames against their trees (6xx)"},
                                                    {7, "Effects (7xx)"}};
  std::string text =
      "# Every rule of a pack\n\n"
      "Generated from the catalogue in the code; see [format.md](format.md) for the rules in full. Each sentence is "
      "what\n"
      "holds in a sound pack; the issue says that it does not. Numbers are never used again for another rule. Below "
      "100\n"
      "the pack may be sound: its bytes could not be had, or a limit of the reader was met.\n";
  int part = -1;
  for (const IssueKind& kind : issueCatalogue()) {
    if (kind.id / 100 != part) {
      part = kind.id / 100;
      text += fmt::format("\n## {}\n\n| id | name | severity | rule |\n|---|---|---|---|\n", kParts.at(part));
    }
    text += fmt::format("| {} | {} | {} | {} |\n", kind.id, kind.name,
                        kind.severity == Severity::error ? "error" : "warning", kind.summary);
  }
  return text;
}

TEST(Spec, IssuesAreThoseOfTheCatalogue) {
  expectDocument("issues.md", issuesDocument());
}

TEST(Spec, CatalogueNamesAreUnique) {
  std::set<std::string_view> names;
  for (const IssueKind& kind : issueCatalogue()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_FALSE(kind.summary.empty()) << kind.id;
  }
}

// Every rule about the pack itself is explained in format.md: its number stands in brackets there.
TEST(Spec, EveryRuleIsInTheStandard) {
  const std::string text = readSpec("format.md");
  std::set<int> cited;
  for (std::size_t at = text.find('['); at != std::string::npos; at = text.find('[', at + 1)) {
    for (std::size_t i = at + 1; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0;) {
      char* end = nullptr;
      cited.insert(static_cast<int>(std::strtol(text.c_str() + i, &end, 10)));
      i = static_cast<std::size_t>(end - text.c_str());
      if (text.compare(i, 2, ", ") == 0) i += 2;
    }
  }
  for (const IssueKind& kind : issueCatalogue()) {
    if (kind.id <= 2) continue;  // about the file, not the pack
    EXPECT_TRUE(cited.contains(kind.id)) << kind.id << " " << kind.name;
  }
}

}  // namespace
}  // namespace billow
