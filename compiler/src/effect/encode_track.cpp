#include <draco/compression/expert_encode.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "effect/simulate.h"
#include "stages.h"

namespace billow::compiler {
namespace {

constexpr int kMostBits = 24;

// Bits with which steps over `extent` are of at most `step`; more than kMostBits where as many do not suffice.
int bitsFor(double extent, double step) {
  int bits = 1;
  const auto steps = [](int n) { return static_cast<double>((std::uint64_t{1} << n) - 1); };
  while (extent / steps(bits) > step && bits <= kMostBits) ++bits;
  return bits;
}

// The longest side of the box around the points.
double extentOf(const std::vector<format::TrackPoint>& points) {
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
      return a.position[axis] < b.position[axis];
    });
    extent = std::max(extent, static_cast<double>(most->position[axis]) - static_cast<double>(least->position[axis]));
  }
  return extent;
}

double extentOf(std::span<const float> radii) {
  const auto [least, most] = std::minmax_element(radii.begin(), radii.end());
  return static_cast<double>(*most) - static_cast<double>(*least);
}

struct FrameBits {
  int position, radius;
};

std::vector<std::byte> encodeFrame(const std::vector<format::TrackPoint>& points, std::span<const float> radii,
                                   const FrameBits& bits) {
  draco::PointCloudBuilder builder;
  builder.Start(static_cast<std::uint32_t>(points.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int number = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_UINT32);
  const int radius = radii.empty() ? -1 : builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_FLOAT32);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    builder.SetAttributeValueForPoint(position, draco::PointIndex(i), points[i].position);
    builder.SetAttributeValueForPoint(number, draco::PointIndex(i), &points[i].number);
    if (!radii.empty()) builder.SetAttributeValueForPoint(radius, draco::PointIndex(i), &radii[i]);
  }
  const auto cloud = builder.Finalize(/*deduplicate_points=*/false);
  draco::ExpertEncoder encoder(*cloud);
  encoder.SetAttributeQuantization(position, bits.position);
  if (!radii.empty()) encoder.SetAttributeQuantization(radius, bits.radius);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);  // keeps the points' order
  encoder.SetSpeedOptions(0, 0);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) throw Error(Fault::internal, fmt::format("Draco: {}", status.error_msg_string()));
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return {first, first + buffer.size()};
}

// One frame, as it is stored.
std::vector<std::byte> encodeFrame(const TrackSource& source, std::size_t f, const std::string& where) {
  const auto& points = source.points[f];
  const std::span<const float> radii = source.radii.empty() ? std::span<const float>() : source.radii[f];
  // The error is that of a cube's corner.
  const FrameBits bits{bitsFor(extentOf(points), source.error * 2 / std::numbers::sqrt3),
                       radii.empty() ? 0 : bitsFor(extentOf(radii), source.radiusError * 2)};
  if (std::max(bits.position, bits.radius) > kMostBits) {
    throw Error(Fault::input, fmt::format("{}: an error of {} is too small for the distances that its particles go; "
                                          "give a larger one (tracks.error or particles.error)",
                                          where, source.error));
  }
  std::vector<std::byte> bytes = encodeFrame(points, radii, bits);
  if (bytes.size() > format::kTrackFrameBytes) {
    throw Error(Fault::input,
                fmt::format("{}: frame {} of its track takes {} bytes; expected at most {}: give a larger "
                            "error, or fewer particles",
                            where, f, bytes.size(), format::kTrackFrameBytes));
  }
  return bytes;
}

}  // namespace

std::uint32_t addTrack(const TrackSource& source, const std::string& where, format::EffectTables& tables) {
  const bool hasRadii = !source.radii.empty();
  tables.tracks.push_back({static_cast<std::uint32_t>(tables.trackFrames.size()),
                           static_cast<std::uint32_t>(source.points.size()), source.framesPerSecond,
                           hasRadii ? format::kTrackRadii : 0});
  for (std::size_t f = 0; f < source.points.size(); ++f) {
    format::TrackFrame frame{tables.trackBytes.size(), 0, static_cast<std::uint32_t>(source.points[f].size())};
    if (frame.count > 0) {
      const std::vector<std::byte> bytes = encodeFrame(source, f, where);
      frame.size = static_cast<std::uint32_t>(bytes.size());
      tables.trackBytes.insert(tables.trackBytes.end(), bytes.begin(), bytes.end());
    }
    tables.trackFrames.push_back(frame);
    const auto stored = std::span(tables.trackBytes).subspan(frame.offset, frame.size);
    if (!format::decodeTrackFrame(stored, frame.count, hasRadii, tables.trackPoints.emplace_back(),
                                  tables.trackRadii.emplace_back())) {
      throw Error(Fault::internal, fmt::format("{}: Draco does not read what it wrote", where));
    }
  }
  return static_cast<std::uint32_t>(tables.tracks.size() - 1);
}

}  // namespace billow::compiler
