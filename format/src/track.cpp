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

// The i-th attribute of the type.
const draco::PointAttribute* attributeOf(const draco::PointCloud& cloud, draco::GeometryAttribute::Type type, int i,
                                         draco::DataType data, int components) {
  const draco::PointAttribute* attribute = cloud.GetNamedAttribute(type, i);
  const bool fits = attribute != nullptr && attribute->data_type() == data &&
                    attribute->num_components() == components && attribute->size() == cloud.num_points();
  return fits ? attribute : nullptr;
}

// One value a point.
template <class Read>
bool readAttribute(const draco::PointAttribute* attribute, std::uint32_t count, const Read& read) {
  if (attribute == nullptr) return false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const draco::AttributeValueIndex at = attribute->mapped_index(draco::PointIndex(i));
    if (at.value() >= count) return false;
    read(i, at);
  }
  return true;
}

bool readPoints(const draco::PointCloud& cloud, std::vector<TrackPoint>& points, std::vector<float>& radii) {
  using draco::GeometryAttribute;
  const auto count = static_cast<std::uint32_t>(points.size());
  const auto* position = attributeOf(cloud, GeometryAttribute::POSITION, 0, draco::DT_FLOAT32, 3);
  const auto* number = attributeOf(cloud, GeometryAttribute::GENERIC, 0, draco::DT_UINT32, 1);
  const auto* radius = attributeOf(cloud, GeometryAttribute::GENERIC, 1, draco::DT_FLOAT32, 1);
  if (cloud.num_attributes() != (radii.empty() ? 2 : 3)) return false;
  return readAttribute(position, count, [&](auto i, auto at) { position->GetValue(at, points[i].position); }) &&
         readAttribute(number, count, [&](auto i, auto at) { number->GetValue(at, &points[i].number); }) &&
         (radii.empty() || readAttribute(radius, count, [&](auto i, auto at) { radius->GetValue(at, &radii[i]); }));
}

}  // namespace

bool haveRadii(std::span<const TrackRecord> tracks) {
  return std::any_of(tracks.begin(), tracks.end(), [](const TrackRecord& t) { return (t.flags & kTrackRadii) != 0; });
}

bool decodeTrackFrame(std::span<const std::byte> bytes, std::uint32_t count, bool hasRadii,
                      std::vector<TrackPoint>& points, std::vector<float>& radii) {
  points.clear();
  radii.clear();
  if (count == 0) return bytes.empty();
  if (!hasHeader(bytes, count)) return false;
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  try {
    const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!cloud.ok() || cloud.value()->num_points() != count) return false;
    points.resize(count);
    radii.resize(hasRadii ? count : 0);
    return readPoints(*cloud.value(), points, radii);
  } catch (const std::length_error&) {
    return false;
  }
}

}  // namespace billow::format
