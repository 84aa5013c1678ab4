// All of a page, in the order of spec/pagecodec.md: Node3s, masks, Node5s, Node4s, bricks, means of Node3s, children.
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_PAGE_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_PAGE_MODEL_H

#include <memory>
#include <span>

#include "brick_model.h"
#include "mask_model.h"
#include "voxel_model.h"

namespace billow::format::page_coder {

using PageRuns = std::span<const StreamRange, kStreamCount>;

// Bytes of a page's runs together.
std::uint64_t bytesOfRuns(PageRuns runs);

// Models of one page; a new page begins with new ones.
class PageModel {
 public:
  // `page` has bytesOfRuns(runs) bytes: what is coded, or where to.
  PageModel(PageRuns runs, std::byte* page);

  template <class Coder>
  void code(Coder& coder);

 private:
  struct Claim {  // a brick of this page that a Node3 of this page tells of
    std::uint32_t node;
    std::uint32_t encoding;
  };

  template <class Coder>
  void codeNodes3(Coder& coder);
  template <class Coder>
  void codeBrickWord(Coder& coder, Node3& node);
  template <class Coder>
  void codeMaskWord(Coder& coder, Node3& node);
  template <class Coder>
  void codeMasks(Coder& coder);
  void claimBricks();
  template <class Coder>
  void codeBricks(Coder& coder);
  void sumTexels();
  template <class Coder>
  void codeMeans(Coder& coder);
  template <class Coder, class Node>
  void codeNodes(Coder& coder, Stream stream, std::uint32_t sideLog2, MaskModel& masks);
  template <class Coder>
  void codeChildren(Coder& coder);

  StreamRange run(Stream stream) const { return runs_[static_cast<std::size_t>(stream)]; }
  std::byte* item(Stream stream, std::uint32_t number);
  template <class Item>
  Item load(Stream stream, std::uint32_t number);
  template <class Item>
  void store(Stream stream, std::uint32_t number, const Item& value);
  // The mask of a node where the page has it, else nullptr.
  const ActiveRows* maskOf(const Node3& node);

  PageRuns runs_;
  std::array<std::byte*, kStreamCount> at_;
  std::vector<Claim> claims_;             // by unit of the page
  std::vector<std::uint64_t> texelSums_;  // by Node3 of the page
  std::vector<std::uint32_t> activeCounts_;

  std::array<ByteModel, kEncodingCount + 1> encoding_;
  std::array<BitModel, 2> nextUnit_;
  NumberModel unit_;
  std::array<SymbolModel, 12> maskKind_;
  NumberModel maskIndex_;
  std::uint32_t encodingBefore_ = kEncodingCount;
  std::uint32_t kindBefore_ = 0;
  std::uint32_t unitNext_ = 0, maskNext_ = 0;
  std::array<FloatModel, 3> lo_, scale_;  // by kind of encoding
  SymbolModel mean_ = evenModel();
  ClassBits meanBits_;
  BitModel meanRest_ = bitModel(64);
  MaskModel brickMasks_, node4Masks_, node5Masks_;
  BrickModel bricks_;
  VoxelModel voxels_;
  std::array<FloatModel, 4> values_;
  std::array<BitModel, 2> tileSame_;
  NumberModel flags_;
  BitModel nextBegin_ = bitModel(kScale - 256);
  NumberModel child_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_PAGE_MODEL_H
