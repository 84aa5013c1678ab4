#include <fmt/format.h>

#include <algorithm>

#include "import/vdb_file.h"
#include "import/vdb_read.h"
#include "stages.h"

namespace billow::compiler {
namespace {

struct Outputs {
  std::array<ImportedGrid*, 3> components{};
  bool any = false;
};

// Where the planned grids that come from `source` go.
Outputs outputsOf(const PlannedVolume& volume, const std::string& source, ImportedFrame& frame) {
  Outputs outputs;
  for (std::size_t i = 0; i < volume.grids.size(); ++i) {
    const PlannedGrid& planned = volume.grids[i];
    if (planned.source != source) continue;
    outputs.components[planned.component == format::kNone ? 0 : planned.component] = &frame.grids[i];
    outputs.any = true;
  }
  return outputs;
}

// Reads the planned grids of one file; false when it has none of them.
bool importFile(const std::string& path, const PlannedVolume& volume, const ReadContext& context,
                ImportedFrame& frame) {
  const VdbFile file = listVdbFile(path);
  std::unique_ptr<VdbReader> reader;
  for (const VdbGrid& grid : file.grids) {
    const Outputs outputs = outputsOf(volume, grid.name, frame);
    if (grid.type == nullptr || !outputs.any) continue;
    checkImportable(path, grid, context.options);
    checkVdbGrid(file, grid);
    if (!reader) reader = std::make_unique<VdbReader>(file);
    reader->read(grid, context, outputs.components);
  }
  return reader != nullptr;
}

}  // namespace

ImportedFrame importFrame(const PlannedVolume& volume, const PlannedFrame& frame, const ImportOptions& options,
                          const Warn& warn) {
  ImportedFrame imported;
  imported.grids.resize(volume.grids.size());
  const ReadContext context{frame.number, options, warn};
  bool found = false;
  for (const std::string& path : frame.files) found |= importFile(path, volume, context, imported);
  const bool kept = std::any_of(imported.grids.begin(), imported.grids.end(), [](const auto& g) { return g.present; });
  if (found && !kept) {
    throw Error(Fault::input, fmt::format("{}: frame {}: no grids are left, for none of them fits single precision",
                                          frame.files.front(), frame.number));
  }
  return imported;
}

}  // namespace billow::compiler
