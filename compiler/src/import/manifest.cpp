#include <filesystem>
#include <set>

#include "import/frame_choice.h"
#include "import/input_notes.h"
#include "import/roles.h"
#include "import/volume_request.h"
#include "json/document.h"
#include "json/look.h"

namespace billow::compiler {
namespace {

using json::Value;

GridRequest readGrid(const Value& node) {
  node.requireKeys({"name", "source", "role"});
  GridRequest grid;
  grid.place = node.place();
  grid.name = node.at("name").name("a grid's name");
  const auto source = node.find("source");
  grid.source = source ? source->text("a grid's name in the files") : grid.name;
  const auto role = node.find("role");
  if (!role) return grid;
  const std::string expected = "one of " + roleWords();
  grid.role = roleByWord(role->text(expected));
  if (!grid.role) role->fail(expected);
  return grid;
}

std::vector<GridRequest> readGrids(const Value& node) {
  std::vector<GridRequest> grids;
  std::set<std::string> names, sources;
  for (const Value& item : node.items("a list of grids")) {
    grids.push_back(readGrid(item));
    if (!names.insert(grids.back().name).second) item.at("name").fail("a name that no other grid has");
    if (!sources.insert(grids.back().source).second) item.fail("a source that no other grid has");
  }
  return grids;
}

VolumeRequest readVolume(const Value& node, const std::filesystem::path& folder, const ImportOptions& options) {
  node.requireKeys({"name", "inputs", "grids", "fps", "frames", "missing", "levels", "look"});
  VolumeRequest volume;
  volume.options = options;
  volume.name = node.at("name").name("a volume's name");
  for (const Value& input : node.at("inputs").items("a list of files, directories or patterns")) {
    volume.inputs.push_back((folder / input.text("a file, a directory or a pattern")).string());
  }
  if (const auto grids = node.find("grids")) volume.grids = readGrids(*grids);
  if (const auto fps = node.find("fps")) {
    const float rate = fps->single({0.001, 1e6});
    if (!options.framesPerSecond) volume.options.framesPerSecond = static_cast<double>(rate);
  }
  if (const auto frames = node.find("frames")) readFrames(*frames, volume.options);
  if (const auto missing = node.find("missing")) readMissing(*missing, volume.options);
  if (const auto levels = node.find("levels")) {
    const auto count = static_cast<std::uint32_t>(levels->integer(0, kMaxLevels));
    if (!options.levels) volume.options.levels = count;
  }
  if (const auto look = node.find("look")) volume.look = json::readLook(*look);
  return volume;
}

std::vector<VolumeRequest> readVolumes(const Value& list, const std::filesystem::path& folder,
                                       const ImportOptions& options) {
  std::vector<VolumeRequest> volumes;
  std::set<std::string> names;
  for (const Value& item : list.items("a list of volumes")) {
    volumes.push_back(readVolume(item, folder, options));
    if (!names.insert(volumes.back().name).second) item.at("name").fail("a name that no other volume has");
  }
  return volumes;
}

Manifest readRoot(const Value& root, const std::filesystem::path& folder, const ImportOptions& options) {
  root.requireKeys({"$schema", "volumes", "effects"});
  Manifest manifest;
  const auto volumes = root.find("volumes"), effects = root.find("effects");
  if (!volumes && !effects) root.fail("an object with \"volumes\", \"effects\" or both");
  if (volumes) manifest.volumes = readVolumes(*volumes, folder, options);
  if (!effects) return manifest;
  for (const Value& file : effects->items("a list of *.effect.json files")) {
    manifest.effects.push_back((folder / file.text("a *.effect.json file")).string());
  }
  return manifest;
}

}  // namespace

Manifest readManifest(const std::string& path, const ImportOptions& options) {
  try {
    noteInput(path);
    const json::Document document(path);
    return readRoot(document.root(), std::filesystem::path(path).parent_path(), options);
  } catch (const json::FileError& error) {
    throw Error(Fault::file, error.what());
  } catch (const json::Error& error) {
    throw Error(Fault::input, error.what());
  }
}

}  // namespace billow::compiler
