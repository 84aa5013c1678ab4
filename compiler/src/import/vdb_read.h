// Reading grids with OpenVDB into leaves and tiles.
#ifndef BILLOW_COMPILER_IMPORT_VDB_READ_H
#define BILLOW_COMPILER_IMPORT_VDB_READ_H

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "import/vdb_file.h"
#include "stages.h"

namespace billow::compiler {

// Whether the grid can be placed and read as `options` ask; throws Error(Fault::input) for frustum transforms, and for
// level sets unless they are converted. The grid's type must not be null.
void checkImportable(const std::string& path, const VdbGrid& grid, const ImportOptions& options);

struct ReadContext {
  std::int32_t frame = 0;  // for messages
  const ImportOptions& options;
  const Warn& warn;
};

// One open file. Not thread-safe; several may be open at once.
class VdbReader {
 public:
  // Throws Error.
  explicit VdbReader(const VdbFile& file);
  VdbReader(const VdbReader&) = delete;
  VdbReader& operator=(const VdbReader&) = delete;
  ~VdbReader();

  // Reads a grid whose type is not null and whose structure was checked. Fills `out[c]` for component c, out[0] for a
  // scalar grid; null entries are not wanted. A component that does not fit a float is left absent, with a warning.
  // Throws Error.
  void read(const VdbGrid& grid, const ReadContext& context, const std::array<ImportedGrid*, 3>& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VDB_READ_H
