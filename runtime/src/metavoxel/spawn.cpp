#include "spawn.h"

#include <algorithm>
#include <cmath>

#include "billow/format/noise.h"
#include "billow/format/similarity.h"
#include "draw_checks.h"

namespace billow::runtime {
namespace {

float single(double value) {
  return static_cast<float>(value);
}

}  // namespace

struct SpawnPlanner::Run {
  const format::EffectRecord& effect;
  format::Similarity toWorld;
  Vec3d center;  // of the space
  double time;
};

SpawnPlanner::SpawnPlanner(const format::EffectTables* tables) : points_{0} {
  if (tables == nullptr) return;
  tables_.effects = tables->effects;
  tables_.emitters = tables->emitters;
  tables_.spans = tables->spans;
  tables_.given = tables->given;
  tables_.tracks = tables->tracks;
  for (const auto& frame : tables->trackPoints) {
    points_.push_back(points_.back() + static_cast<std::uint32_t>(frame.size()));
  }
}

Result<SpawnPlan> SpawnPlanner::plan(const MetavoxelDraw& draw, const Vec3d& center, std::uint32_t most) const {
  SpawnPlan plan;
  std::uint64_t particles = draw.particles.size();
  for (std::size_t i = 0; i < draw.effects.size(); ++i) {
    const MetavoxelEffect& effect = draw.effects[i];
    const std::string name = "effects[" + std::to_string(i) + "].";
    const auto toWorld = format::similarityOf(effect.objectToWorld);
    if (effect.effect >= tables_.effects.size()) return badArgument(name + "effect");
    if (!std::isfinite(effect.time)) return badArgument(name + "time");
    if (!toWorld) return badArgument(name + "objectToWorld");
    const Run run{tables_.effects[effect.effect], *toWorld, center, effect.time};
    for (const format::Candidates& candidates : format::candidatesAt(tables_, effect.effect, effect.time)) {
      const std::uint64_t first = particles;
      particles += candidates.last - candidates.first;
      if (particles > most) continue;
      plan.jobs.push_back(jobOf(run, candidates));
      plan.jobs.back().numbers.x = static_cast<std::uint32_t>(first);
    }
  }
  if (particles > most) {
    return failure(ErrorCode::argument, "MetavoxelDraw: particles and effects: " + std::to_string(particles) +
                                            " particles may be there, maxParticles is " + std::to_string(most));
  }
  plan.candidates = static_cast<std::uint32_t>(particles - draw.particles.size());
  return plan;
}

gpu::SpawnJob SpawnPlanner::jobOf(const Run& run, const format::Candidates& candidates) const {
  const std::uint32_t number = run.effect.firstEmitter + candidates.emitter;
  const format::EmitterRecord& emitter = tables_.emitters[number];
  const double duration = double{run.effect.duration};
  const double now = run.time - static_cast<double>(candidates.run) * duration;
  gpu::SpawnJob job{};
  job.numbers.y = number;
  job.numbers.w = format::hashInteger(format::hashInteger(run.effect.seed) + candidates.emitter);
  addBirths(run, candidates, now, job);
  job.moments.z = single((format::kCurveSamples - 1) / duration);
  if (emitter.track != format::kNoTrack) addTrack(emitter, now, job);
  const auto& turn = run.toWorld.rotation;
  job.turn = {single(turn[0]), single(turn[1]), single(turn[2]), single(turn[3])};
  const Vec3d at = format::transformed(
      Vec3d{double{emitter.position[0]}, double{emitter.position[1]}, double{emitter.position[2]}}, run.toWorld);
  job.origin = {single(at[0] - run.center[0]), single(at[1] - run.center[1]), single(at[2] - run.center[2]),
                single(run.toWorld.scale)};
  return job;
}

void SpawnPlanner::addBirths(const Run& run, const format::Candidates& candidates, double now,
                             gpu::SpawnJob& job) const {
  const format::EmitterRecord& emitter = tables_.emitters[job.numbers.y];
  if (emitter.givenCount > 0) {
    job.numbers.z = candidates.first;
    const double age = now - double{tables_.given[emitter.firstGiven + candidates.first].time};
    job.times.x = single(age);
    job.times.y = single(age - double{job.times.x});
    return;
  }
  const format::SpawnSpan* spans = &tables_.spans[emitter.firstSpan];
  const format::SpawnSpan& span = spans[candidates.span];
  const std::uint32_t total = spans[emitter.spanCount - 1].first + spans[emitter.spanCount - 1].count;
  const double duration = double{run.effect.duration};
  const double slot = (double{span.end} - double{span.begin}) / span.count;
  const double born = double{span.begin} + slot * candidates.first;
  // With a track, all runs are alike.
  const std::uint32_t cycle = emitter.track == format::kNoTrack ? static_cast<std::uint32_t>(candidates.run) : 0;
  job.numbers.z = cycle * total + span.first + candidates.first;
  job.times = {single(now - born), single(slot), single(born / duration), single(slot / duration)};
}

void SpawnPlanner::addTrack(const format::EmitterRecord& emitter, double now, gpu::SpawnJob& job) const {
  const format::TrackRecord& track = tables_.tracks[emitter.track];
  const double rate = double{track.framesPerSecond};
  // Given particles rest after their last frame.
  const double last = emitter.givenCount > 0 ? track.frameCount - 1.0 : track.frameCount;
  const double frame = std::min(std::floor(now * rate), last);
  const auto pointsOf = [&](double number, std::uint32_t& first, std::uint32_t& count) {
    if (!(number < track.frameCount)) return;
    const std::size_t index = track.firstFrame + static_cast<std::size_t>(number);
    if (index + 1 >= points_.size()) return;
    first = points_[index];
    count = points_[index + 1] - first;
  };
  pointsOf(frame, job.points.x, job.points.y);
  pointsOf(frame + 1, job.points.z, job.points.w);
  job.moments.x = single(now - frame / rate);
  job.moments.y = single((frame + 1) / rate - now);
}

}  // namespace billow::runtime
