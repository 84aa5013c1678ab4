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

// Bits of a coordinate with which the cube around the points has steps of at most 2 / sqrt(3) of the error.
int bitsFor(const std::vector<format::TrackPoint>& points, double error) {
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
      return a.position[axis] < b.position[axis];
    });
    extent = std::max(extent, static_cast<double>(most->position[axis]) - static_cast<double>(least->position[axis]));
  }
  int bits = 1;
  const auto steps = [](int n) { return static_cast<double>((std::uint64_t{1} << n) - 1); };
  while (extent / steps(bits) > error * 2 / std::numbers::sqrt3 && bits <= kMostBits) ++bits;
  return bits;
}

std::vector<std::byte> encodeFrame(const std::vector<format::TrackPoint>& points, int bits) {
  draco::PointCloudBuilder builder;
  builder.Start(static_cast<std::uint32_t>(points.size()));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int number = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_UINT32);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    builder.SetAttributeValueForPoint(position, draco::PointIndex(i), points[i].position);
    builder.SetAttributeValueForPoint(number, draco::PointIndex(i), &points[i].number);
  }
  const auto cloud = builder.Finalize(/*deduplicate_points=*/false);
  draco::ExpertEncoder encoder(*cloud);
  encoder.SetAttributeQuantization(position, bits);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);  // keeps the points' order
  encoder.SetSpeedOptions(0, 0);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) throw Error(Fault::internal, fmt::format("Draco: {}", status.error_msg_string()));
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return {first, first + buffer.size()};
}

}  // namespace

std::uint32_t addTrack(const TrackPoints& frames, float framesPerSecond, double error, const std::string& where,
                       format::EffectTables& tables) {
  tables.tracks.push_back({static_cast<std::uint32_t>(tables.trackFrames.size()),
                           static_cast<std::uint32_t>(frames.size()), framesPerSecond, 0});
  for (const auto& points : frames) {
    format::TrackFrame frame{tables.trackBytes.size(), 0, static_cast<std::uint32_t>(points.size())};
    if (!points.empty()) {
      const int bits = bitsFor(points, error);
      if (bits > kMostBits) {
        throw Error(Fault::input,
                    fmt::format("{}: an error of {} is too small for the distances that its particles go; give a "
                                "larger tracks.error",
                                where, error));
      }
      const std::vector<std::byte> bytes = encodeFrame(points, bits);
      frame.size = static_cast<std::uint32_t>(bytes.size());
      tables.trackBytes.insert(tables.trackBytes.end(), bytes.begin(), bytes.end());
    }
    tables.trackFrames.push_back(frame);
    const auto stored = std::span(tables.trackBytes).subspan(frame.offset, frame.size);
    if (!format::decodeTrackFrame(stored, frame.count, tables.trackPoints.emplace_back())) {
      throw Error(Fault::internal, fmt::format("{}: Draco does not read what it wrote", where));
    }
  }
  return static_cast<std::uint32_t>(tables.tracks.size() - 1);
}

}  // namespace billow::compiler
