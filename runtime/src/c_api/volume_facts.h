// What draws and the host ask about a pack's volumes, from its tables.
#ifndef BILLOW_RUNTIME_C_API_VOLUME_FACTS_H
#define BILLOW_RUNTIME_C_API_VOLUME_FACTS_H

#include <vector>

#include "billow/format/pack.h"
#include "billow/runtime/look.h"

namespace billow::c_api {

struct VolumeFacts {
  std::uint32_t number = 0;  // in the pack
  runtime::GridChoice grids = {};
  runtime::WorldBox box = {};             // of all frames, in the volume's own world
  double voxelSize = 0;                   // the smallest edge of a voxel; 0: nothing is active
  std::array<double, 3> anchor{0, 0, 0};  // where such a voxel's centre lies
  bool velocity = false;
  runtime::Look look = {};  // the suggested one; the plain one until that is fitted
};

// Of the volumes that can be played, with plain looks.
std::vector<VolumeFacts> volumeFacts(const format::Pack& pack);

// From the first frame's begin to the last one's end.
double secondsOf(const format::Pack& pack, const format::VolumeRecord& volume);

// The box of a box's corners after the transform.
runtime::WorldBox transformed(const runtime::WorldBox& box, const std::array<double, 12>& objectToWorld);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_VOLUME_FACTS_H
