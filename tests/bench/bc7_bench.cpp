// BC7 alone, at 2 bits a voxel: PSNR per grid and voxels a second on one core at every effort, beside another encoder's
// blocks. bc7_bench.sh runs it together with bc7e.
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "../brick_source.h"
#include "encode/brick_lanes.h"
#include "grid_corpus.h"

namespace {

using namespace billow;
using bench::Corpus;
using tests::Brick;
using tests::sourceOf;

constexpr int kEfforts = 10;
constexpr std::size_t kBricksAcross = 64;
constexpr std::size_t kBrickWidth = 8;    // texels
constexpr std::size_t kBrickHeight = 16;  // two layers of 8, four slices each
constexpr std::size_t kDdsHeader = 148;   // with the DX10 part

compiler::TexelRange rangeOf(const Brick& brick) {
  return compiler::coverRange(compiler::activeRange(sourceOf(brick, 0)), 0, 255);
}

std::string fileName(const Corpus& corpus) {
  std::string name = corpus.name;
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

std::size_t bricksDown(const Corpus& corpus) {
  return (corpus.bricks.size() + kBricksAcross - 1) / kBricksAcross;
}

// Bricks as 8x8x2 RGBA texels packed along z, inactive voxels 0.
void writePng(const Corpus& corpus, const std::string& path) {
  const std::size_t width = kBricksAcross * kBrickWidth;
  const std::size_t height = bricksDown(corpus) * kBrickHeight;
  std::vector<std::uint8_t> pixels(width * height * 4);
  for (std::size_t b = 0; b < corpus.bricks.size(); ++b) {
    const Brick& brick = corpus.bricks[b];
    compiler::TexelTargets targets;
    compiler::texelTargets(sourceOf(brick, 0), rangeOf(brick), 0, 255, targets);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      const std::size_t x = i >> 6, y = i >> 3 & 7, z = i & 7;
      const std::size_t column = b % kBricksAcross * kBrickWidth + x;
      const std::size_t row = b / kBricksAcross * kBrickHeight + (z >> 2) * 8 + y;
      pixels[(row * width + column) * 4 + (z & 3)] = static_cast<std::uint8_t>(targets[i] + 0.5f);
    }
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGBA;
  if (png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, nullptr) == 0) {
    throw std::runtime_error("cannot write " + path);
  }
}

std::vector<std::byte> readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
  std::vector<std::byte> bytes(chars.size());
  std::memcpy(bytes.data(), chars.data(), chars.size());
  return bytes;
}

// The squared error of what another encoder made of writePng's image.
double ddsError(const Corpus& corpus, const std::string& path) {
  const std::vector<std::byte> dds = readFile(path);
  const std::size_t blocksAcross = kBricksAcross * 2;
  if (dds.size() < kDdsHeader + blocksAcross * bricksDown(corpus) * 4 * 16) {
    throw std::runtime_error(path + " is too short");
  }
  double squared = 0;
  for (std::size_t b = 0; b < corpus.bricks.size(); ++b) {
    compiler::Candidate candidate;
    for (std::size_t block = 0; block < 8; ++block) {
      const std::size_t column = b % kBricksAcross * 2 + (block & 1);
      const std::size_t row = b / kBricksAcross * 4 + (block >> 1);
      std::memcpy(&candidate.payload[block * 16], &dds[kDdsHeader + (row * blocksAcross + column) * 16], 16);
    }
    const compiler::TexelRange range = rangeOf(corpus.bricks[b]);
    candidate.lo = range.lo;
    candidate.scale = range.scale;
    format::Texels texels;
    format::decodeTexels(format::kEncodingBc7Z, {candidate.payload.data(), 128}, texels);
    compiler::measure(sourceOf(corpus.bricks[b], 0), texels, candidate);
    squared += candidate.squaredError;
  }
  return squared;
}

struct Row {
  std::string name;
  std::vector<double> decibels;
  std::vector<double> speeds;  // voxels a second of processor time; none where it was not this program that encoded
};

using Encode = std::function<void(const compiler::BrickSource&, compiler::Candidate&)>;

Row measure(const std::string& name, const std::vector<Corpus>& corpora, const Encode& encode) {
  Row row{name, {}, {}};
  compiler::Candidate candidate;
  for (const Corpus& corpus : corpora) {
    double squared = 0;
    const std::clock_t begin = std::clock();
    for (const Brick& brick : corpus.bricks) {
      encode(sourceOf(brick, 0), candidate);
      squared += candidate.squaredError;
    }
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    row.speeds.push_back(static_cast<double>(corpus.bricks.size() * format::kBrickVoxels) / seconds);
    row.decibels.push_back(corpus.psnr(squared));
  }
  return row;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Means leave the made-up cloud out, which comes first.
void print(const Row& row) {
  fmt::print("| {:<14} | {:6.3f} |", row.name, mean({row.decibels.begin() + 1, row.decibels.end()}));
  if (row.speeds.empty()) {
    fmt::print(" – | – |");
  } else {
    fmt::print(" {:.2f} | {:.2f} |", mean({row.speeds.begin() + 1, row.speeds.end()}) * 1e-6, row.speeds[0] * 1e-6);
  }
  for (const double decibel : row.decibels) fmt::print(" {:.2f} |", decibel);
  fmt::print("\n");
  std::fflush(stdout);
}

void printTable(const std::vector<Corpus>& corpora, const std::string& folder) {
  fmt::print("| encoder | mean dB | Mvoxel/s, mean | cloud256 |");
  for (const Corpus& corpus : corpora) fmt::print(" {} |", corpus.name);
  fmt::print("\n");
  std::vector<std::filesystem::path> levels;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_directory()) levels.push_back(entry.path());
  }
  std::sort(levels.begin(), levels.end());
  for (const auto& level : levels) {
    Row row{level.filename().string(), {}, {}};
    for (const Corpus& corpus : corpora) {
      row.decibels.push_back(corpus.psnr(ddsError(corpus, (level / (fileName(corpus) + ".dds")).string())));
    }
    print(row);
  }
  for (int effort = 0; effort < kEfforts; ++effort) {
    print(measure(fmt::format("z, effort {}", effort), corpora, [=](const auto& brick, compiler::Candidate& out) {
      compiler::encodeBc7(brick, format::kEncodingBc7Z, effort, out);
    }));
  }
  for (int effort = 0; effort < kEfforts; ++effort) {
    print(measure(fmt::format("best, effort {}", effort), corpora, [=](const auto& brick, compiler::Candidate& out) {
      compiler::encodeBc7BestAxis(brick, effort, out);
    }));
  }
}

}  // namespace

// bc7_bench write|table FOLDER SEQUENCE...: writes an image for each grid, or prints the table of the
// FOLDER/ENCODER/*.dds that were made of them and of billow's own.
int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: billow_bc7_bench write|table FOLDER SEQUENCE...");
  std::vector<Corpus> corpora = {bench::cloudCorpus()};
  for (int i = 3; i < argc; ++i) {
    for (Corpus& corpus : bench::sequenceCorpora(argv[i])) corpora.push_back(std::move(corpus));
  }
  const std::string folder = argv[2];
  if (std::string(argv[1]) == "write") {
    for (const Corpus& corpus : corpora) writePng(corpus, folder + "/" + fileName(corpus) + ".png");
  } else {
    printTable(corpora, folder);
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
