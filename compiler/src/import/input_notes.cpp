#include "import/input_notes.h"

#include <utility>

namespace billow::compiler {
namespace {

thread_local std::set<std::string>* notes = nullptr;

}  // namespace

InputNotes::InputNotes(std::set<std::string>& into) : before_(std::exchange(notes, &into)) {}

InputNotes::~InputNotes() {
  notes = before_;
}

void noteInput(const std::string& path) {
  if (notes != nullptr) notes->insert(path);
}

}  // namespace billow::compiler
