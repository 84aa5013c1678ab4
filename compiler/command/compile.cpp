#include "compile.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "command.h"
#include "encoding_keys.h"
#include "import_options.h"
#include "progress.h"

namespace billow::command {
namespace {

struct Arguments {
  std::vector<std::string> inputs;
  std::string output;
  ImportArguments import;
  std::optional<double> psnr;
  std::optional<float> maxError;
  std::optional<std::uint64_t> gpuBudget;
  std::optional<double> framesPerSecond;
  std::string metric = "voxel";
  int effort = 1;
  format::Compression compression = format::Compression::small;
  unsigned threads = 0;
  bool json = false;
};

std::string psnrText(double psnr) {
  return std::isfinite(psnr) ? fmt::format("{:.2f} dB", psnr) : "exact";
}

// A line for each encoding that the grid's bricks have: how many, what they take, and their part of the error.
void printEncodings(const compiler::GridReport& grid) {
  double error = 0;
  for (const compiler::EncodingTotal& total : grid.encodings) error += total.squaredError;
  for (std::uint32_t e = 0; e < format::kEncodingCount; ++e) {
    const compiler::EncodingTotal& total = grid.encodings[e];
    if (total.bricks == 0) continue;
    const auto bytes = static_cast<double>(total.bricks * *format::brickBytes(e));
    fmt::print("  {:<22} {:>10} {:>12.1f} KB {:>9.1f} %\n", kEncodingKeys[e], total.bricks, bytes * 1e-3,
               error > 0 ? 100 * total.squaredError / error : 0.0);
  }
}

void printReport(const compiler::CompileReport& report, const std::string& output) {
  fmt::print("{}: {} frame{}, {:.2f} MB\n", output, report.frames, report.frames == 1 ? "" : "s",
             static_cast<double>(report.fileBytes) * 1e-6);
  fmt::print("{:<24} {:>6} {:>13} {:>10} {:>12} {:>12}\n", "grid", "frames", "active voxels", "worst PSNR", "max error",
             "GPU/frame");
  for (const compiler::GridReport& grid : report.grids) {
    const std::string name = grid.volume.empty() ? grid.grid : grid.volume + "/" + grid.grid;
    fmt::print("{:<24} {:>6} {:>13} {:>10} {:>12.4g} {:>9.1f} KB\n", name, grid.frames, grid.activeVoxels,
               psnrText(grid.worstPsnr), grid.maxError, static_cast<double>(grid.largestFrameGpuBytes) * 1e-3);
  }
  for (const compiler::GridReport& grid : report.grids) {
    if (grid.frames == 0) continue;
    fmt::print("\n{:<24} {:>10} {:>15} {:>11}\n", grid.grid, "bricks", "bytes", "of error");
    printEncodings(grid);
  }
}

nlohmann::ordered_json reportJson(const compiler::CompileReport& report, const std::string& output) {
  nlohmann::ordered_json json;
  json["output"] = output;
  json["frames"] = report.frames;
  json["fileBytes"] = report.fileBytes;
  json["grids"] = nlohmann::ordered_json::array();
  for (const compiler::GridReport& grid : report.grids) {
    nlohmann::ordered_json row;
    row["volume"] = grid.volume;
    row["grid"] = grid.grid;
    row["frames"] = grid.frames;
    row["activeVoxels"] = grid.activeVoxels;
    row["worstPsnr"] = std::isfinite(grid.worstPsnr) ? nlohmann::ordered_json(grid.worstPsnr) : nullptr;
    row["maxError"] = grid.maxError;
    row["largestFrameGpuBytes"] = grid.largestFrameGpuBytes;
    for (std::size_t e = 0; e < grid.encodings.size(); ++e) {
      row["bricks"][kEncodingKeys[e]] = grid.encodings[e].bricks;
      row["squaredError"][kEncodingKeys[e]] = grid.encodings[e].squaredError;
    }
    json["grids"].push_back(row);
  }
  return json;
}

int runCompile(const Arguments& arguments) {
  compiler::CompileOptions options;
  options.import = importOptions(arguments.import);
  options.import.framesPerSecond = arguments.framesPerSecond;
  if (arguments.psnr) options.quality.psnr = arguments.psnr;
  // An error bound or a budget alone replaces the default PSNR.
  if ((arguments.maxError || arguments.gpuBudget) && !arguments.psnr) options.quality.psnr.reset();
  if (arguments.metric == "depth") options.quality.metric = compiler::Metric::depth;
  options.quality.maxError = arguments.maxError;
  options.quality.gpuBudget = arguments.gpuBudget;
  options.quality.effort = arguments.effort;
  options.compression = arguments.compression;
  options.threads = arguments.threads;
  options.progress = drawProgress;
  const compiler::CompileReport report = compiler::compile(arguments.inputs, arguments.output, options, printWarning);
  if (arguments.json) {
    fmt::print("{}\n",
               reportJson(report, arguments.output).dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    printReport(report, arguments.output);
  }
  return kDone;
}

}  // namespace

void addCompile(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("compile", "Turn OpenVDB sequences into one pack");
  command
      ->add_option("INPUT", arguments->inputs,
                   "Files, a folder, a quoted glob, name_####.vdb, name_%04d.vdb, or a *.json manifest")
      ->required();
  command->add_option("-o,--output", arguments->output, "The pack to write")->required()->type_name("OUT.blw");
  CLI::Option* psnr =
      command
          ->add_option("--psnr", arguments->psnr,
                       "Least PSNR of every grid in every frame, over active voxels [47 unless --max-error or "
                       "--gpu-budget is given]")
          ->check(finiteNumber())
          ->check(CLI::Range(1.0, 200.0))
          ->type_name("DB");
  command->add_option("--max-error", arguments->maxError, "Largest error of any active voxel, in the grid's own unit")
      ->check(finiteNumber())
      ->check(CLI::PositiveNumber)
      ->type_name("E");
  CLI::Option* metric = command
                            ->add_option("--metric", arguments->metric,
                                         "What --psnr is of: voxel, or depth: integrals along rays of nine directions")
                            ->check(CLI::IsMember({"voxel", "depth"}))
                            ->needs(psnr)
                            ->capture_default_str();
  command
      ->add_option("--gpu-budget", arguments->gpuBudget,
                   "Largest GPU size of any frame, all grids together; the error is the least that fits")
      ->transform(CLI::AsSizeValue(false))
      ->excludes(psnr)
      ->excludes(metric)
      ->type_name("BYTES");
  command->add_option("--fps", arguments->framesPerSecond, "Frames per second of the sequence [24, or the manifest's]")
      ->check(finiteNumber())
      ->check(CLI::Range(0.001, 1e6))
      ->type_name("N");
  addImportOptions(*command, arguments->import);
  command->add_option("--effort", arguments->effort, "0 fastest to 9 smallest")
      ->check(CLI::Range(0, 9))
      ->capture_default_str();
  command
      ->add_option("--compress", arguments->compression,
                   "small: fewest bytes on disk; fast: zstd, read several times as fast [small]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, format::Compression>{
          {"small", format::Compression::small}, {"fast", format::Compression::fast}}))
      ->type_name("HOW");
  command->add_option("--threads", arguments->threads, "Threads to use [all cores]; the pack does not depend on it")
      ->check(CLI::Range(1u, 1024u))
      ->type_name("N");
  command->add_flag("--json", arguments->json, "Print the report as one JSON object");
  command->footer("Example: billow compile 'fire_####.vdb' -o fire.blw");
  command->callback([arguments, &run] { run = [arguments] { return runCompile(*arguments); }; });
}

}  // namespace billow::command
