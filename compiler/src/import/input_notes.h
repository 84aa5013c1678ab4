// What a plan was made from, for build systems: each file that was read, and each folder that was searched.
#ifndef BILLOW_COMPILER_IMPORT_INPUT_NOTES_H
#define BILLOW_COMPILER_IMPORT_INPUT_NOTES_H

#include <set>
#include <string>

namespace billow::compiler {

// While it lives, noteInput() on its thread adds to `into`. Planning reads files on one thread, in many places.
class InputNotes {
 public:
  explicit InputNotes(std::set<std::string>& into);
  ~InputNotes();
  InputNotes(const InputNotes&) = delete;
  InputNotes& operator=(const InputNotes&) = delete;

 private:
  std::set<std::string>* before_;
};

// Without notes nothing happens.
void noteInput(const std::string& path);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_INPUT_NOTES_H
