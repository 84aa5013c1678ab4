// What is asked for one volume, by the command line or by a manifest.
#ifndef BILLOW_COMPILER_IMPORT_VOLUME_REQUEST_H
#define BILLOW_COMPILER_IMPORT_VOLUME_REQUEST_H

#include <optional>
#include <string>
#include <vector>

#include "stages.h"

namespace billow::compiler {

struct GridRequest {
  std::string name;                  // in the pack
  std::string source;                // in the files
  std::optional<format::Role> role;  // else by name
  std::string place = {};            // in the manifest, for messages
};

struct VolumeRequest {
  std::string name;  // "": from the first file's name
  std::vector<std::string> inputs;
  std::vector<GridRequest> grids;  // empty: all that the files have
  ImportOptions options;           // manifest and command line together
  format::LookRecord look{};
};

struct Manifest {
  std::vector<VolumeRequest> volumes;
  std::vector<std::string> effects;  // files
};

// Reads a manifest (spec/manifest.schema.json); files come out relative to the manifest's folder. What the command
// line says (frames, fps, missing) goes before what the manifest says. Throws Error: Fault::file when it cannot be
// read, Fault::input naming the JSON path, the value found and what was expected.
Manifest readManifest(const std::string& path, const ImportOptions& options);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VOLUME_REQUEST_H
