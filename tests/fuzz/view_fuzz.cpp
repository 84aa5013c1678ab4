// Any bytes with their checksums made right, so that the rules behind them are reached: what validates must load, what
// loads must be walked without harm.
#include <cstdlib>

#include "billow/format/grid_view.h"
#include "billow/format/particle_field.h"
#include "billow/format/validate.h"
#include "pack_image.h"

namespace {

using namespace billow::format;

// Touches everything that a reader would.
void walk(const GridView& view) {
  Values values;
  Mask3 active;
  double sum = 0;
  for (const GridView::Leaf& leaf : view.leaves()) {
    decodeBrick(leaf.node, leaf.mask, leaf.brick, view.frame().background, values, active);
    const float corner = view.voxel(leaf.origin[0], leaf.origin[1], leaf.origin[2]);
    if (!(corner == values[0])) std::abort();
    sum += static_cast<double>(values[511]);
  }
  for (const GridView::Tile& tile : view.tiles()) {
    sum += static_cast<double>(view.voxel(tile.origin[0], tile.origin[1], tile.origin[2]));
  }
  if (view.voxel(-1, 0, 0) != view.frame().background) std::abort();
  if (sum != sum) std::abort();  // all values are finite, and the sum of so few is too
}

void walk(const EffectTables& tables) {
  const ParticleField field(tables);
  for (std::uint32_t e = 0; e < tables.effects.size(); ++e) {
    const auto particles = particlesAt(tables, e, 0.5);
    if (particles.size() > kMaxAlive) std::abort();
    if (particles.empty()) continue;
    const auto& center = particles.front().center;
    const float density = field.sample(particles.front(), {center[0], center[1], center[2]}).density;
    if (!(density >= 0 && density <= 1)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  billow::tests::sealAll(bytes);
  bool sound = true;
  ValidateOptions options;
  options.threads = 1;
  validate(*makeMemorySource(bytes), options,
           [&](const Issue& issue) { sound = sound && issue.kind->severity != Severity::error; });
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  if (sound && !pack) std::abort();
  if (!pack) return 0;
  walk(pack->effects());
  for (const GridFrame& frame : pack->gridFrames()) {
    const Result<GridView> view = GridView::load(*pack, frame);
    if (view) walk(*view);
    // A reader's own limits apart, the validator knows everything that loading stops at.
    if (sound && !view && view.error().kind->id >= 100) std::abort();
  }
  return 0;
}
