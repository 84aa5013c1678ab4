// Bytes against NanoVDB. On the GPU: for every grid of every frame, all of billow's GPU bytes (index, nodes, masks,
// bricks) at the PSNR asked, beside the smallest NanoVDB grid (Fp4, Fp8, FpN at its coarsest sufficient tolerance) of
// at least that PSNR. On disk: for every folder, the pack of all its files beside those NanoVDB grids, the ones of a
// file together, compressed by zstd -19. Usage: billow_size_bench [--psnr DB] FILE.vdb...   (for the GPU's bytes each
// file is compiled alone)
#include <fmt/format.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "billow/format/gpu_size.h"
#include "billow/format/pack.h"
#include "compile.h"

namespace {

namespace format = billow::format;

struct Peer {
  std::uint64_t bytes = 0;  // 0: not reached
  std::string name;
  std::vector<char> grid;
};

double psnrOf(double squaredError, double range, double voxels) {
  if (!(squaredError > 0)) return std::numeric_limits<double>::infinity();
  return 20 * std::log10(range / std::sqrt(squaredError / voxels));
}

template <class Build>
double gridPsnr(const openvdb::FloatGrid& source, const nanovdb::NanoGrid<Build>& grid) {
  double error = 0;
  double voxels = 0;
  double min = static_cast<double>(source.background());
  double max = min;
  auto accessor = grid.getAccessor();
  for (auto it = source.cbeginValueOn(); it; ++it) {
    const openvdb::Coord at = it.getCoord();
    const double value = static_cast<double>(*it);
    const double count = static_cast<double>(it.getVoxelCount());
    const double difference = value - static_cast<double>(accessor.getValue(nanovdb::Coord(at[0], at[1], at[2])));
    error += difference * difference * count;
    voxels += count;
    min = std::min(min, value);
    max = std::max(max, value);
  }
  return psnrOf(error, max - min, voxels);
}

template <class Build>
bool tryPeer(const openvdb::FloatGrid& source, float tolerance, double psnr, const char* name, Peer& best) {
  nanovdb::OpenToNanoVDB<float, Build> convert;
  convert.oracle() = nanovdb::AbsDiff(tolerance);
  auto handle = convert(source, nanovdb::StatsMode::Disable, nanovdb::ChecksumMode::Disable, 0);
  if (gridPsnr<Build>(source, *handle.template grid<Build>()) < psnr) return false;
  if (best.bytes != 0 && handle.size() >= best.bytes) return true;
  const char* data = reinterpret_cast<const char*>(handle.data());
  best = Peer{static_cast<std::uint64_t>(handle.size()), name, std::vector<char>(data, data + handle.size())};
  return true;
}

Peer bestPeer(const openvdb::FloatGrid& source, double range, double psnr) {
  Peer best;
  tryPeer<nanovdb::Fp4>(source, 0, psnr, "Fp4", best);
  tryPeer<nanovdb::Fp8>(source, 0, psnr, "Fp8", best);
  double low = 0;
  double high = range;
  for (int step = 0; step < 20; ++step) {
    const double middle = step == 0 ? range * 0.01 : (low + high) / 2;
    (tryPeer<nanovdb::FpN>(source, static_cast<float>(middle), psnr, "FpN", best) ? low : high) = middle;
  }
  return best;
}

// The scalar grid, or one component of a vec3 grid.
openvdb::FloatGrid::Ptr scalarGrid(const openvdb::GridBase& grid, const std::string& wanted) {
  if (grid.isType<openvdb::FloatGrid>()) {
    return static_cast<const openvdb::FloatGrid&>(grid).deepCopy();
  }
  if (!grid.isType<openvdb::Vec3SGrid>()) return nullptr;
  const auto& vectors = static_cast<const openvdb::Vec3SGrid&>(grid);
  const int component = wanted.back() - 'x';
  auto result = openvdb::FloatGrid::create(vectors.background()[component]);
  result->setTransform(vectors.transform().copy());
  result->tree().topologyUnion(vectors.tree());
  auto accessor = vectors.getConstAccessor();
  for (auto it = result->beginValueOn(); it; ++it) it.setValue(accessor.getValue(it.getCoord())[component]);
  return result;
}

openvdb::FloatGrid::Ptr findGrid(const openvdb::GridPtrVec& grids, const std::string& name) {
  for (const auto& grid : grids) {
    const bool component = name.size() > 2 && name.substr(0, name.size() - 2) == grid->getName();
    if (grid->getName() == name || (component && grid->isType<openvdb::Vec3SGrid>())) return scalarGrid(*grid, name);
  }
  return nullptr;
}

struct Sequence {
  std::vector<std::string> files;
  std::uint64_t peerDisk = 0;  // bytes
};

struct Totals {
  double logRatio = 0;
  double worst = 0;
  int rows = 0;
  std::map<std::string, Sequence> sequences;  // by folder
};

std::string compileTo(const std::vector<std::string>& inputs, double psnr) {
  std::string output = (std::filesystem::temp_directory_path() / fmt::format("size_bench_{}.blw", getpid())).string();
  billow::compiler::CompileOptions options;
  options.quality.psnr = psnr;
  billow::compiler::compile(inputs, output, options, [](const std::string&) {});
  return output;
}

std::uint64_t zstd19(const std::vector<char>& bytes) {
  std::vector<char> out(ZSTD_compressBound(bytes.size()));
  return ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 19);
}

void benchFile(const std::string& path, double psnr, Totals& totals) {
  const std::string output = compileTo({path}, psnr);
  const auto pack = format::Pack::openFile(output);
  std::filesystem::remove(output);
  std::vector<char> peerFile;
  openvdb::io::File file(path);
  file.open(false);
  const auto grids = file.getGrids();
  const format::VolumeRecord& volume = pack->volumes()[0];
  for (std::uint32_t g = 0; g < volume.gridCount; ++g) {
    const format::GridFrame& frame = pack->gridFrame(volume, 0, g);
    if (frame.activeVoxels == 0) continue;
    const std::string name(pack->string(pack->gridsOf(volume)[g].name));
    const double voxels = static_cast<double>(frame.activeVoxels);
    const double range = static_cast<double>(frame.sourceMax) - static_cast<double>(frame.sourceMin);
    const auto source = findGrid(*grids, name);
    if (!source || !(range > 0) || voxels > 1e9) continue;
    const Peer peer = bestPeer(*source, range, psnr);
    const format::GpuBytes bytes = format::gpuBytes(frame);
    const double total = static_cast<double>(bytes.total());
    const double ratio = peer.bytes == 0 ? 0 : total / static_cast<double>(peer.bytes);
    fmt::print("{:<28} {:<14} {:>9} {:>8.2f} {:>9} {:>6.2f} {:>9} {:>4} {:>6.2f} {:>6.3f}\n",
               std::filesystem::path(path).filename().string(), name, frame.activeVoxels,
               psnrOf(frame.squaredError, range, voxels), bytes.total(), total * 8 / voxels, peer.bytes, peer.name,
               static_cast<double>(peer.bytes) * 8 / voxels, ratio);
    if (ratio == 0) continue;
    peerFile.insert(peerFile.end(), peer.grid.begin(), peer.grid.end());
    totals.logRatio += std::log(ratio);
    totals.worst = std::max(totals.worst, ratio);
    ++totals.rows;
  }
  Sequence& sequence = totals.sequences[std::filesystem::path(path).parent_path().string()];
  sequence.files.push_back(path);
  sequence.peerDisk += zstd19(peerFile);
}

void benchDisk(const std::string& folder, const Sequence& sequence, double psnr) {
  if (sequence.peerDisk == 0) return;
  const std::string output = compileTo(sequence.files, psnr);
  const std::uint64_t bytes = std::filesystem::file_size(output);
  std::filesystem::remove(output);
  fmt::print("disk: {:<16} {:>3} files: billow {:>9}, NanoVDB by zstd -19 {:>9}, ratio {:.3f}\n",
             std::filesystem::path(folder).filename().string(), sequence.files.size(), bytes, sequence.peerDisk,
             static_cast<double>(bytes) / static_cast<double>(sequence.peerDisk));
}

}  // namespace

int main(int argc, char** argv) {
  double psnr = 45;
  std::vector<std::string> files(argv + 1, argv + argc);
  if (files.size() >= 2 && files[0] == "--psnr") {
    psnr = std::stod(files[1]);
    files.erase(files.begin(), files.begin() + 2);
  }
  openvdb::initialize();
  fmt::print("{:<28} {:<14} {:>9} {:>8} {:>9} {:>6} {:>9} {:>4} {:>6} {:>6}\n", "file", "grid", "voxels", "dB", "bytes",
             "b/av", "NanoVDB", "", "b/av", "ratio");
  Totals totals;
  for (const std::string& file : files) {
    try {
      benchFile(file, psnr, totals);
    } catch (const std::exception& error) {
      fmt::print("{}: {}\n", file, error.what());
    }
  }
  for (const auto& [folder, sequence] : totals.sequences) benchDisk(folder, sequence, psnr);
  if (totals.rows > 0) {
    fmt::print("{} grid frames: geometric mean of ratios {:.3f}, worst {:.3f}\n", totals.rows,
               std::exp(totals.logRatio / totals.rows), totals.worst);
  }
  return 0;
}
