#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command.h"
#include "extract_effect.h"
#include "import/vdb_write.h"
#include "import_options.h"
#include "pack_lookup.h"
#include "reconstruct.h"

namespace billow::command {
namespace {

using compiler::Error;
using compiler::Fault;

struct Arguments {
  std::string pack, output, volume;
  std::optional<std::int32_t> frame;
  std::uint32_t level = 0;
  std::vector<std::string> grids;
  EffectArguments effect;
};

// A grid's name, without the component's suffix for a part of a vec3 grid.
std::string baseName(const format::Pack& pack, const format::GridRecord& grid) {
  std::string name(pack.string(grid.name));
  if (grid.component != format::kNone && name.size() > 2) name.resize(name.size() - 2);
  return name;
}

bool matches(const format::Pack& pack, const format::GridRecord& grid, const std::string& asked) {
  return asked == pack.string(grid.name) || asked == baseName(pack, grid);
}

void checkAsked(const format::Pack& pack, const format::VolumeRecord& volume, const std::vector<std::string>& asked) {
  const auto grids = pack.gridsOf(volume);
  for (const std::string& name : asked) {
    if (std::any_of(grids.begin(), grids.end(), [&](const auto& grid) { return matches(pack, grid, name); })) continue;
    throw Error(Fault::commandLine,
                fmt::format("--grid {}: no such grid; there is: {}", name, gridNames(pack, volume)));
  }
}

struct Extracted {
  std::string name, base;
  std::uint32_t component;
  bool fogVolume;
  compiler::ImportedGrid grid;
};

// Vec3 grids whose three components are all there become one grid again.
std::vector<compiler::VdbOutput> regroup(const std::vector<Extracted>& grids) {
  std::vector<compiler::VdbOutput> outputs;
  for (const Extracted& grid : grids) {
    std::array<const compiler::ImportedGrid*, 3> parts{};
    for (const Extracted& other : grids) {
      if (other.component != format::kNone && other.base == grid.base) parts[other.component] = &other.grid;
    }
    const bool whole = grid.component != format::kNone && parts[0] && parts[1] && parts[2];
    if (!whole) outputs.push_back({grid.name, grid.fogVolume, {&grid.grid, nullptr, nullptr}});
    if (whole && grid.component == 0) outputs.push_back({grid.base, false, parts});
  }
  return outputs;
}

int extractFrame(const format::Pack& pack, std::int32_t number, const Arguments& arguments) {
  const auto index = findVolume(pack, arguments.volume, arguments.level);
  if (!index) throw Error(Fault::commandLine, index.error());
  const format::VolumeRecord& volume = pack.volumes()[*index];
  const std::ptrdiff_t frame = findFrame(pack, volume, number);
  if (frame < 0) {
    const auto frames = pack.framesOf(volume);
    throw Error(Fault::commandLine, fmt::format("--frame {}: no such frame; there are {} from {} to {}", number,
                                                frames.size(), frames.front().number, frames.back().number));
  }
  checkAsked(pack, volume, arguments.grids);
  std::vector<Extracted> grids;
  for (std::uint32_t g = 0; g < volume.gridCount; ++g) {
    const format::GridRecord& record = pack.gridsOf(volume)[g];
    const format::GridFrame& gridFrame = pack.gridFrame(volume, static_cast<std::uint32_t>(frame), g);
    const auto wanted = [&](const std::string& name) { return matches(pack, record, name); };
    if (!arguments.grids.empty() && std::none_of(arguments.grids.begin(), arguments.grids.end(), wanted)) continue;
    if ((gridFrame.flags & format::kGridPresent) == 0) continue;
    const auto view = format::GridView::load(pack, gridFrame);
    if (!view) return reportIssue(arguments.pack, view.error());
    grids.push_back({std::string(pack.string(record.name)), baseName(pack, record), record.component,
                     record.role == static_cast<std::uint32_t>(format::Role::extinction), reconstruct(*view)});
  }
  if (grids.empty())
    printWarning(fmt::format("frame {} has none of these grids; {} is empty", number, arguments.output));
  compiler::writeVdb(arguments.output, regroup(grids));
  return kDone;
}

int runExtract(const Arguments& arguments) {
  const auto pack = format::Pack::openFile(arguments.pack);
  if (!pack) return reportIssue(arguments.pack, pack.error());
  if (sameFile(arguments.pack, arguments.output)) {
    throw Error(Fault::commandLine, fmt::format("-o {}: that is the pack itself", arguments.output));
  }
  if (!arguments.effect.effect.empty()) {
    extractEffect(*pack, arguments.effect, arguments.output);
    return kDone;
  }
  if (!arguments.frame) throw Error(Fault::commandLine, "--frame of a volume, or --effect, must be given");
  return extractFrame(*pack, *arguments.frame, arguments);
}

}  // namespace

void addExtract(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("extract", "Write one frame, or an effect at one time, as OpenVDB");
  command->add_option("PACK", arguments->pack, "The pack to read")->required()->type_name("PACK");
  CLI::Option* frame =
      command->add_option("--frame", arguments->frame, "A volume's frame, numbered as the source does")->type_name("N");
  CLI::Option* grid = command->add_option("--grid", arguments->grids, "Take only this grid; may be given several times")
                          ->type_name("NAME");
  CLI::Option* volume =
      command->add_option("--volume", arguments->volume, "The volume, where the pack has several")->type_name("NAME");
  CLI::Option* level =
      command
          ->add_option("--level", arguments->level,
                       "A coarser level of the volume instead: 1, of voxels twice as long, or 2, of four times")
          ->check(CLI::Range(0u, format::kMaxLevelLog2))
          ->capture_default_str()
          ->type_name("N");
  CLI::Option* effect =
      command->add_option("--effect", arguments->effect.effect, "An effect instead of a frame, rasterised")
          ->excludes(frame)
          ->excludes(grid)
          ->excludes(volume)
          ->excludes(level)
          ->type_name("NAME");
  command->add_option("--time", arguments->effect.time, "Seconds after the effect's begin")
      ->needs(effect)
      ->check(finiteNumber())
      ->check(CLI::Range(0.0, format::kMaxEffectTime))
      ->type_name("S");
  command->add_option("--voxel-size", arguments->effect.voxelSize, "Edge of a voxel of an effect, in world units")
      ->needs(effect)
      ->check(finiteNumber())
      ->check(CLI::Range(1e-6, 1e6))
      ->type_name("E");
  command->add_option("-o,--output", arguments->output, "The file to write")->required()->type_name("OUT.vdb");
  command->footer(
      "Examples: billow extract fire.blw --frame 12 -o fire_0012.vdb\n"
      "          billow extract smoke.blw --effect 'campfire smoke' --time 2.5 --voxel-size 0.05 -o smoke.vdb");
  command->callback([arguments, &run] { run = [arguments] { return runExtract(*arguments); }; });
}

}  // namespace billow::command
