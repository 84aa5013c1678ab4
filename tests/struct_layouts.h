// Where the fields of the format's structs lie, as the compiler has them.
#ifndef BILLOW_TESTS_STRUCT_LAYOUTS_H
#define BILLOW_TESTS_STRUCT_LAYOUTS_H

#include <cstddef>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "billow/format/effect.h"
#include "billow/format/layout.h"

namespace billow::tests {

struct Field {
  std::string name;
  std::size_t offset, size;
  bool operator==(const Field&) const = default;
};
inline void PrintTo(const Field& field, std::ostream* out) {
  *out << field.name << " " << field.offset << " " << field.size;
}

struct Layout {
  std::size_t size;
  std::vector<Field> fields;
  bool operator==(const Layout&) const = default;
};

#define FIELD(type, member)                               \
  Field {                                                 \
#member, offsetof(type, member), sizeof(type::member) \
  }

// Of every struct of the format, by name.
inline const std::map<std::string, Layout>& layouts() {
  using namespace format;
  static const std::map<std::string, Layout> all = {
      {"FileHeader",
       {sizeof(FileHeader),
        {FIELD(FileHeader, magic), FIELD(FileHeader, versionMajor), FIELD(FileHeader, versionMinor),
         FIELD(FileHeader, sectionCount), FIELD(FileHeader, fileSize), FIELD(FileHeader, contentsOffset),
         FIELD(FileHeader, contentsChecksum), FIELD(FileHeader, reserved), FIELD(FileHeader, headerChecksum)}}},
      {"SectionEntry",
       {sizeof(SectionEntry),
        {FIELD(SectionEntry, type), FIELD(SectionEntry, flags), FIELD(SectionEntry, offset), FIELD(SectionEntry, size),
         FIELD(SectionEntry, checksum)}}},
      {"StringRef", {sizeof(StringRef), {FIELD(StringRef, offset), FIELD(StringRef, size)}}},
      {"VolumeRecord",
       {sizeof(VolumeRecord),
        {FIELD(VolumeRecord, name), FIELD(VolumeRecord, firstGrid), FIELD(VolumeRecord, gridCount),
         FIELD(VolumeRecord, firstFrame), FIELD(VolumeRecord, frameCount), FIELD(VolumeRecord, firstGridFrame),
         FIELD(VolumeRecord, framesPerSecond), FIELD(VolumeRecord, look)}}},
      {"LookRecord",
       {sizeof(LookRecord),
        {FIELD(LookRecord, set), FIELD(LookRecord, extinctionScale), FIELD(LookRecord, albedo),
         FIELD(LookRecord, anisotropy), FIELD(LookRecord, emissionScale), FIELD(LookRecord, temperatureScale),
         FIELD(LookRecord, temperatureOffset), FIELD(LookRecord, ambient), FIELD(LookRecord, reserved)}}},
      {"GridRecord",
       {sizeof(GridRecord),
        {FIELD(GridRecord, name), FIELD(GridRecord, role), FIELD(GridRecord, sourceType), FIELD(GridRecord, component),
         FIELD(GridRecord, volume), FIELD(GridRecord, reserved)}}},
      {"FrameRecord",
       {sizeof(FrameRecord), {FIELD(FrameRecord, number), FIELD(FrameRecord, flags), FIELD(FrameRecord, time)}}},
      {"GridFrame",
       {sizeof(GridFrame),
        {FIELD(GridFrame, flags),         FIELD(GridFrame, node5),         FIELD(GridFrame, origin),
         FIELD(GridFrame, activeMin),     FIELD(GridFrame, activeMax),     FIELD(GridFrame, background),
         FIELD(GridFrame, valueMin),      FIELD(GridFrame, valueMax),      FIELD(GridFrame, sourceMin),
         FIELD(GridFrame, sourceMax),     FIELD(GridFrame, maxError),      FIELD(GridFrame, reserved),
         FIELD(GridFrame, squaredError),  FIELD(GridFrame, indexToWorld),  FIELD(GridFrame, activeVoxels),
         FIELD(GridFrame, pageListBegin), FIELD(GridFrame, pageListCount), FIELD(GridFrame, node4Count),
         FIELD(GridFrame, node3Count),    FIELD(GridFrame, maskCount),     FIELD(GridFrame, childCount),
         FIELD(GridFrame, tileCount),     FIELD(GridFrame, brickCount),    FIELD(GridFrame, brickUnits),
         FIELD(GridFrame, reserved2)}}},
      {"LevelRecord",
       {sizeof(LevelRecord),
        {FIELD(LevelRecord, volume), FIELD(LevelRecord, level), FIELD(LevelRecord, log2),
         FIELD(LevelRecord, firstError)}}},
      {"LevelError",
       {sizeof(LevelError),
        {FIELD(LevelError, squaredError), FIELD(LevelError, maxError), FIELD(LevelError, reserved)}}},
      {"PageRecord",
       {sizeof(PageRecord),
        {FIELD(PageRecord, offset), FIELD(PageRecord, checksum), FIELD(PageRecord, storedSize),
         FIELD(PageRecord, rawSize), FIELD(PageRecord, codec), FIELD(PageRecord, rawChecksum),
         FIELD(PageRecord, streams)}}},
      {"StreamRange", {sizeof(StreamRange), {FIELD(StreamRange, first), FIELD(StreamRange, count)}}},
      {"Node5",
       {sizeof(Node5),
        {FIELD(Node5, childBegin), FIELD(Node5, flags), FIELD(Node5, tile), FIELD(Node5, min), FIELD(Node5, max),
         FIELD(Node5, mean), FIELD(Node5, mask)}}},
      {"Node4",
       {sizeof(Node4),
        {FIELD(Node4, childBegin), FIELD(Node4, flags), FIELD(Node4, tile), FIELD(Node4, min), FIELD(Node4, max),
         FIELD(Node4, mean), FIELD(Node4, mask)}}},
      {"Node3",
       {sizeof(Node3),
        {FIELD(Node3, brick), FIELD(Node3, mask), FIELD(Node3, lo), FIELD(Node3, scale), FIELD(Node3, mean)}}},
      {"EffectRecord",
       {sizeof(EffectRecord),
        {FIELD(EffectRecord, name), FIELD(EffectRecord, firstEmitter), FIELD(EffectRecord, emitterCount),
         FIELD(EffectRecord, flags), FIELD(EffectRecord, seed), FIELD(EffectRecord, duration),
         FIELD(EffectRecord, reserved)}}},
      {"SpawnSpan",
       {sizeof(SpawnSpan),
        {FIELD(SpawnSpan, begin), FIELD(SpawnSpan, end), FIELD(SpawnSpan, first), FIELD(SpawnSpan, count)}}},
      {"EmitterRecord",
       {sizeof(EmitterRecord),
        {FIELD(EmitterRecord, name),        FIELD(EmitterRecord, firstSpan),    FIELD(EmitterRecord, spanCount),
         FIELD(EmitterRecord, flags),       FIELD(EmitterRecord, shape),        FIELD(EmitterRecord, extent),
         FIELD(EmitterRecord, position),    FIELD(EmitterRecord, positionRow),  FIELD(EmitterRecord, inheritance),
         FIELD(EmitterRecord, lifetime),    FIELD(EmitterRecord, direction),    FIELD(EmitterRecord, spreadCosine),
         FIELD(EmitterRecord, speed),       FIELD(EmitterRecord, gravity),      FIELD(EmitterRecord, drag),
         FIELD(EmitterRecord, wind),        FIELD(EmitterRecord, kind),         FIELD(EmitterRecord, radius),
         FIELD(EmitterRecord, radiusRow),   FIELD(EmitterRecord, proportions),  FIELD(EmitterRecord, extinction),
         FIELD(EmitterRecord, opacityRow),  FIELD(EmitterRecord, diffuse),      FIELD(EmitterRecord, diffuseRow),
         FIELD(EmitterRecord, emission),    FIELD(EmitterRecord, emissionRow),  FIELD(EmitterRecord, axis),
         FIELD(EmitterRecord, rotationRow), FIELD(EmitterRecord, displacement), FIELD(EmitterRecord, displacementRow),
         FIELD(EmitterRecord, firstMap),    FIELD(EmitterRecord, mapCount),     FIELD(EmitterRecord, mapsPerSecond),
         FIELD(EmitterRecord, material),    FIELD(EmitterRecord, track),        FIELD(EmitterRecord, firstPoint),
         FIELD(EmitterRecord, pointCount),  FIELD(EmitterRecord, firstGiven),   FIELD(EmitterRecord, givenCount),
         FIELD(EmitterRecord, reserved)}}},
      {"TrackRecord",
       {sizeof(TrackRecord),
        {FIELD(TrackRecord, firstFrame), FIELD(TrackRecord, frameCount), FIELD(TrackRecord, framesPerSecond),
         FIELD(TrackRecord, flags)}}},
      {"GivenParticle",
       {sizeof(GivenParticle),
        {FIELD(GivenParticle, time), FIELD(GivenParticle, lifetime), FIELD(GivenParticle, age),
         FIELD(GivenParticle, life), FIELD(GivenParticle, radius), FIELD(GivenParticle, colour),
         FIELD(GivenParticle, id), FIELD(GivenParticle, reserved)}}},
      {"TrackFrame",
       {sizeof(TrackFrame), {FIELD(TrackFrame, offset), FIELD(TrackFrame, size), FIELD(TrackFrame, count)}}},
      {"SurfacePoint", {sizeof(SurfacePoint), {FIELD(SurfacePoint, place), FIELD(SurfacePoint, normal)}}},
      {"ParticleMaterial",
       {sizeof(ParticleMaterial),
        {FIELD(ParticleMaterial, profile), FIELD(ParticleMaterial, profileRow), FIELD(ParticleMaterial, diffuseRamp),
         FIELD(ParticleMaterial, emissionRamp), FIELD(ParticleMaterial, erosion),
         FIELD(ParticleMaterial, erosionFrequency), FIELD(ParticleMaterial, occlusion),
         FIELD(ParticleMaterial, softness)}}},
      {"Mask3", {sizeof(Mask3), {FIELD(Mask3, words)}}}};
  return all;
}

#undef FIELD

}  // namespace billow::tests

#endif  // BILLOW_TESTS_STRUCT_LAYOUTS_H
