// The codec `model` of pages: models of what a page holds over an entropy coder. spec/pagecodec.md.
#ifndef BILLOW_FORMAT_PAGE_CODEC_H
#define BILLOW_FORMAT_PAGE_CODEC_H

#include <cstddef>
#include <span>
#include <vector>

#include "billow/format/layout.h"

namespace billow::format {

// Any `page` that has the bytes of its runs, at most kMaxPageBytes; lossless whatever they are.
std::vector<std::byte> encodePage(std::span<const StreamRange, kStreamCount> runs, std::span<const std::byte> page);

// Fills `page`, which has the bytes of the runs. False where `stored` is not what encodePage() gives, as far as its
// ends tell: the page's own checksum proves the rest. Takes any bytes; time and memory are bounded by page.size().
bool decodePage(std::span<const StreamRange, kStreamCount> runs, std::span<const std::byte> stored,
                std::span<std::byte> page);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_PAGE_CODEC_H
