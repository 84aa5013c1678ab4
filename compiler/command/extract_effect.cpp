#include "extract_effect.h"

#include <fmt/format.h>

#include <vector>

#include "effect/rasterise.h"
#include "import/vdb_write.h"
#include "import_options.h"
#include "pack_lookup.h"

namespace billow::command {
namespace {

using compiler::Error;
using compiler::Fault;

}  // namespace

void extractEffect(const format::Pack& pack, const EffectArguments& arguments, const std::string& output) {
  if (!arguments.time || !arguments.voxelSize) {
    throw Error(Fault::commandLine, "--effect needs --time and --voxel-size");
  }
  const auto effect = findEffect(pack, arguments.effect);
  if (!effect) throw Error(Fault::commandLine, "--effect: " + effect.error());
  const auto particles = format::particlesAt(pack.effects(), *effect, *arguments.time);
  const auto grids = compiler::rasterise(pack.effects(), particles, *arguments.voxelSize);
  if (grids.density.leaves.empty()) {
    printWarning(fmt::format("effect '{}' is empty {} s after its begin; {} holds empty grids", arguments.effect,
                             *arguments.time, output));
  }
  const auto& colour = grids.colour;
  const auto& emission = grids.emission;
  const std::vector<compiler::VdbOutput> outputs = {{"density", true, {&grids.density, nullptr, nullptr}},
                                                    {"color", false, {&colour[0], &colour[1], &colour[2]}},
                                                    {"emission", false, {&emission[0], &emission[1], &emission[2]}}};
  compiler::writeVdb(output, outputs);
}

}  // namespace billow::command
