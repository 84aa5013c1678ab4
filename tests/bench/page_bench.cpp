// The page codec beside zstd, on the pages of a pack: bytes, and MB/s of content on one thread (its processor time).
// Usage: billow_page_bench PACK [benchmark options]
#include <benchmark/benchmark.h>
#include <zstd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "billow/format/pack.h"
#include "billow/format/page_codec.h"

namespace {

namespace format = billow::format;
using Bytes = std::vector<std::byte>;

struct Corpus {
  std::vector<format::PageRecord> records;
  std::vector<Bytes> pages;
  std::int64_t rawBytes = 0;
};

Corpus readPages(const std::string& path) {
  Corpus corpus;
  const auto pack = format::Pack::openFile(path);
  if (!pack) return corpus;
  for (std::uint32_t i = 0; i < pack->pages().size(); ++i) {
    corpus.records.push_back(pack->pages()[i]);
    corpus.pages.push_back(pack->readPage(i)->raw);
    corpus.rawBytes += static_cast<std::int64_t>(corpus.pages.back().size());
  }
  return corpus;
}

Bytes zstd(const Bytes& page, int level) {
  Bytes stored(ZSTD_compressBound(page.size()));
  stored.resize(ZSTD_compress(stored.data(), stored.size(), page.data(), page.size(), level));
  return stored;
}

template <class Encode>
void encode(benchmark::State& state, const Corpus& corpus, const Encode& encodeOne) {
  std::size_t bytes = 0;
  for (auto _ : state) {
    bytes = 0;
    for (std::size_t i = 0; i < corpus.pages.size(); ++i) bytes += encodeOne(i).size();
  }
  state.SetBytesProcessed(state.iterations() * corpus.rawBytes);
  state.counters["stored"] = static_cast<double>(bytes);
  state.counters["ratio"] = static_cast<double>(bytes) / static_cast<double>(corpus.rawBytes);
}

template <class Encode, class Decode>
void decode(benchmark::State& state, const Corpus& corpus, const Encode& encodeOne, const Decode& decodeOne) {
  std::vector<Bytes> stored, out;
  for (std::size_t i = 0; i < corpus.pages.size(); ++i) {
    stored.push_back(encodeOne(i));
    out.emplace_back(corpus.pages[i].size());
  }
  for (auto _ : state) {
    for (std::size_t i = 0; i < stored.size(); ++i) decodeOne(i, stored[i], out[i]);
  }
  if (out != corpus.pages) state.SkipWithError("pages came back changed");
  state.SetBytesProcessed(state.iterations() * corpus.rawBytes);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 1;
  const Corpus corpus = readPages(argv[1]);
  if (corpus.pages.empty()) {
    std::fprintf(stderr, "%s: no pages\n", argv[1]);
    return 1;
  }
  const auto model = [&](std::size_t i) { return format::encodePage(corpus.records[i].streams, corpus.pages[i]); };
  const auto modelBack = [&](std::size_t i, const Bytes& stored, Bytes& out) {
    format::decodePage(corpus.records[i].streams, stored, out);
  };
  const auto zstd3 = [&](std::size_t i) { return zstd(corpus.pages[i], 3); };
  const auto zstd19 = [&](std::size_t i) { return zstd(corpus.pages[i], 19); };
  const auto zstdBack = [](std::size_t, const Bytes& stored, Bytes& out) {
    ZSTD_decompress(out.data(), out.size(), stored.data(), stored.size());
  };
  benchmark::RegisterBenchmark("encode/model", [&](auto& state) { encode(state, corpus, model); });
  benchmark::RegisterBenchmark("encode/zstd 3", [&](auto& state) { encode(state, corpus, zstd3); });
  benchmark::RegisterBenchmark("encode/zstd 19", [&](auto& state) { encode(state, corpus, zstd19); });
  benchmark::RegisterBenchmark("decode/model", [&](auto& state) { decode(state, corpus, model, modelBack); });
  benchmark::RegisterBenchmark("decode/zstd 3", [&](auto& state) { decode(state, corpus, zstd3, zstdBack); });
  int rest = argc - 1;
  benchmark::Initialize(&rest, argv + 1);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
