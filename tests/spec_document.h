// Documents in spec/ that are generated, whole or in part, and compared with what the code says.
#ifndef BILLOW_TESTS_SPEC_DOCUMENT_H
#define BILLOW_TESTS_SPEC_DOCUMENT_H

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace billow::tests {

inline std::string specPath(const std::string& name) {
  return std::string(BILLOW_SOURCE_DIR) + "/spec/" + name;
}

inline std::string readSpec(const std::string& name) {
  std::ifstream file(specPath(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Compares a generated document with the one in the repository, or writes it when asked to.
inline void expectDocument(const std::string& name, const std::string& text) {
  if (std::getenv("BILLOW_UPDATE_SPEC") != nullptr) std::ofstream(specPath(name), std::ios::binary) << text;
  EXPECT_EQ(readSpec(name), text) << "run with BILLOW_UPDATE_SPEC=1 to rewrite spec/" << name;
}

// The same for one part of a document, between the lines `<!-- generated: part -->` and `<!-- end -->`.
inline void expectDocumentPart(const std::string& name, const std::string& part, const std::string& text) {
  std::string document = readSpec(name);
  const std::string begin = "<!-- generated: " + part + " -->\n";
  const std::size_t from = document.find(begin);
  ASSERT_NE(from, std::string::npos) << "spec/" << name << " has no part " << part;
  const std::size_t first = from + begin.size();
  const std::size_t last = document.find("<!-- end -->\n", first);
  ASSERT_NE(last, std::string::npos) << "spec/" << name << " does not end part " << part;
  document.replace(first, last - first, text);
  expectDocument(name, document);
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SPEC_DOCUMENT_H
