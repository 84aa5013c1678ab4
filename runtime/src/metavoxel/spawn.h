// A draw's effects as jobs for the GPU: what depends on the time and on whole spans is computed here in double
// precision, what depends on the particle there.
#ifndef BILLOW_RUNTIME_METAVOXEL_SPAWN_H
#define BILLOW_RUNTIME_METAVOXEL_SPAWN_H

#include <vector>

#include "space.h"

namespace billow::runtime {

struct SpawnPlan {
  std::vector<gpu::SpawnJob> jobs;  // in order of their first particles; none is empty
  std::uint32_t candidates = 0;
};

class SpawnPlanner {
 public:
  // Keeps what it needs of the tables; null: there are no effects.
  explicit SpawnPlanner(const format::EffectTables* tables);

  bool hasEffects() const { return !tables_.effects.empty(); }

  // The draw's effects, their particles behind those of the host. Fails with argument where one is none, lies beyond
  // its range, or all particles together are more than `most`.
  Result<SpawnPlan> plan(const MetavoxelDraw& draw, const Vec3d& center, std::uint32_t most) const;

 private:
  struct Run;
  gpu::SpawnJob jobOf(const Run& run, const format::Candidates& candidates) const;
  void addBirths(const Run& run, const format::Candidates& candidates, double now, gpu::SpawnJob& job) const;
  void addTrack(const format::EmitterRecord& emitter, double now, gpu::SpawnJob& job) const;

  format::EffectTables tables_;  // effects, emitters, spans, given particles and tracks alone
  // Points of all tracks' frames before each frame, and of all.
  std::vector<std::uint32_t> points_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_SPAWN_H
