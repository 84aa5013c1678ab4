#include "compile.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "command.h"
#include "compile_report.h"
#include "depfile.h"
#include "import_options.h"
#include "progress.h"
#include "stages.h"

namespace billow::command {
namespace {

struct Arguments {
  std::vector<std::string> inputs;
  std::string output;
  ImportArguments import;
  std::optional<double> psnr;
  std::optional<float> maxError;
  compiler::Budget budget;
  std::optional<double> framesPerSecond;
  std::optional<std::uint32_t> levels;
  std::string metric = "voxel";
  int effort = 1;
  format::Compression compression = format::Compression::small;
  unsigned threads = 0;
  std::string depfile;
  bool json = false;
};

// Without its dependencies a build system would take the pack for one that is up to date: it goes then.
void writeDependencies(const Arguments& arguments, const std::set<std::string>& inputs) {
  try {
    writeDepfile(arguments.depfile, arguments.output, inputs);
  } catch (const compiler::Error&) {
    std::error_code ignored;
    std::filesystem::remove(arguments.output, ignored);
    throw;
  }
}

int runCompile(const Arguments& arguments) {
  if (arguments.metric == "depth" && !arguments.psnr && !arguments.budget.any()) {
    throw compiler::Error(compiler::Fault::commandLine, "--metric depth needs --psnr, --gpu-budget or --disk-budget");
  }
  compiler::CompileOptions options;
  options.import = importOptions(arguments.import);
  options.import.framesPerSecond = arguments.framesPerSecond;
  options.import.levels = arguments.levels;
  if (arguments.psnr) options.quality.psnr = arguments.psnr;
  // An error bound or a budget alone replaces the default PSNR.
  if ((arguments.maxError || arguments.budget.any()) && !arguments.psnr) options.quality.psnr.reset();
  if (arguments.metric == "depth") options.quality.metric = compiler::Metric::depth;
  options.quality.maxError = arguments.maxError;
  options.budget = arguments.budget;
  options.quality.effort = arguments.effort;
  options.compression = arguments.compression;
  options.threads = arguments.threads;
  options.progress = drawProgress;
  const compiler::CompileReport report = compiler::compile(arguments.inputs, arguments.output, options, printWarning);
  if (!arguments.depfile.empty()) writeDependencies(arguments, report.inputs);
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
                       "Least PSNR of every grid in every frame, over active voxels [47 unless an error or a budget "
                       "is given]")
          ->check(finiteNumber())
          ->check(CLI::Range(1.0, 200.0))
          ->type_name("DB");
  command->add_option("--max-error", arguments->maxError, "Largest error of any active voxel, in the grid's own unit")
      ->check(finiteNumber())
      ->check(CLI::PositiveNumber)
      ->type_name("E");
  command
      ->add_option("--metric", arguments->metric,
                   "What the error is of: voxel, or depth: integrals along rays of nine "
                   "directions (with --psnr or a budget)")
      ->check(CLI::IsMember({"voxel", "depth"}))
      ->capture_default_str();
  command
      ->add_option("--gpu-budget", arguments->budget.gpu,
                   "GPU bytes of the whole pack, all frames and grids, at most; the error is the least that fits")
      ->transform(CLI::AsSizeValue(false))
      ->excludes(psnr)
      ->type_name("BYTES");
  command
      ->add_option("--disk-budget", arguments->budget.disk,
                   "Bytes of the file at most; the error is the least that fits")
      ->transform(CLI::AsSizeValue(false))
      ->excludes(psnr)
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
      ->add_option("--levels", arguments->levels,
                   "Coarser levels to store besides, to be drawn from afar: 1 of voxels twice as long, 2 also of four "
                   "times [0, or the manifest's]")
      ->check(CLI::Range(0u, compiler::kMaxLevels))
      ->type_name("N");
  command
      ->add_option("--compress", arguments->compression,
                   "small: fewest bytes on disk; fast: zstd, read several times as fast; none: as a copy [small]")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, format::Compression>{{"small", format::Compression::small},
                                                                             {"fast", format::Compression::fast},
                                                                             {"none", format::Compression::none}}))
      ->type_name("HOW");
  command->add_option("--threads", arguments->threads, "Threads to use [all cores]; the pack does not depend on it")
      ->check(CLI::Range(1u, 1024u))
      ->type_name("N");
  command
      ->add_option("--depfile", arguments->depfile,
                   "For a build system: write what the pack depends on, as a rule of make. Folders that are searched "
                   "are part of it, but for the pack's own")
      ->type_name("FILE");
  command->add_flag("--json", arguments->json, "Print the report as one JSON object");
  command->footer("Example: billow compile 'fire_####.vdb' -o fire.blw");
  command->callback([arguments, &run] { run = [arguments] { return runCompile(*arguments); }; });
}

}  // namespace billow::command
