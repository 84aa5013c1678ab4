// Small OpenVDB files, and what planning makes of what the user types about them.
#ifndef BILLOW_TESTS_PLANNED_H
#define BILLOW_TESTS_PLANNED_H

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "import/vdb_write.h"
#include "stages.h"

namespace billow::tests {

inline compiler::ImportedGrid oneVoxel(float value) {
  compiler::ImportedGrid grid;
  grid.present = true;
  compiler::Leaf leaf{};
  leaf.origin = {8, -16, 0};
  leaf.active.words[0] = 1;
  leaf.values[0] = value;
  grid.leaves.push_back(leaf);
  return grid;
}

// Writes float grids of one voxel each; a name that ends in '*' becomes a vec3 grid.
inline void writeGrids(const std::string& path, const std::vector<std::string>& names, float value = 1) {
  const compiler::ImportedGrid grid = oneVoxel(value);
  std::vector<compiler::VdbOutput> outputs;
  for (const std::string& name : names) {
    const bool vector = name.ends_with('*');
    outputs.push_back({vector ? name.substr(0, name.size() - 1) : name,
                       false,
                       {&grid, vector ? &grid : nullptr, vector ? &grid : nullptr}});
  }
  compiler::writeVdb(path, outputs);
}

struct Planned {
  std::vector<compiler::PlannedVolume> volumes;
  std::vector<std::string> warnings;
  int fault = 0;  // of the error, 0 where there is none
  std::string error;
};

inline Planned plan(const std::vector<std::string>& inputs, const compiler::ImportOptions& options = {}) {
  Planned result;
  try {
    result.volumes = compiler::planInputs(inputs, options, [&](const std::string& text) {
                       result.warnings.push_back(text);
                     }).volumes;
  } catch (const compiler::Error& error) {
    result.fault = static_cast<int>(error.fault());
    result.error = error.what();
  }
  return result;
}

inline std::vector<std::int32_t> numbersOf(const Planned& planned) {
  std::vector<std::int32_t> numbers;
  if (planned.volumes.empty()) return numbers;
  for (const compiler::PlannedFrame& frame : planned.volumes.front().frames) numbers.push_back(frame.number);
  return numbers;
}

inline std::vector<std::string> namesOf(const Planned& planned) {
  std::vector<std::string> names;
  if (planned.volumes.empty()) return names;
  for (const compiler::PlannedGrid& grid : planned.volumes.front().grids) names.push_back(grid.name);
  return names;
}

inline format::Role roleOf(const Planned& planned, const std::string& name) {
  for (const compiler::PlannedGrid& grid : planned.volumes.at(0).grids) {
    if (grid.name == name) return grid.role;
  }
  ADD_FAILURE() << "no grid " << name;
  return format::Role::none;
}

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_PLANNED_H
