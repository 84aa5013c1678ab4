// The page codec beside zstd and plain copies, on the pages of a pack: bytes, and MB/s of content on one thread (its
// processor time). "literals" keeps zstd from coding them: what it does not find again stays as it is.
// Usage: billow_page_bench PACK [benchmark options]
#include <benchmark/benchmark.h>
#define ZSTD_STATIC_LINKING_ONLY  // how literals are coded
#include <zstd.h>

#include <cstdio>
#include <cstring>
#include <memory>
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

struct Setting {
  const char* name;
  int level;
  bool codesLiterals;
};
constexpr Setting kSettings[] = {
    {"zstd 1", 1, true},           {"zstd 3", 3, true},           {"zstd 9", 9, true},
    {"zstd 19", 19, true},         {"zstd -1", -1, true},         {"zstd -5", -5, true},
    {"zstd 3 literals", 3, false}, {"zstd 9 literals", 9, false}, {"zstd 19 literals", 19, false}};

// What does not shrink stays as it is.
Bytes zstd(const Bytes& page, const Setting& setting) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, setting.level);
  if (!setting.codesLiterals) {
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_literalCompressionMode, ZSTD_lcm_uncompressed);
  }
  Bytes stored(ZSTD_compressBound(page.size()));
  stored.resize(ZSTD_compress2(context.get(), stored.data(), stored.size(), page.data(), page.size()));
  return stored.size() < page.size() ? stored : page;
}

void unpack(const Bytes& stored, Bytes& out) {
  if (stored.size() == out.size()) {
    std::memcpy(out.data(), stored.data(), out.size());
  } else {
    ZSTD_decompress(out.data(), out.size(), stored.data(), stored.size());
  }
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
  benchmark::RegisterBenchmark("encode/model", [&](auto& state) { encode(state, corpus, model); });
  benchmark::RegisterBenchmark("decode/model", [&](auto& state) { decode(state, corpus, model, modelBack); });
  for (const Setting& setting : kSettings) {
    const auto pack = [&corpus, &setting](std::size_t i) { return zstd(corpus.pages[i], setting); };
    const auto unpackOne = [](std::size_t, const Bytes& stored, Bytes& out) { unpack(stored, out); };
    benchmark::RegisterBenchmark((std::string("encode/") + setting.name).c_str(),
                                 [&corpus, pack](auto& state) { encode(state, corpus, pack); });
    benchmark::RegisterBenchmark((std::string("decode/") + setting.name).c_str(),
                                 [&corpus, pack, unpackOne](auto& state) { decode(state, corpus, pack, unpackOne); });
  }
  const auto copy = [&](std::size_t i) { return corpus.pages[i]; };
  const auto copyBack = [](std::size_t, const Bytes& stored, Bytes& out) { unpack(stored, out); };
  benchmark::RegisterBenchmark("decode/none", [&](auto& state) { decode(state, corpus, copy, copyBack); });
  int rest = argc - 1;
  benchmark::Initialize(&rest, argv + 1);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
