#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mesh/formats.h"
#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::uint64_t kMostAttributeBytes = 512u << 20;

// Draco's own decoders believe the counts that the bytes begin with; these look at them first.
template <class Base>
class Limited : public Base {
 public:
  explicit Limited(const std::string& file) : file_(file) {}

 protected:
  bool DecodeConnectivity() override {
    if (this->bitstream_version() < DRACO_BITSTREAM_VERSION(2, 2)) failMesh(file_, "expected Draco's bitstream 2.2");
    draco::DecoderBuffer ahead = *this->buffer();
    // Faces and points with sequential coding, vertices and faces with Edgebreaker's.
    for (int i = 0; i < 2; ++i) {
      std::uint32_t count = 0;
      if (!draco::DecodeVarint(&count, &ahead)) return false;
      if (count > std::min(kMostTriangles, kMostVertices)) {
        failMesh(file_, fmt::format("it has {} triangles or vertices; expected at most {}", count,
                                    std::min(kMostTriangles, kMostVertices)));
      }
    }
    return Base::DecodeConnectivity();
  }

  bool DecodeAllAttributes() override {
    std::uint64_t bytes = 0;
    for (std::int32_t i = 0; i < this->point_cloud()->num_attributes(); ++i) {
      bytes += static_cast<std::uint64_t>(std::max<std::int64_t>(this->point_cloud()->attribute(i)->byte_stride(), 0));
    }
    bytes *= std::max<std::uint64_t>(this->point_cloud()->num_points(), 1);
    if (bytes > kMostAttributeBytes) {
      failMesh(file_, fmt::format("its attributes take {} bytes; expected at most {}", bytes, kMostAttributeBytes));
    }
    return Base::DecodeAllAttributes();
  }

 private:
  const std::string& file_;
};

template <class Base>
void decode(draco::DecoderBuffer buffer, const std::string& file, draco::Mesh& mesh) {
  Limited<Base> decoder(file);
  const draco::DecoderOptions options;
  const draco::Status status = decoder.Decode(options, &buffer, &mesh);
  if (!status.ok()) failMesh(file, fmt::format("a broken Draco mesh: {}", status.error_msg_string()));
}

void decode(std::span<const std::byte> bytes, const std::string& file, draco::Mesh& mesh) {
  draco::DecoderBuffer buffer, ahead;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  ahead = buffer;
  draco::DracoHeader header{};
  const draco::Status status = draco::PointCloudDecoder::DecodeHeader(&ahead, &header);
  if (!status.ok()) failMesh(file, fmt::format("not Draco: {}", status.error_msg_string()));
  if (header.encoder_type != draco::TRIANGULAR_MESH) failMesh(file, "a Draco point cloud; expected a mesh");
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
    return decode<draco::MeshEdgebreakerDecoder>(buffer, file, mesh);
  }
  if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
    return decode<draco::MeshSequentialDecoder>(buffer, file, mesh);
  }
  failMesh(file, fmt::format("Draco's encoding {} is unknown", header.encoder_method));
}

class Positions {
 public:
  Positions(const draco::Mesh& mesh, std::optional<std::uint32_t> id, const std::string& file)
      : attribute_(id ? mesh.GetAttributeByUniqueId(*id) : mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION)),
        points_(mesh.num_points()),
        file_(file) {
    if (attribute_ == nullptr || attribute_->num_components() != 3) {
      failMesh(file, "its Draco mesh has no positions of three components");
    }
    if (!attribute_->is_mapping_identity() && attribute_->indices_map_size() < points_) {
      failMesh(file, "a broken Draco mesh: points without a position");
    }
  }

  Vertex at(draco::PointIndex point) const {
    Vertex vertex{};
    if (point.value() >= points_) failMesh(file_, fmt::format("point {} of {}", point.value(), points_));
    const draco::AttributeValueIndex value = attribute_->mapped_index(point);
    if (value.value() >= attribute_->size() || !attribute_->ConvertValue<float>(value, 3, vertex.data())) {
      failMesh(file_, fmt::format("a broken Draco mesh: no position of point {}", point.value()));
    }
    for (const float coordinate : vertex) {
      if (!std::isfinite(coordinate)) failMesh(file_, fmt::format("a coordinate is {}", coordinate));
    }
    return vertex;
  }

 private:
  const draco::PointAttribute* attribute_;
  std::uint32_t points_;
  const std::string& file_;
};

}  // namespace

TriangleList readDraco(std::span<const std::byte> bytes, std::optional<std::uint32_t> position,
                       const std::string& file) {
  draco::Mesh mesh;
  try {
    decode(bytes, file, mesh);
  } catch (const std::length_error&) {
    failMesh(file, "a broken Draco mesh");
  }
  const Positions positions(mesh, position, file);
  TriangleList triangles;
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
    addTriangle({positions.at(face[0]), positions.at(face[1]), positions.at(face[2])}, file, triangles);
  }
  return triangles;
}

}  // namespace billow::compiler
