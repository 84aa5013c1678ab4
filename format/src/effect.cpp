#include "billow/format/effect.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace billow::format {
namespace {

constexpr double kSlack = 1e-6;  // seconds; far above what rounding may move

// At most so many of a span's particles are born in [from, to].
std::uint64_t bornWithin(const SpawnSpan& span, double from, double to) {
  const double begin = static_cast<double>(span.begin), end = static_cast<double>(span.end);
  const double overlap = std::min(end, to) - std::max(begin, from);
  if (overlap < 0) return 0;
  if (!(end > begin)) return span.count;
  const double share = overlap / (end - begin) * span.count;
  return std::min<std::uint64_t>(span.count, static_cast<std::uint64_t>(share) + 2);
}

// Which of a span's particles may be alive `now` seconds into the run.
std::pair<std::uint32_t, std::uint32_t> candidatesOf(const SpawnSpan& span, double longestLife, double now) {
  const double begin = static_cast<double>(span.begin), length = static_cast<double>(span.end) - begin;
  const double oldest = now - longestLife - begin, youngest = now - begin;
  if (youngest < 0 || oldest > length) return {0, 0};
  if (!(length > 0)) return {0, span.count};
  const auto index = [&](double seconds) {
    return static_cast<std::uint32_t>(std::clamp<double>(seconds / length * span.count, 0, span.count));
  };
  const std::uint32_t first = index(oldest);
  return {first - std::min(first, 1u), std::min(index(youngest) + 1, span.count)};
}

// Which of given particles, which are in order of their births.
std::pair<std::uint32_t, std::uint32_t> candidatesOf(std::span<const GivenParticle> given, double longestLife,
                                                     double now) {
  const auto bornBefore = [](const GivenParticle& one, double time) { return static_cast<double>(one.time) < time; };
  const auto notAfter = [](double time, const GivenParticle& one) { return time < static_cast<double>(one.time); };
  const auto first = std::lower_bound(given.begin(), given.end(), now - longestLife, bornBefore);
  const auto last = std::upper_bound(given.begin(), given.end(), now, notAfter);
  return {static_cast<std::uint32_t>(first - given.begin()), static_cast<std::uint32_t>(last - given.begin())};
}

// The first and last run in which an emitter's particles may be alive.
std::pair<std::int64_t, std::int64_t> runsAt(const EffectRecord& effect, const EmitterRecord& emitter, double time) {
  if ((effect.flags & kEffectLoop) == 0) return {0, 0};
  const double duration = static_cast<double>(effect.duration), life = static_cast<double>(emitter.lifetime[1]);
  const auto first = static_cast<std::int64_t>(std::floor((time - life) / duration)) - 1;
  const bool warm = (effect.flags & kEffectPrewarm) != 0;
  return {warm ? first : std::max<std::int64_t>(first, 0), static_cast<std::int64_t>(std::floor(time / duration))};
}

}  // namespace

std::vector<Candidates> candidatesAt(const EffectTables& tables, std::uint32_t effect, double time) {
  std::vector<Candidates> all;
  if (!(time >= 0 && time <= kMaxEffectTime)) return all;
  const EffectRecord& record = tables.effects[effect];
  for (std::uint32_t e = 0; e < record.emitterCount; ++e) {
    const EmitterRecord& emitter = tables.emitters[record.firstEmitter + e];
    const auto [firstRun, lastRun] = runsAt(record, emitter, time);
    for (std::int64_t run = firstRun; run <= lastRun; ++run) {
      const double now = time - static_cast<double>(run) * static_cast<double>(record.duration);
      for (std::uint32_t s = 0; s < emitter.spanCount; ++s) {
        const auto [first, last] =
            candidatesOf(tables.spans[emitter.firstSpan + s], static_cast<double>(emitter.lifetime[1]), now);
        if (first < last) all.push_back({e, s, run, first, last});
      }
      if (emitter.givenCount == 0) continue;
      const auto given = std::span(tables.given).subspan(emitter.firstGiven, emitter.givenCount);
      const auto [first, last] = candidatesOf(given, static_cast<double>(emitter.lifetime[1]), now);
      if (first < last) all.push_back({e, 0, run, first, last});
    }
  }
  return all;
}

std::uint64_t effectBytes(const EffectTables& tables) {
  const auto bytes = [](const auto& records) { return std::as_bytes(std::span(records)).size(); };
  return bytes(tables.tracks) + bytes(tables.trackFrames) + bytes(tables.trackBytes) + bytes(tables.effects) +
         bytes(tables.emitters) + bytes(tables.spans) + bytes(tables.given) + bytes(tables.materials) +
         bytes(tables.curves) + bytes(tables.ramps) + bytes(tables.maps) + bytes(tables.surfacePoints);
}

float sampleCurve(const CurveRow& row, float x) {
  const float at = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(kCurveSamples - 1);
  const std::size_t index = std::min<std::size_t>(static_cast<std::size_t>(at), kCurveSamples - 2);
  return row.values[index] + (row.values[index + 1] - row.values[index]) * (at - static_cast<float>(index));
}

// The number born within a window changes its slope only where the window's ends meet those of a span, so it is largest
// with the window's end at one of these.
std::uint64_t mostAlive(const EmitterRecord& emitter, std::span<const SpawnSpan> spans, float duration, bool loop) {
  const double life = static_cast<double>(emitter.lifetime[1]), period = static_cast<double>(duration);
  const double runs = loop ? std::floor(life / period) : 0;
  const double window = life - runs * period;
  std::uint64_t total = 0, most = 0;
  const auto count = [&](double end) {
    std::uint64_t born = 0;
    for (const SpawnSpan& span : spans) {
      born += bornWithin(span, end - window - kSlack, end + kSlack);
      if (loop) born += bornWithin(span, end - window - kSlack + period, end + kSlack + period);
    }
    most = std::max(most, born);
  };
  for (const SpawnSpan& span : spans) {
    total += span.count;
    for (const float edge : {span.begin, span.end}) {
      const double at = static_cast<double>(edge);
      count(at);
      count(loop && at + window > period ? at + window - period : at + window);
    }
  }
  return most + total * static_cast<std::uint64_t>(runs);
}

// In a loop, what lives on into later runs is alive beside the particles of these: whole runs count for themselves, and
// the rest of a life is folded back into the run.
std::uint64_t mostAlive(std::span<const GivenParticle> given, float duration, bool loop) {
  const double period = static_cast<double>(duration);
  std::uint64_t always = 0;
  std::vector<double> begins, ends;
  const auto add = [&](double begin, double end) {
    begins.push_back(begin - kSlack);
    ends.push_back(end + kSlack);
  };
  for (const GivenParticle& particle : given) {
    const double time = static_cast<double>(particle.time), life = static_cast<double>(particle.lifetime);
    const double runs = loop ? std::floor(life / period) : 0;
    always += static_cast<std::uint64_t>(runs);
    const double end = time + life - runs * period;
    add(time, end);
    if (loop && end + kSlack >= period) add(time - period, end - period);
  }
  std::sort(begins.begin(), begins.end());
  std::sort(ends.begin(), ends.end());
  std::size_t ended = 0, most = 0;
  for (std::size_t begun = 1; begun <= begins.size(); ++begun) {
    while (ends[ended] < begins[begun - 1]) ++ended;
    most = std::max(most, begun - ended);
  }
  return always + most;
}

std::uint64_t mostAlive(const EffectTables& tables, const EffectRecord& effect, std::uint32_t emitter) {
  const EmitterRecord& record = tables.emitters[effect.firstEmitter + emitter];
  const bool loop = (effect.flags & kEffectLoop) != 0;
  const auto spans = std::span(tables.spans).subspan(record.firstSpan, record.spanCount);
  const auto given = std::span(tables.given).subspan(record.firstGiven, record.givenCount);
  return given.empty() ? mostAlive(record, spans, effect.duration, loop) : mostAlive(given, effect.duration, loop);
}

std::uint64_t mostAlive(const EffectTables& tables, const EffectRecord& effect) {
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < effect.emitterCount; ++i) sum += mostAlive(tables, effect, i);
  return sum;
}

}  // namespace billow::format
