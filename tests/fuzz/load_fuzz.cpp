// Any bytes, with their checksums then made right or left as they are: loading gives an error or a frame in which no
// look-up of a shader reads outside, in no more memory than the tables promise.
#include <cmath>
#include <cstdlib>

#include "loaded_frame.h"
#include "pack_image.h"

namespace {

using namespace billow;

// More is refused here, so that no input takes long.
constexpr std::uint64_t kMostScratch = std::uint64_t{64} << 20;

class Bounded : public std::pmr::memory_resource {
 public:
  explicit Bounded(std::uint64_t limit) : left_(limit) {}

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (bytes > left_) std::abort();
    left_ -= bytes;
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override {
    left_ += bytes;
    std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  std::uint64_t left_;
};

void lookUp(const runtime::LoadedFrame& frame) {
  const tests::FrameReader reader(frame);
  for (const runtime::LoadedGrid& grid : frame.grids) {
    if (!grid.present) continue;
    const std::uint64_t step = 1 + grid.cells.count() / 2000;
    for (std::uint64_t i = 0; i < grid.cells.count(); i += step) {
      const std::uint32_t* dim = grid.cells.dim;
      const std::uint64_t cell[3] = {i / dim[2] / dim[1], i / dim[2] % dim[1], i % dim[2]};
      std::int64_t at[3];
      for (int axis = 0; axis < 3; ++axis) {
        at[axis] = static_cast<std::int64_t>((grid.cells.min[axis] + cell[axis]) * 8 + i * 5 % 8);
      }
      if (!std::isfinite(reader.voxel(grid, at[0], at[1], at[2]))) std::abort();
    }
  }
}

void load(const format::Pack& pack, std::uint32_t volume, std::uint32_t frame, std::uint32_t how) {
  const std::uint32_t grids = pack.volumes()[volume].gridCount;
  runtime::LoadRequest request{.pack = &pack, .volume = volume, .frame = frame, .maxImageExtent3D = 2048};
  request.grids.extinction = grids > 0 ? 0 : format::kNone;
  request.grids.flames = grids > 1 ? 1 : format::kNone;
  request.index = static_cast<runtime::Index>(how % 4);
  request.means = how % 5 == 4;
  request.bc7 = how % 2 == 0;
  request.leastAtlasBricks = 1;
  request.verify = how % 3 == 0 ? runtime::Verify::always : runtime::Verify::never;
  const std::uint64_t bound = runtime::scratchBound(request);
  if (bound > kMostScratch) return;
  Bounded memory(bound);
  runtime::FrameLoader loader(&memory);
  const tests::ReadPages read(request);
  const auto loaded = loader.load(request, read.pages);
  if (loaded) lookUp(*loaded);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  billow::tests::sealAll(bytes);
  const auto pack = format::Pack::open(format::makeMemorySource(bytes));
  if (!pack) return 0;
  for (std::uint32_t volume = 0; volume < pack->volumes().size(); ++volume) {
    const std::uint32_t frames = std::min(pack->volumes()[volume].frameCount, 4u);
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      for (std::uint32_t how = 0; how < 10; ++how) load(*pack, volume, frame, how + frame);
    }
  }
  return 0;
}
