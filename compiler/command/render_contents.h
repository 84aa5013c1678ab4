// What a request draws: its packs opened, and volumes, grids and effects found in them.
#ifndef BILLOW_COMMAND_RENDER_CONTENTS_H
#define BILLOW_COMMAND_RENDER_CONTENTS_H

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "billow/format/gather_effects.h"
#include "billow/format/pack.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"
#include "render_request.h"

namespace billow::command {

// What is alive at one moment.
using Particles = std::vector<format::Particle>;
using Effects = std::vector<runtime::MetavoxelEffect>;

// What a volume shows of one of its frames.
struct FrameShare {
  std::uint32_t frame;  // an index
  float weight = 1;
  float advect = 0;  // seconds
};

struct PlacedVolume {
  const VolumeRequest* request;
  const format::Pack* pack;
  std::uint32_t number;  // of the pack's volumes
  runtime::GridChoice grids;
  runtime::Look suggested;
  std::optional<std::uint32_t> still;  // the only frame to show, an index

  const format::VolumeRecord& record() const { return pack->volumes()[number]; }
  // How much longer its lengths are in the scene.
  double scale() const;
  // The frames that show at a time of the scene: none, one or two.
  std::vector<FrameShare> framesAt(double seconds, runtime::Interpolation interpolation) const;
  // Of all frames that may show.
  runtime::WorldBox box() const;
};

struct PlacedEffect {
  const EffectRequest* request;
  std::uint32_t number;  // of Contents::tables()
};

// The smallest voxels of some grids: their edge, world units (0 where there is no grid), and the centre of one.
struct VoxelLattice {
  double edge = 0;
  std::array<double, 3> anchor{};
};

class Contents {
 public:
  // The request must outlive it. Refuses what cannot be read, is not in its pack, or cannot be where it is put.
  static Checked<Contents> find(const RenderRequest& request);

  const std::vector<PlacedVolume>& volumes() const { return volumes_; }
  const std::vector<PlacedEffect>& effects() const { return effects_; }
  // Of all effects together.
  const format::EffectTables& tables() const { return gathered_.tables(); }
  // Paths of the packs.
  std::vector<std::string> files() const;

  // At a time of the scene, which the GPU evaluates.
  Effects effectsAt(double seconds) const;
  // What is alive of them: for what must be known before a picture is drawn.
  Particles particlesAt(double seconds) const;
  // How many a draw of them may have.
  std::uint64_t mostParticles(double seconds) const;
  // Over all frames of all volumes.
  VoxelLattice finestVoxels() const;

 private:
  Checked<const format::Pack*> open(const std::string& file, const std::string& place);
  Checked<void> addVolume(const VolumeRequest& request, runtime::Interpolation interpolation);
  Checked<void> addEffect(const EffectRequest& request);

  std::map<std::string, std::unique_ptr<format::Pack>> packs_;
  std::vector<PlacedVolume> volumes_;
  std::vector<PlacedEffect> effects_;
  format::GatheredEffects gathered_;
};

// What is wrong with a pack's bytes, as the command says it.
Refusal toRefusal(const format::Issue& issue, const std::string& pack);
// Runtime errors as the command's: what is wrong with the pack is the pack's fault, all else the GPU's.
Refusal toRefusal(const runtime::Error& error, const std::string& pack);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_CONTENTS_H
