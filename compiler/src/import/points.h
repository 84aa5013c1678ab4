// Particles in files: PLY and OpenVDB point grids, a file a frame.
#ifndef BILLOW_COMPILER_IMPORT_POINTS_H
#define BILLOW_COMPILER_IMPORT_POINTS_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace billow::compiler {

// An attribute that may be read: the first of the names that a file has.
struct AttributeChoice {
  std::vector<std::string> names;
  bool required = false;  // else a file may lack it
};

struct PointAttributes {
  AttributeChoice id, radius, age, life, colour;
  std::vector<std::string> grids;  // of an OpenVDB file; empty: all point grids
};

// One file's particles. Of an attribute that the file lacks there are no values, else as many as places.
struct PointFrame {
  std::vector<std::array<float, 3>> places;
  std::vector<std::int64_t> ids;
  std::vector<float> radii, ages, lives;
  std::vector<std::array<float, 3>> colours;  // linear
  bool ordered = false;                       // the file keeps its particles in order, so that the i-th may be the i-th
};

// Reads a file of at most `most` particles, by its name's end: .ply or .vdb. `frame` is for messages. Values come as
// they stand there, finite or not. Throws Error: Fault::file where it cannot be read, Fault::input where it is damaged,
// has more particles, or lacks a required attribute.
PointFrame readPoints(const std::string& path, std::int32_t frame, const PointAttributes& attributes,
                      std::uint32_t most);

// ---- By kind of file, for readPoints(). `what` names file and frame in messages.

// ASCII, and binary of both byte orders. Nothing about the bytes is trusted, and no more is allocated than they hold.
// Integer colours are sRGB.
PointFrame readPly(std::span<const std::byte> bytes, const std::string& what, const PointAttributes& attributes,
                   std::uint32_t most);
// The points of all asked grids together, at their places in the world.
PointFrame readVdbPoints(const std::string& path, const std::string& what, const PointAttributes& attributes,
                         std::uint32_t most);

// Throws Error(Fault::input): "WHAT: no attribute 'NAME'; there is: ...".
[[noreturn]] void failWithoutAttribute(const std::string& what, const AttributeChoice& choice,
                                       std::span<const std::string> offered);
// An id as a number of another type: throws Error(Fault::input) where it is none.
std::int64_t idOf(double value, const std::string& what, std::size_t particle);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_POINTS_H
