// Any bytes as a PLY file: it is read or refused with a line that names it, and what is read is whole.
#include <cstdlib>
#include <string>

#include "import/points.h"
#include "stages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace billow::compiler;
  constexpr std::uint32_t kMost = 4096;
  const PointAttributes attributes{{{"id"}, false},   {{"pscale", "radius"}, false}, {{"age"}, false},
                                   {{"life"}, false}, {{"", "Cd"}, false},           {}};
  const std::string what = "fuzz";
  try {
    const PointFrame frame = readPly(std::as_bytes(std::span(data, size)), what, attributes, kMost);
    const std::size_t count = frame.places.size();
    const auto whole = [&](std::size_t values) { return values == 0 || values == count; };
    if (count > kMost || !whole(frame.ids.size()) || !whole(frame.radii.size()) || !whole(frame.ages.size()) ||
        !whole(frame.lives.size()) || !whole(frame.colours.size())) {
      std::abort();
    }
  } catch (const Error& error) {
    if (error.fault() != Fault::input || !std::string(error.what()).starts_with(what)) std::abort();
  }
  return 0;
}
