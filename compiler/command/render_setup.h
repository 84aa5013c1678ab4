// Camera, sun, background and look for a volume: what was asked for, and a good picture where nothing was.
#ifndef BILLOW_COMMAND_RENDER_SETUP_H
#define BILLOW_COMMAND_RENDER_SETUP_H

#include "billow/format/pack.h"
#include "billow/runtime/look.h"
#include "billow/runtime/runtime.h"
#include "render_request.h"

namespace billow::command {

// The axis along which the gas rises from the first to the last frame: 'z' unless y is clearly more so.
char risingAxis(const format::Pack& pack, const format::VolumeRecord& volume, const runtime::GridChoice& grids);

// What is to be seen.
struct Stage {
  runtime::WorldBox box;
  char up;            // where the request does not say
  bool burning;       // it gives light itself
  bool ambientGiven;  // by the pack
};

// How far from the box's centre the eye must be for the box to lie in a picture of width over height `aspect`. Gas
// hardly reaches into the very corners, so that they may touch the frame while edges and faces keep a margin.
double fittingDistance(const runtime::WorldBox& box, const std::array<double, 3>& center, const runtime::View& view,
                       double aspect);

// The sun that a request asks for, or one that suits what is to be seen.
struct SunChoice {
  Triple direction, color;
  float intensity;
};
SunChoice sunOf(const RenderRequest& request, char up, bool burning);

// Everything of a DrawInfo but the frame. `opaque` asks for a background that fills the picture. Its look is the
// suggested one with what the request says, and how everything in the picture scatters.
runtime::DrawInfo setUp(const RenderRequest& request, const Stage& stage, const runtime::Look& suggested, bool opaque);

// How one of the request's volumes looks. `scale` is how much longer its lengths are in the scene: it keeps its look
// when it grows.
runtime::Look lookOf(const RenderRequest& request, const VolumeRequest& volume, const runtime::Look& suggested,
                     double scale);

// A volume's; [first, last] are frame indices.
Stage stageOf(const format::Pack& pack, const format::VolumeRecord& volume, const runtime::GridChoice& grids,
              const runtime::Look& suggested, std::uint32_t first, std::uint32_t last);

// The same for a volume. [first, last] are frame indices that the camera must frame.
runtime::DrawInfo setUp(const RenderRequest& request, const format::Pack& pack, const format::VolumeRecord& volume,
                        const runtime::GridChoice& grids, const runtime::Look& suggested, std::uint32_t first,
                        std::uint32_t last, bool opaque);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_SETUP_H
