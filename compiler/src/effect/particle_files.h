// Particles from files instead of spans: each id's way through the frames.
#ifndef BILLOW_COMPILER_EFFECT_PARTICLE_FILES_H
#define BILLOW_COMPILER_EFFECT_PARTICLE_FILES_H

#include <string>
#include <vector>

#include "effect/description.h"
#include "import/points.h"
#include "stages.h"

namespace billow::compiler {

struct ParticleRequest {
  std::vector<std::string> inputs;  // as those of a volume
  ImportOptions options;            // frames, missing, framesPerSecond
  PointAttributes attributes;
  double scale = 1;    // of places and radii
  float duration = 0;  // of the effect
  bool loop = false;
  std::string place;  // in the description, for messages
};

// Reads the files and follows the ids. A particle is an id from the frame in which it appears to the one in which it is
// last seen, and one frame more, in a loop no longer than the run; one that comes back is another particle with the
// same random numbers. Throws Error: Fault::file where a file cannot be read; Fault::input naming file, frame and
// particle where a value is not finite or an id is there twice, and the number and the limit where there are too many.
GivenParticles gatherParticles(const ParticleRequest& request);

// The greatest radius of an emitter's particles, given ones or not, before curves.
double greatestRadius(const EmitterDescription& emitter);

// Drops the points' radii where no particle's changes by more than the track's error.
void settleRadii(EmitterDescription& emitter);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_PARTICLE_FILES_H
