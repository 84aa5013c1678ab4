#include "billow/format/track.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

namespace billow::format {
namespace {

// Draco's header (its bitstream specification, 2.2): a point cloud, coded sequentially, without metadata, of bitstream
// 2.3; then the number of points. The library would believe that number, so it is compared before.
constexpr std::array<std::uint8_t, 11> kHeader{'D', 'R', 'A', 'C', 'O', 2, 3, 0, 0, 0, 0};

bool hasHeader(std::span<const std::byte> bytes, std::uint32_t count) {
  std::uint32_t stored = 0;
  if (bytes.size() < kHeader.size() + sizeof stored) return false;
  std::memcpy(&stored, bytes.data() + kHeader.size(), sizeof stored);
  return std::memcmp(bytes.data(), kHeader.data(), kHeader.size()) == 0 && stored == count;
}

const draco::PointAttribute* attributeOf(const draco::PointCloud& cloud, draco::GeometryAttribute::Type type,
                                         draco::DataType data, int components) {
  const draco::PointAttribute* attribute = cloud.GetNamedAttribute(type);
  const bool fits = attribute != nullptr && attribute->data_type() == data &&
                    attribute->num_components() == components && attribute->size() == cloud.num_points();
  return fits ? attribute : nullptr;
}

bool readPoints(const draco::PointCloud& cloud, std::vector<TrackPoint>& points) {
  const auto* position = attributeOf(cloud, draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, 3);
  const auto* number = attributeOf(cloud, draco::GeometryAttribute::GENERIC, draco::DT_UINT32, 1);
  if (cloud.num_attributes() != 2 || position == nullptr || number == nullptr) return false;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto at = [&](const draco::PointAttribute& a) { return a.mapped_index(draco::PointIndex(i)); };
    if (at(*position).value() >= points.size() || at(*number).value() >= points.size()) return false;
    position->GetValue(at(*position), points[i].position);
    number->GetValue(at(*number), &points[i].number);
  }
  return true;
}

}  // namespace

bool decodeTrackFrame(std::span<const std::byte> bytes, std::uint32_t count, std::vector<TrackPoint>& points) {
  points.clear();
  if (count == 0) return bytes.empty();
  if (!hasHeader(bytes, count)) return false;
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  try {
    const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!cloud.ok() || cloud.value()->num_points() != count) return false;
    points.resize(count);
    return readPoints(*cloud.value(), points);
  } catch (const std::length_error&) {
    return false;
  }
}

}  // namespace billow::format
