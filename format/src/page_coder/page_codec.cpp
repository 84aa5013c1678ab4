#include "billow/format/page_codec.h"

#include <memory>
#include <optional>
#include <stdexcept>

#include "page_model.h"

namespace billow::format {
namespace {

// The models of a page are some 100 KB: one place a thread, not one a page.
page_coder::PageModel& freshModel(page_coder::PageRuns runs, std::byte* page) {
  thread_local const auto model = std::make_unique<std::optional<page_coder::PageModel>>();
  return model->emplace(runs, page);
}

}  // namespace

std::vector<std::byte> encodePage(std::span<const StreamRange, kStreamCount> runs, std::span<const std::byte> page) {
  if (page_coder::bytesOfRuns(runs) != page.size()) throw std::invalid_argument("encodePage: runs of another page");
  // Models store what they code, for decoding's sake: here the same bytes again.
  std::vector<std::byte> work(page.begin(), page.end());
  thread_local page_coder::Encoder coder;
  freshModel(runs, work.data()).code(coder);
  return coder.finish();
}

bool decodePage(std::span<const StreamRange, kStreamCount> runs, std::span<const std::byte> stored,
                std::span<std::byte> page) {
  if (page_coder::bytesOfRuns(runs) != page.size()) return false;
  const page_coder::PaddedBytes padded(stored);
  page_coder::Decoder coder(padded);
  freshModel(runs, page.data()).code(coder);
  return coder.sound();
}

}  // namespace billow::format
