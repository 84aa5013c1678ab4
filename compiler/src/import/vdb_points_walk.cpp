#include "import/vdb_points_walk.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/AttributeArray.h>

#include <set>
#include <string>
#include <vector>

#include "import/vdb_walk.h"
#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::uint64_t kMostAttributes = 256, kMostGroups = 4096;
constexpr std::uint64_t kMostAttributeBytes = std::uint64_t{1} << 30;  // of a grid, unpacked
constexpr std::uint32_t kLeafBytes = 512 * 4;                          // of where its voxels' points end
constexpr std::uint16_t kUncompressed = 0xffff;

// OpenVDB's flags of an array, and of how it is stored.
constexpr std::uint8_t kConstantStride = 8;
enum Stored : std::uint8_t { kStrided = 1, kUniform = 2, kPaged = 8 };

struct Array {
  std::uint64_t bytes;     // as stored, or in pages
  std::uint64_t rawBytes;  // as used
  std::uint8_t stored;
};

// How one attribute's arrays lie in pages, leaf after leaf: the sizes of the pages come in one pass, they themselves in
// a later one. As OpenVDB's PagedInputStream has it.
class Pages {
 public:
  explicit Pages(ByteReader& reader) : reader_(reader) {}

  void addSize(std::uint64_t bytes) {
    if (at_ == pageBytes_) {
      const auto stored = reader_.value<std::int32_t>("a page's size");
      const auto raw = stored > 0 ? reader_.value<std::int32_t>("a page's size") : -std::int64_t{stored};
      if (raw < 0) reader_.fail("a page of points has a negative size");
      pages_.push_back({stored > 0 ? std::uint64_t(stored) : 0, static_cast<std::uint64_t>(raw)});
      pageBytes_ = static_cast<std::uint64_t>(raw);
      at_ = 0;
    }
    pageOf_.push_back(pages_.size() - 1);
    at_ += bytes;
    if (at_ > pageBytes_) reader_.fail("an array of points ends behind its page");
  }
  void endSizes() {
    if (at_ != pageBytes_) reader_.fail("a page of points is larger than what lies in it");
  }

  // The page comes with the first array in it.
  void readFirst(std::size_t leaf) {
    if (leaf > 0 && pageOf_[leaf] == pageOf_[leaf - 1]) return;
    const Page& page = pages_[pageOf_[leaf]];
    if (page.stored == 0) return reader_.skip(page.raw, "a page of points");
    if (page.stored > reader_.remaining()) reader_.skip(page.stored, "a page of points");
    skipBlosc(reader_, page.stored, page.raw);
  }

 private:
  struct Page {
    std::uint64_t stored;  // 0: as it is
    std::uint64_t raw;
  };
  ByteReader& reader_;
  std::vector<Page> pages_;
  std::vector<std::size_t> pageOf_;  // by leaf
  std::uint64_t at_ = 0, pageBytes_ = 0;
};

class PointsWalker {
 public:
  PointsWalker(ByteReader& reader, const VdbGrid& grid, std::uint64_t most)
      : reader_(reader), grid_(grid), most_(most) {}

  std::uint64_t walk() {
    leaves_.resize(walkPointTopology(reader_, grid_));
    const auto passes = reader_.value<std::uint16_t>("the number of passes");
    reader_.skip(leaves_.size() * 2, "the sizes of voxels");
    for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) readArrays(leaf);
    if (leaves_.empty()) return 0;
    if (passes != 4 + 2 * storageBytes_.size()) {
      reader_.fail(fmt::format("{} passes for {} attributes", passes, storageBytes_.size()));
    }
    std::vector<Pages> pages(storageBytes_.size(), Pages(reader_));
    for (std::size_t a = 0; a < pages.size(); ++a) readSizes(a, pages[a]);
    for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) readVoxels();
    for (std::size_t a = 0; a < pages.size(); ++a) readValues(a, pages[a]);
    return points_;
  }

 private:
  // The descriptor: types, names with their places among these, groups.
  void readDescriptor() {
    const auto types = reader_.value<std::uint64_t>("the number of attributes");
    if (types > kMostAttributes)
      reader_.fail(fmt::format("{} attributes; expected at most {}", types, kMostAttributes));
    storageBytes_.clear();
    for (std::uint64_t i = 0; i < types; ++i) {
      const std::string value = reader_.string("an attribute's type"), codec = reader_.string("an attribute's codec");
      const openvdb::NamePair type(value, codec);
      if (!openvdb::points::AttributeArray::isRegistered(type)) reader_.fail("an attribute of unknown type");
      storageBytes_.push_back(openvdb::points::AttributeArray::create(type, 1)->storageTypeSize());
    }
    std::set<std::uint64_t> places;
    for (std::uint64_t i = 0; i < types; ++i) {
      reader_.string("an attribute's name");
      const auto place = reader_.value<std::uint64_t>("an attribute's place");
      if (place >= types || !places.insert(place).second) reader_.fail("two attributes in one place, or none there");
    }
    const auto groups = reader_.value<std::uint64_t>("the number of groups");
    if (groups > kMostGroups) reader_.fail(fmt::format("{} groups; expected at most {}", groups, kMostGroups));
    for (std::uint64_t i = 0; i < groups; ++i) {
      reader_.string("a group's name");
      reader_.skip(8, "a group's place");
    }
    skipMetadata(reader_);
  }

  // A leaf's arrays. The descriptor comes with every leaf, or once for all.
  void readArrays(std::size_t leaf) {
    if (!common_) {
      const auto header = reader_.value<std::uint8_t>("a leaf's header");
      if (header > 1) reader_.fail("unknown flags of a leaf of points");
      const std::size_t before = storageBytes_.size();
      readDescriptor();
      if (leaf > 0 && storageBytes_.size() != before) reader_.fail("leaves with different numbers of attributes");
      common_ = header == 1;
    }
    std::uint64_t points = 0;
    for (std::size_t a = 0; a < storageBytes_.size(); ++a) {
      const std::uint32_t size = readArray(leaf, storageBytes_[a]);
      if (a > 0 && size != points) reader_.fail("a leaf's attributes are of different numbers of points");
      points = size;
    }
    points_ += points;
    if (points_ <= most_) return;
    throw Error(Fault::input, fmt::format("{}: {} or more particles in grid '{}'; expected at most {}", reader_.path(),
                                          points_, grid_.name, most_));
  }

  std::uint32_t readArray(std::size_t leaf, std::uint64_t storage) {
    constexpr std::uint64_t kCounted = 6;  // bytes that OpenVDB counts with the values
    const auto bytes = reader_.value<std::uint64_t>("an array's size");
    const auto flags = reader_.value<std::uint8_t>("an array's flags");
    const auto stored = reader_.value<std::uint8_t>("an array's flags");
    const auto size = reader_.value<std::uint32_t>("an array's size");
    if (bytes < kCounted || flags >= 0x20 || stored >= 0x10) reader_.fail("an array's size or flags are wrong");
    const std::uint64_t stride = (stored & kStrided) != 0 ? reader_.value<std::uint32_t>("an array's stride") : 1;
    const std::uint64_t elements = (flags & kConstantStride) != 0 ? size * stride : stride;
    const std::uint64_t raw = ((stored & kUniform) != 0 ? 1 : elements) * storage;
    if (raw / storage > kMostAttributeBytes || (rawBytes_ += raw) > kMostAttributeBytes) {
      reader_.fail(fmt::format("more than {} bytes of attributes", kMostAttributeBytes));
    }
    if ((stored & (kPaged | kUniform)) != 0 && bytes - kCounted != raw)
      reader_.fail("an array has another size than its points");
    leaves_[leaf].push_back({bytes - kCounted, raw, stored});
    return size;
  }

  void readSizes(std::size_t attribute, Pages& pages) {
    bool any = false;
    for (const auto& arrays : leaves_) {
      const Array& array = arrays[attribute];
      const bool paged = (array.stored & kPaged) != 0;
      if (&arrays != &leaves_.front() && paged != any) reader_.fail("arrays of one attribute in pages and not");
      any = paged;
      if (paged) pages.addSize(array.bytes);
    }
    if (any) pages.endSizes();
  }

  // Where each voxel's points end.
  void readVoxels() {
    reader_.skip(512 / 8, "a leaf's mask");
    const auto stored = reader_.value<std::uint16_t>("a leaf's size");
    if (stored == kUncompressed) return reader_.skip(kLeafBytes, "a leaf's voxels");
    skipBlosc(reader_, stored, kLeafBytes);
  }

  void readValues(std::size_t attribute, Pages& pages) {
    for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
      const Array& array = leaves_[leaf][attribute];
      if ((array.stored & kPaged) != 0) {
        pages.readFirst(leaf);
        continue;
      }
      const bool uniform = (array.stored & kUniform) != 0;
      const auto compressed = uniform ? std::uint8_t{0} : reader_.value<std::uint8_t>("an array's compression");
      if (compressed == 1) {
        if (array.bytes > reader_.remaining()) reader_.skip(array.bytes, "an array of points");
        skipBlosc(reader_, array.bytes, array.rawBytes);
      } else {
        if (array.bytes != array.rawBytes) reader_.fail("an array has another size than its points");
        reader_.skip(array.bytes, "an array of points");
      }
    }
  }

  ByteReader& reader_;
  const VdbGrid& grid_;
  std::uint64_t most_;
  std::vector<std::vector<Array>> leaves_;
  std::vector<std::uint64_t> storageBytes_;  // of a value, by attribute
  bool common_ = false;                      // one descriptor serves all leaves
  std::uint64_t points_ = 0, rawBytes_ = 0;
};

}  // namespace

std::uint64_t walkPoints(ByteReader& reader, const VdbGrid& grid, std::uint64_t most) {
  openvdb::initialize();
  return PointsWalker(reader, grid, most).walk();
}

}  // namespace billow::compiler
