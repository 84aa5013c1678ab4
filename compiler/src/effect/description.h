// What an effect's description says (spec/effects.md); read.h reads it.
#ifndef BILLOW_COMPILER_EFFECT_DESCRIPTION_H
#define BILLOW_COMPILER_EFFECT_DESCRIPTION_H

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "billow/format/effect.h"
#include "effect/image.h"
#include "mesh/mesh.h"

namespace billow::compiler {

// Keys of a curve, linear between them, constant before the first and after the last. A number is [0] of a value.
struct Keys {
  std::vector<double> times;  // strictly ascending
  std::vector<std::array<double, 3>> values;

  bool empty() const { return times.empty(); }
  std::array<double, 3> at(double time) const;
  // Of the first component, from the first key's time to `time`, which is not before it.
  double integral(double time) const;
};

struct RampRow {
  double age;   // in [0, 1]
  Keys colour;  // over the radius
};

enum class NoiseKind { fbm, ridged, worley };

struct NoiseMap {
  NoiseKind kind = NoiseKind::fbm;
  std::uint32_t octaves = 4;
  double frequency = 2;  // periods along the unit sphere's radius
  std::uint32_t seed = 0;
  std::uint32_t frames = 1;  // that follow one another in a circle
  bool operator==(const NoiseMap&) const = default;
};

// What shines: products of curves, which are no curves of straight lines.
struct Emission {
  Keys colour, strength, temperature;  // the last empty: no black body

  bool constant() const {
    return colour.times.size() <= 1 && strength.times.size() <= 1 && temperature.times.size() <= 1;
  }
  std::array<double, 3> at(double time) const;
};

// A wind in whirls, which drag passes on.
struct CurlNoise {
  double speed;      // world units a second, typical
  double frequency;  // periods a world unit
  std::uint32_t seed;
};

struct Attractor {
  std::array<double, 3> position;
  double strength;  // acceleration at the distance `radius`, doubled
  double radius;    // where it is greatest
};

// A surface on which particles are born.
struct MeshShape {
  TriangleList triangles;
  std::array<double, 3> scale{1, 1, 1};
};

// Where particles are, by frame, in ascending numbers.
using TrackPoints = std::vector<std::vector<format::TrackPoint>>;

// Particles from files.
struct GivenParticles {
  std::vector<format::GivenParticle> particles;  // by number
  TrackPoints points;
  std::vector<std::vector<float>> radii;  // of the points, as shares of their particle's; empty: all are 1
  float framesPerSecond = 24;
  std::vector<std::string> files;
};

struct EmitterDescription {
  std::string name;
  format::EmitterRecord record{};  // its numbers; what refers to tables comes with the tables
  std::vector<format::SpawnSpan> spans;
  std::optional<GivenParticles> given;  // instead of spans
  // Over the effect's time (position) or a particle's life; empty: none.
  Keys position, radius, opacity, diffuse, rotation, displacement;
  std::optional<Emission> emission;     // where it is not constant
  format::ParticleMaterial material{};  // likewise
  Keys profile;
  std::vector<RampRow> diffuseRamp, emissionRamp;
  std::optional<MeshShape> mesh;  // the shape
  std::optional<NoiseMap> map;
  std::optional<CurlNoise> curlNoise;
  std::optional<Attractor> attractor;
  float trackRate = 30;          // frames a second, where there is one of these two
  double trackError = 0;         // world units
  std::optional<Image> picture;  // of the displacement, instead of noise: longitude and latitude
};

inline bool needsTrack(const EmitterDescription& emitter) {
  return emitter.curlNoise || emitter.attractor;
}

struct EffectDescription {
  std::string file;
  std::string name;
  std::uint32_t seed = 0;
  float duration = 1;
  std::uint32_t flags = 0;  // format::kEffectLoop, kEffectPrewarm
  std::vector<EmitterDescription> emitters;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_DESCRIPTION_H
