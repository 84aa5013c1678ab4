// Sampled motion: where an emitter's particles are in frames, as Draco point clouds. spec/effects.md is the standard.
#ifndef BILLOW_FORMAT_TRACK_H
#define BILLOW_FORMAT_TRACK_H

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace billow::format {

inline constexpr std::uint32_t kMaxTrackPoints = 1u << 22;      // of all tracks of a pack
inline constexpr std::uint32_t kMaxTrackFrames = 1u << 16;      // of a track
inline constexpr float kMinTrackRate = 1, kMaxTrackRate = 240;  // frames a second
inline constexpr float kMaxTrackRadius = 2;                     // of a point's factor of the radius
inline constexpr std::uint32_t kTrackFrameBytes = 1u << 20;     // of a frame, at most

inline constexpr std::uint32_t kTrackRadii = 1;  // TrackRecord.flags: points have factors of their particle's radius

// One emitter's motion in one run of its effect: frame i of it is i / framesPerSecond seconds after the run's begin.
struct TrackRecord {
  std::uint32_t firstFrame;
  std::uint32_t frameCount;
  float framesPerSecond;
  std::uint32_t flags;
};
static_assert(sizeof(TrackRecord) == 16);

struct TrackFrame {
  std::uint64_t offset;  // into TRPT
  std::uint32_t size;
  std::uint32_t count;  // of points
};
static_assert(sizeof(TrackFrame) == 16);

struct TrackPoint {
  std::uint32_t number;  // of the particle in its run
  float position[3];
};

// Whether any of the tracks has radii. The GPU then holds one for each point of all of them.
bool haveRadii(std::span<const TrackRecord> tracks);

// Decodes a frame into `count` points, in the order in which they are stored, and with `hasRadii` as many radii, else
// none. False where the bytes are not such a frame: nothing about them is trusted, and no more is allocated than
// `count` asks for.
bool decodeTrackFrame(std::span<const std::byte> bytes, std::uint32_t count, bool hasRadii,
                      std::vector<TrackPoint>& points, std::vector<float>& radii);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_TRACK_H
