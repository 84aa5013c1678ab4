#include "effect/particle_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "import/input_notes.h"
#include "import/inputs.h"

namespace billow::compiler {
namespace {

constexpr double kNoTime = 1e-3;  // frames
constexpr double kMost = static_cast<double>(format::kMaxMagnitude);

// The largest float that is not above.
float roundedDown(double value) {
  const float nearest = static_cast<float>(value);
  return static_cast<double>(nearest) <= value ? nearest : std::nextafter(nearest, 0.0f);
}

// What is known of a particle while the frames go by.
struct Way {
  std::int64_t id;
  std::size_t firstFrame, lastFrame;
  float age = 0, life = 0;  // as the first frame has them
  float greatest = 0;       // radius
  std::array<float, 3> colour{1, 1, 1};
};

class Gatherer {
 public:
  explicit Gatherer(const ParticleRequest& request) : request_(request) {}

  void add(const PlannedFrame& planned) {
    what_ = fmt::format("{}: frame {}", planned.files.empty() ? request_.place : planned.files.front(), planned.number);
    if ((planned.flags & format::kFrameHeld) == 0) frame_ = read(planned);
    if ((planned.flags & format::kFrameBlank) == 0) checkAlike(planned);
    given_.points.emplace_back();
    given_.radii.emplace_back();
    const std::vector<std::size_t> order = byId();
    for (const std::size_t i : order) addPoint(i);
    sortByNumber();
    ++frames_;
  }

  GivenParticles finish(double rate) {
    const auto duration = static_cast<double>(request_.duration);
    for (const Way& way : ways_) {
      const double begin = static_cast<double>(way.firstFrame) / rate;
      // A file alone is no motion, but a state that stays.
      double end = frames_ == 1 ? duration : static_cast<double>(way.lastFrame + 1) / rate;
      if (request_.loop) end = std::min(end, duration);
      // Born when the next run begins, but for rounding: so are all after it.
      if (end - begin < kNoTime / rate) break;
      format::GivenParticle particle{};
      particle.time = roundedDown(begin);
      particle.lifetime = roundedDown(end - static_cast<double>(particle.time));
      particle.age = std::max(0.0f, way.age);
      particle.life = way.life > 0 ? std::min(way.life, format::kMaxMagnitude) : particle.age + particle.lifetime;
      particle.radius = has_.radii ? way.greatest : 1;
      std::copy(way.colour.begin(), way.colour.end(), particle.colour);
      particle.id = static_cast<std::uint32_t>(way.id);
      given_.particles.push_back(particle);
    }
    dropUnborn();
    makeShares();
    return std::move(given_);
  }

 private:
  struct Attributes {
    bool ids, radii, ages, lives, colours;
    bool operator==(const Attributes&) const = default;
  };

  [[noreturn]] void fail(const std::string& detail) const {
    throw Error(Fault::input, fmt::format("{}: {}", what_, detail));
  }
  [[noreturn]] void fail(std::size_t i, const std::string& detail) const {
    fail(fmt::format("particle {}{}: {}", i, frame_.ids.empty() ? "" : fmt::format(" (id {})", frame_.ids[i]), detail));
  }

  PointFrame read(const PlannedFrame& planned) {
    PointFrame all;
    for (const std::string& file : planned.files) {
      const auto left = static_cast<std::uint32_t>(format::kMaxAlive - all.places.size());
      PointFrame one = readPoints(file, planned.number, request_.attributes, left);
      const auto append = [](auto& into, const auto& from) { into.insert(into.end(), from.begin(), from.end()); };
      all.ordered = one.ordered;
      append(all.places, one.places);
      append(all.ids, one.ids);
      append(all.radii, one.radii);
      append(all.ages, one.ages);
      append(all.lives, one.lives);
      append(all.colours, one.colours);
      given_.files.push_back(file);
      noteInput(file);
    }
    return all;
  }

  // Every frame with particles has the attributes of the first such one, as many as these.
  void checkAlike(const PlannedFrame& planned) {
    const std::size_t count = frame_.places.size();
    const auto whole = [&](const auto& values) { return values.empty() || values.size() == count; };
    if (!whole(frame_.ids) || !whole(frame_.radii) || !whole(frame_.ages) || !whole(frame_.lives) ||
        !whole(frame_.colours)) {
      fail("its files do not have the same attributes");
    }
    if (count == 0) {
      if (!known_ || has_.ids) return;
    } else {
      const Attributes has{!frame_.ids.empty(), !frame_.radii.empty(), !frame_.ages.empty(), !frame_.lives.empty(),
                           !frame_.colours.empty()};
      if (known_ && !(has == has_)) {
        fail(fmt::format("its attributes are others than those of frame {} (id, radius, age, life or colour)",
                         knownFrame_));
      }
      if (!known_) {
        has_ = has;
        knownFrame_ = planned.number;
        knownCount_ = count;
      }
      known_ = true;
    }
    checkOrder(count);
  }

  // Without ids, the order must tell who is who.
  void checkOrder(std::size_t count) const {
    if (has_.ids || (frames_ == 0 && count == knownCount_)) return;
    if (!frame_.ordered) {
      fail("its points have no ids, and OpenVDB keeps them in no order; export an attribute 'id'");
    }
    if (count == knownCount_) return;
    fail(
        fmt::format("{} particles, and {} in frame {}: without ids nobody knows which are the same; export an "
                    "attribute 'id'",
                    count, knownCount_, knownFrame_));
  }

  std::int64_t idOfPoint(std::size_t i) const {
    return frame_.ids.empty() ? static_cast<std::int64_t>(i) : frame_.ids[i];
  }

  std::vector<std::size_t> byId() {
    std::vector<std::size_t> order(frame_.places.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return std::pair(idOfPoint(a), a) < std::pair(idOfPoint(b), b); });
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (idOfPoint(order[i]) == idOfPoint(order[i - 1])) {
        fail(order[i], fmt::format("particle {} has the same id", order[i - 1]));
      }
    }
    return order;
  }

  // A value of the i-th particle times the scale.
  float scaled(std::size_t i, float value, const char* name, double least) const {
    const double result = static_cast<double>(value) * request_.scale;
    if (result >= least && result <= kMost) return static_cast<float>(result);
    fail(i, fmt::format("its {} is {}; expected {} to {} with the scale", name, value, least, kMost));
  }

  float finite(std::size_t i, float value, const char* name) const {
    if (!std::isnan(value)) return value;
    fail(i, fmt::format("its {} is not a number", name));
  }

  Way& wayOf(std::size_t i) {
    const auto [known, fresh] = current_.emplace(idOfPoint(i), ways_.size());
    if (!fresh && ways_[known->second].lastFrame + 1 == frames_) return ways_[known->second];
    if (ways_.size() == format::kMaxCycleParticles) {
      fail(fmt::format("more than {} particles come and go in the frames so far; expected at most that many",
                       format::kMaxCycleParticles));
    }
    known->second = ways_.size();
    Way way{idOfPoint(i), frames_, frames_};
    if (has_.ages) way.age = std::min(finite(i, frame_.ages[i], "age"), format::kMaxMagnitude);
    if (has_.lives) way.life = finite(i, frame_.lives[i], "life");
    for (std::size_t c = 0; has_.colours && c < 3; ++c) {
      way.colour[c] = std::clamp(finite(i, frame_.colours[i][c], "colour"), 0.0f, 1.0f);
    }
    ways_.push_back(way);
    return ways_.back();
  }

  void addPoint(std::size_t i) {
    Way& way = wayOf(i);
    if (++count_ > format::kMaxTrackPoints) {
      fail(
          fmt::format("{} points of particles in the frames so far; expected at most {}: take fewer frames "
                      "(particles.frames) or particles",
                      count_, format::kMaxTrackPoints));
    }
    format::TrackPoint point{static_cast<std::uint32_t>(&way - ways_.data()), {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point.position[axis] = scaled(i, frame_.places[i][axis], "place", -kMost);
    }
    given_.points.back().push_back(point);
    way.lastFrame = frames_;
    if (!has_.radii) return;
    const float radius = scaled(i, frame_.radii[i], "radius", 0);
    given_.radii.back().push_back(radius);
    way.greatest = std::max(way.greatest, radius);
  }

  // Ids are in order; numbers, which come from births, are not.
  void sortByNumber() {
    auto& points = given_.points.back();
    auto& radii = given_.radii.back();
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return points[a].number < points[b].number; });
    std::vector<format::TrackPoint> sortedPoints;
    std::vector<float> sortedRadii;
    for (const std::size_t i : order) {
      sortedPoints.push_back(points[i]);
      if (has_.radii) sortedRadii.push_back(radii[i]);
    }
    points = std::move(sortedPoints);
    radii = std::move(sortedRadii);
  }

  // Points of particles that were left out, which are in the last frame alone.
  void dropUnborn() {
    auto& points = given_.points.back();
    while (!points.empty() && points.back().number >= given_.particles.size()) points.pop_back();
    if (has_.radii) given_.radii.back().resize(points.size());
  }

  // Radii become shares of their particle's greatest.
  void makeShares() {
    for (std::size_t f = 0; f < given_.radii.size(); ++f) {
      for (std::size_t i = 0; i < given_.radii[f].size(); ++i) {
        const float greatest = given_.particles[given_.points[f][i].number].radius;
        given_.radii[f][i] = greatest > 0 ? given_.radii[f][i] / greatest : 1;
      }
    }
    if (!has_.radii) given_.radii.clear();
  }

  const ParticleRequest& request_;
  std::string what_;  // file and frame
  PointFrame frame_;
  std::size_t frames_ = 0;  // that are done
  std::uint64_t count_ = 0;
  bool known_ = false;
  Attributes has_{};
  std::int32_t knownFrame_ = 0;
  std::size_t knownCount_ = 0;
  std::vector<Way> ways_;                                  // by number
  std::unordered_map<std::int64_t, std::size_t> current_;  // id -> its latest way
  GivenParticles given_;
};

void checkTimes(const ParticleRequest& request, const std::vector<PlannedFrame>& frames, double rate) {
  const double end = static_cast<double>(frames.size() - 1) / rate;
  if (frames.size() > format::kMaxTrackFrames) {
    throw Error(Fault::input, fmt::format("{}: {} frames; expected at most {}", request.place, frames.size(),
                                          format::kMaxTrackFrames));
  }
  if (end <= static_cast<double>(request.duration)) return;
  throw Error(Fault::input,
              fmt::format("{}: frames {} to {} last {} s; expected at most the effect's duration, {} s", request.place,
                          frames.front().number, frames.back().number, end, request.duration));
}

}  // namespace

GivenParticles gatherParticles(const ParticleRequest& request) {
  const auto frames = selectFrames(findFiles(request.inputs), request.options);
  // As the track will have it.
  const auto rate =
      static_cast<double>(static_cast<float>(request.options.framesPerSecond.value_or(24) / request.options.frameStep));
  if (!(rate >= static_cast<double>(format::kMinTrackRate))) {
    throw Error(Fault::input, fmt::format("{}: every {}th of {} frames a second are {} a second; expected at least {}",
                                          request.place, request.options.frameStep,
                                          request.options.framesPerSecond.value_or(24), rate, format::kMinTrackRate));
  }
  checkTimes(request, frames, rate);
  Gatherer gatherer(request);
  for (const PlannedFrame& frame : frames) gatherer.add(frame);
  GivenParticles given = gatherer.finish(rate);
  given.framesPerSecond = static_cast<float>(rate);
  if (given.particles.empty()) {
    throw Error(Fault::input, fmt::format("{}: no particle in any frame", request.place));
  }
  for (const format::GivenParticle& particle : given.particles) {
    if (particle.lifetime <= format::kMaxLifetime) continue;
    throw Error(Fault::input, fmt::format("{}: a particle (id {}) lives {} s; expected at most {}", request.place,
                                          particle.id, particle.lifetime, format::kMaxLifetime));
  }
  return given;
}

double greatestRadius(const EmitterDescription& emitter) {
  double greatest = emitter.given ? 0 : 1;
  if (emitter.given) {
    for (const auto& particle : emitter.given->particles) {
      greatest = std::max(greatest, static_cast<double>(particle.radius));
    }
  }
  return greatest * static_cast<double>(emitter.record.radius[1]);
}

void settleRadii(EmitterDescription& emitter) {
  GivenParticles& given = *emitter.given;
  std::vector<float> least(given.particles.size(), 1);
  for (std::size_t f = 0; f < given.radii.size(); ++f) {
    for (std::size_t i = 0; i < given.radii[f].size(); ++i) {
      float& known = least[given.points[f][i].number];
      known = std::min(known, given.radii[f][i]);
    }
  }
  for (std::size_t n = 0; n < least.size(); ++n) {
    const double greatest = static_cast<double>(given.particles[n].radius * emitter.record.radius[1]);
    if ((1 - static_cast<double>(least[n])) * greatest > emitter.trackError) return;
  }
  given.radii.clear();
}

}  // namespace billow::compiler
