#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "billow/format/text.h"
#include "effect/read.h"
#include "import/input_notes.h"
#include "import/inputs.h"
#include "import/roles.h"
#include "import/vdb_file.h"
#include "import/vdb_read.h"
#include "import/volume_request.h"
#include "stages.h"

namespace billow::compiler {
namespace {

// A name from outside as a pack may hold it: '_' for every byte that is not UTF-8 or is a control character.
std::string cleanName(const std::string& name) {
  std::string clean;
  for (std::size_t at = 0; at < name.size();) {
    std::size_t length = 1;
    while (length < 4 && !format::isUtf8(name.substr(at, length))) ++length;
    const std::string character = name.substr(at, length);
    const bool sound = format::isUtf8(character) && !format::isControl(character[0]);
    clean += sound ? character : "_";
    at += sound ? length : 1;
  }
  return clean;
}

// As cleanName(), with a warning that names `what` where anything is replaced.
std::string packName(const std::string& name, const std::string& what, const Warn& warn) {
  std::string clean = cleanName(name);
  if (clean != name)
    warn(fmt::format("{} has a name with bytes that a pack cannot hold; it becomes '{}'", what, clean));
  return clean;
}

// The grids of all frames of a volume, by name in the files.
class GridUnion {
 public:
  GridUnion(const ImportOptions& options, const Warn& warn) : options_(options), warn_(warn) {}

  void addFrame(const PlannedFrame& frame, const std::vector<GridRequest>& requests) {
    std::map<std::string, std::string> inFrame;  // grid -> file
    for (const std::string& path : frame.files) {
      for (const VdbGrid& grid : listVdbFile(path).grids) {
        if (grid.type == nullptr) {
          skip(path, grid);
        } else if (wanted(grid.name, requests)) {
          add(path, grid, frame.number, inFrame);
        } else {
          others_.insert(grid.name);
        }
      }
    }
  }

  struct Entry {
    const VdbType* type;
    format::SourceType sourceType;
    std::string file;  // where it was first seen
  };
  const std::map<std::string, Entry>& grids() const { return grids_; }
  const std::set<std::string>& others() const { return others_; }
  const std::map<std::string, std::string>& skipped() const { return skipped_; }

 private:
  // A grid is taken when its name, or for a vec3 grid one of its components' names, is asked for.
  bool wanted(const std::string& name, const std::vector<GridRequest>& requests) const {
    const bool listed = requests.empty() || std::any_of(requests.begin(), requests.end(), [&](const GridRequest& r) {
                          return r.source == name || r.source.substr(0, r.source.find_last_of('.')) == name;
                        });
    if (!listed || !requests.empty() || options_.grids.empty()) return listed;
    return std::any_of(options_.grids.begin(), options_.grids.end(), [&](const std::string& asked) {
      const std::string clean = cleanName(name);
      return asked == clean || asked.substr(0, asked.find_last_of('.')) == clean;
    });
  }

  void skip(const std::string& path, const VdbGrid& grid) {
    if (!skipped_.emplace(grid.name, grid.treeType).second) return;
    warn_(fmt::format("{}: grid '{}' is of type {}, which cannot be compiled; it is skipped", path, grid.name,
                      grid.treeType));
  }

  void add(const std::string& path, const VdbGrid& grid, std::int32_t frame,
           std::map<std::string, std::string>& inFrame) {
    checkImportable(path, grid, options_);
    const auto [other, fresh] = inFrame.emplace(grid.name, path);
    if (!fresh) {
      throw Error(Fault::input, fmt::format("{}: frame {}: grid '{}' is also in {}; files of one frame must hold "
                                            "different grids",
                                            path, frame, grid.name, other->second));
    }
    const auto [known, first] = grids_.emplace(grid.name, Entry{grid.type, sourceTypeOf(grid), path});
    if (!first && known->second.type->components != grid.type->components) {
      throw Error(Fault::input, fmt::format("{}: grid '{}' has {} component(s) here and {} in {}", path, grid.name,
                                            grid.type->components, known->second.type->components, known->second.file));
    }
  }

  const ImportOptions& options_;
  const Warn& warn_;
  std::map<std::string, Entry> grids_;
  std::set<std::string> others_;                // there, but not asked for
  std::map<std::string, std::string> skipped_;  // name -> type
};

constexpr const char* kComponentSuffix[3] = {".x", ".y", ".z"};

// Several passes below see the planned grids together with whether the user chose their role.
struct GridList {
  std::vector<PlannedGrid> grids;
  std::vector<bool> fixed;

  void add(const GridRequest& request, const GridUnion::Entry& entry) {
    for (std::uint32_t c = 0; c < entry.type->components; ++c) {
      const bool vector = entry.type->components == 3;
      const std::uint32_t component = vector ? c : format::kNone;
      const format::Role role = request.role.value_or(format::Role::none);
      grids.push_back({request.name + (vector ? kComponentSuffix[c] : ""), request.source, component,
                       componentRole(role, component), entry.sourceType});
      fixed.push_back(request.role.has_value());
    }
  }

  void sortByName() {
    std::vector<std::size_t> order(grids.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return grids[a].name < grids[b].name; });
    GridList sorted;
    for (const std::size_t i : order) {
      sorted.grids.push_back(grids[i]);
      sorted.fixed.push_back(fixed[i]);
    }
    *this = std::move(sorted);
  }
};

std::string namesOf(const GridUnion& found) {
  std::set<std::string> names;
  for (const std::string& name : found.others()) names.insert(cleanName(name));
  for (const auto& [name, entry] : found.grids()) names.insert(cleanName(name));
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

// --grid: a grid's name in the pack, a vec3 grid's name for its three components.
bool selected(const PlannedGrid& grid, const std::vector<std::string>& names) {
  const std::string base = grid.component == format::kNone ? grid.name : grid.name.substr(0, grid.name.size() - 2);
  return names.empty() || std::any_of(names.begin(), names.end(),
                                      [&](const std::string& name) { return name == grid.name || name == base; });
}

void checkNames(const std::vector<PlannedGrid>& grids, const std::string& volume) {
  std::map<format::Role, std::string> roles;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (i > 0 && grids[i].name == grids[i - 1].name) {
      throw Error(Fault::input, fmt::format("volume '{}': two grids are named '{}'; a manifest can rename one", volume,
                                            grids[i].name));
    }
    if (grids[i].role == format::Role::none) continue;
    const auto [other, fresh] = roles.emplace(grids[i].role, grids[i].name);
    if (fresh) continue;
    throw Error(Fault::input, fmt::format("volume '{}': grids '{}' and '{}' have the same role", volume, other->second,
                                          grids[i].name));
  }
}

// "no grids" with what was there instead.
[[noreturn]] void failEmpty(const PlannedVolume& volume, const GridUnion& found) {
  const auto first = std::find_if(volume.frames.begin(), volume.frames.end(),
                                  [](const PlannedFrame& frame) { return !frame.files.empty(); });
  const std::string where = first == volume.frames.end() ? "volume '" + volume.name + "'" : first->files.front();
  std::string text = fmt::format("{}: no grids that can be compiled", where);
  for (const auto& [name, type] : found.skipped()) text += fmt::format("; '{}' is of type {}", name, type);
  throw Error(Fault::input, text);
}

GridList requestedGrids(const VolumeRequest& request, const GridUnion& found, const Warn& warn) {
  GridList list;
  if (request.grids.empty()) {
    for (const auto& [name, entry] : found.grids()) {
      list.add({packName(name, entry.file + ": a grid", warn), name, std::nullopt, ""}, entry);
    }
    return list;
  }
  for (const GridRequest& grid : request.grids) {
    const auto entry = found.grids().find(grid.source);
    if (entry == found.grids().end()) {
      throw Error(Fault::input,
                  fmt::format("{}: no grid '{}' in any frame; there is: {}", grid.place, grid.source, namesOf(found)));
    }
    list.add(grid, entry->second);
  }
  return list;
}

void keepSelected(GridList& list, const std::vector<std::string>& names) {
  GridList kept;
  for (std::size_t i = 0; i < list.grids.size(); ++i) {
    if (!selected(list.grids[i], names)) continue;
    kept.grids.push_back(list.grids[i]);
    kept.fixed.push_back(list.fixed[i]);
  }
  list = std::move(kept);
}

// "smoke" of ".../smoke_0012.vdb"; "type_int32" stays as it is.
std::string volumeName(const std::string& path) {
  const std::string name = std::filesystem::path(path).stem().string();
  const std::size_t digits = name.find_last_not_of("0123456789");
  if (digits == std::string::npos) return "volume";
  const std::size_t end = name.find_last_not_of("_-. ", digits);
  return end == std::string::npos ? "volume" : end == digits ? name : name.substr(0, end + 1);
}

struct Planned {
  PlannedVolume volume;
  std::string offered;  // the grids that there are, for messages
};

Planned planVolume(const VolumeRequest& request, const Warn& warn) {
  const NumberedFiles files = findFiles(request.inputs);
  Planned planned;
  PlannedVolume& volume = planned.volume;
  const std::string& first = files.begin()->second.front();
  volume.name = request.name.empty() ? packName(volumeName(first), first + ": the volume", warn) : request.name;
  volume.look = request.look;
  volume.framesPerSecond = request.options.framesPerSecond.value_or(24);
  volume.levels = request.options.levels.value_or(kDefaultLevels);
  if (!(volume.framesPerSecond >= 0.001 && volume.framesPerSecond <= 1e6)) {
    throw Error(Fault::commandLine,
                fmt::format("{} frames per second; expected 0.001 to 1000000", volume.framesPerSecond));
  }
  volume.frames = selectFrames(files, request.options);
  GridUnion found(request.options, warn);
  for (const PlannedFrame& frame : volume.frames) {
    std::for_each(frame.files.begin(), frame.files.end(), noteInput);
    if ((frame.flags & format::kFrameHeld) == 0) found.addFrame(frame, request.grids);
  }
  if (found.grids().empty() && found.others().empty()) failEmpty(volume, found);
  planned.offered = namesOf(found);
  GridList list = requestedGrids(request, found, warn);
  keepSelected(list, request.options.grids);
  list.sortByName();
  assignRoles(list.grids, list.fixed);
  checkNames(list.grids, volume.name);
  volume.grids = std::move(list.grids);
  return planned;
}

bool isEffect(const std::string& input) {
  return input.ends_with(".effect.json");
}

bool isManifest(const std::string& input) {
  return std::filesystem::path(input).extension() == ".json";
}

Manifest requestsOf(const std::vector<std::string>& inputs, const ImportOptions& options) {
  std::vector<std::string> effects = inputs;
  const auto others = std::stable_partition(effects.begin(), effects.end(), isEffect);
  Manifest requests;
  VolumeRequest request;
  request.options = options;
  request.inputs.assign(others, effects.end());
  effects.erase(others, effects.end());
  if (std::any_of(request.inputs.begin(), request.inputs.end(), isManifest)) {
    if (request.inputs.size() > 1) {
      throw Error(Fault::commandLine, "a manifest must be the only input but for effects");
    }
    requests = readManifest(request.inputs.front(), options);
  } else if (!request.inputs.empty()) {
    requests.volumes.push_back(request);
  }
  requests.effects.insert(requests.effects.end(), effects.begin(), effects.end());
  return requests;
}

std::vector<EffectDescription> planEffects(const std::vector<std::string>& files) {
  std::vector<EffectDescription> effects;
  for (const std::string& file : files) {
    effects.push_back(readEffect(file));
    for (std::size_t i = 0; i + 1 < effects.size(); ++i) {
      if (effects[i].name != effects.back().name) continue;
      throw Error(Fault::input,
                  fmt::format("{}: effect '{}' is also in {}", file, effects.back().name, effects[i].file));
    }
  }
  return effects;
}

// Every --grid must name a grid of some volume.
void checkSelection(const std::vector<Planned>& volumes, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const bool known = std::any_of(volumes.begin(), volumes.end(), [&](const Planned& planned) {
      const auto& grids = planned.volume.grids;
      return std::any_of(grids.begin(), grids.end(), [&](const PlannedGrid& grid) { return selected(grid, {name}); });
    });
    if (known) continue;
    std::vector<std::string> offered;
    offered.reserve(volumes.size());
    for (const Planned& planned : volumes) offered.push_back(planned.offered);
    throw Error(Fault::commandLine,
                fmt::format("--grid {}: no such grid in any frame; there is: {}", name, fmt::join(offered, "; ")));
  }
}

}  // namespace

Plan planInputs(const std::vector<std::string>& inputs, const ImportOptions& options, const Warn& warn) {
  const Manifest requests = requestsOf(inputs, options);
  std::vector<Planned> volumes;
  std::set<std::string> names;
  for (const VolumeRequest& request : requests.volumes) {
    volumes.push_back(planVolume(request, warn));
    if (!names.insert(volumes.back().volume.name).second) {
      throw Error(Fault::input, fmt::format("two volumes are named '{}'", volumes.back().volume.name));
    }
  }
  checkSelection(volumes, options.grids);
  Plan plan;
  plan.effects = planEffects(requests.effects);
  for (Planned& planned : volumes) {
    if (planned.volume.grids.empty()) {
      throw Error(Fault::input, fmt::format("volume '{}': none of the grids asked for is in it; there is: {}",
                                            planned.volume.name, planned.offered));
    }
    plan.volumes.push_back(std::move(planned.volume));
  }
  return plan;
}

void addLevels(Plan& plan) {
  const std::size_t full = plan.volumes.size();
  std::set<std::string> names;
  for (const PlannedVolume& volume : plan.volumes) names.insert(volume.name);
  for (std::size_t v = 0; v < full; ++v) {
    for (std::uint32_t level = 1; level <= plan.volumes[v].levels; ++level) {
      PlannedVolume coarse = plan.volumes[v];
      coarse.name += fmt::format(" 1:{}", 1u << level);
      if (!names.insert(coarse.name).second) {
        throw Error(Fault::input, fmt::format("volume '{}' has the name that a level of '{}' needs; give it another",
                                              coarse.name, plan.volumes[v].name));
      }
      coarse.levels = 0;
      coarse.level = level;
      coarse.full = v;
      plan.volumes.push_back(std::move(coarse));
    }
  }
}

}  // namespace billow::compiler
