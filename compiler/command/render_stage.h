// What is to be seen of a request's contents, for pictures and for the viewer.
#ifndef BILLOW_COMMAND_RENDER_STAGE_H
#define BILLOW_COMMAND_RENDER_STAGE_H

#include <span>

#include "render_contents.h"
#include "render_metavoxel.h"
#include "render_setup.h"

namespace billow::command {

inline constexpr std::uint64_t kMostParticles = 1048576;  // of a draw

// The axis of the scene along which the gas of the first volume rises, or the particles.
char upOf(const Contents& contents);

// The camera frames all of the volumes' sequences, so that a frame alone and within a range are the same picture; of
// effects, what is alive at these times of the scene. `needs` is what a space has to hold for them. Refuses more
// particles than a draw takes.
Checked<Stage> stageOf(const Contents& contents, std::span<const double> times, SpaceNeeds& needs);

// The look that a request's is laid over: the first volume's.
runtime::Look suggestedLook(const Contents& contents);

// How layers of the volume look and where they are, in a draw where all matter scatters as `shared` says.
runtime::MetavoxelVolume placed(const RenderRequest& request, const PlacedVolume& volume,
                                std::span<const runtime::Layer> layers, const runtime::Look& shared);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_STAGE_H
