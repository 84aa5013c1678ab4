#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "billow/format/temp_file.h"
#include "command.h"
#include "compare_effects.h"
#include "compare_frames.h"
#include "import_options.h"
#include "pack_lookup.h"
#include "report/collect.h"
#include "report/page.h"

namespace billow::command {
namespace {

struct Arguments {
  std::string pack;
  std::vector<std::string> inputs;
  ImportArguments import;
  std::string report;  // "": none
  std::uint32_t level = 0;
  bool json = false;
};

nlohmann::ordered_json toJson(const GridRow& row) {
  nlohmann::ordered_json json;
  json["volume"] = row.volume;
  json["frame"] = row.frame;
  json["grid"] = row.grid;
  if (!row.problem.empty()) {
    json["problem"] = row.problem;
    return json;
  }
  const auto decibels = [](double db) { return std::isfinite(db) ? nlohmann::ordered_json(db) : nullptr; };
  json["activeVoxels"] = row.error.sourceVoxels;
  json["psnr"] = decibels(row.psnr());  // null: exact
  json["depthPsnr"] = decibels(row.depthPsnr());
  json["exact"] = row.error.squaredError == 0;
  json["rmse"] = row.error.rmse();
  json["maxError"] = row.error.maxError;
  json["mismatchedVoxels"] = row.error.mismatchedVoxels;
  return json;
}

void printTable(const std::vector<GridRow>& rows) {
  fmt::print("{:>6} {:<24} {:>13} {:>9} {:>9} {:>11} {:>11} {:>10}\n", "frame", "grid", "active voxels", "PSNR dB",
             "depth dB", "RMSE", "max error", "mismatched");
  for (const GridRow& row : rows) {
    const std::string name = row.volume + "/" + row.grid;
    if (!row.problem.empty()) {
      fmt::print("{:>6} {:<24} {}\n", row.frame, name, row.problem);
      continue;
    }
    const auto decibels = [](double db) {
      return std::isnan(db) ? "-" : db > 0 && std::isinf(db) ? "exact" : fmt::format("{:.2f}", db);
    };
    fmt::print("{:>6} {:<24} {:>13} {:>9} {:>9} {:>11.4g} {:>11.4g} {:>10}\n", row.frame, name, row.error.sourceVoxels,
               decibels(row.psnr()), decibels(row.depthPsnr()), row.error.rmse(), row.error.maxError,
               row.error.mismatchedVoxels);
  }
}

void printJson(const std::string& pack, const std::vector<GridRow>& rows, const std::vector<EffectRow>& effects,
               bool allSound) {
  nlohmann::ordered_json json;
  json["pack"] = pack;
  json["sound"] = allSound;
  json["grids"] = nlohmann::ordered_json::array();
  for (const GridRow& row : rows) json["grids"].push_back(toJson(row));
  json["effects"] = nlohmann::ordered_json::array();
  for (const EffectRow& row : effects) json["effects"].push_back(toJson(row));
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

// The rename at the end would put the report in their place.
void refuseToReplaceInputs(const Arguments& arguments, const compiler::Plan& plan) {
  const auto refuse = [&](const std::string& file) {
    if (!sameFile(file, arguments.report)) return;
    throw compiler::Error(compiler::Fault::commandLine,
                          fmt::format("--report {}: that is an input; give the report another name", arguments.report));
  };
  refuse(arguments.pack);
  for (const std::string& input : arguments.inputs) refuse(input);
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    for (const compiler::PlannedFrame& frame : volume.frames) {
      for (const std::string& file : frame.files) refuse(file);
    }
  }
}

void writeReport(const ReportData& data, format::TempFile& file) {
  const std::string page = renderPage(data);
  file.write(0, std::as_bytes(std::span(page)));
  file.commit(page.size());
}

int runCompare(const Arguments& arguments) {
  const auto pack = format::Pack::openFile(arguments.pack);
  if (!pack) return reportIssue(arguments.pack, pack.error());
  const compiler::ImportOptions options = importOptions(arguments.import);
  const compiler::Plan plan = compiler::planInputs(arguments.inputs, options, printWarning);
  std::optional<format::TempFile> file;  // opened before the work, so that a bad path costs no time
  std::optional<ReportCollector> report;
  if (!arguments.report.empty()) {
    refuseToReplaceInputs(arguments, plan);
    file.emplace(arguments.report);
    report.emplace(*pack, arguments.pack, arguments.inputs);
  }
  const auto rows = compareFrames(*pack, plan, options, arguments.level, [&](const ComparedGrid& compared) {
    if (report) report->observe(compared);
  });
  if (!rows) return reportIssue(arguments.pack, rows.error());
  const std::vector<EffectRow> effects = compareEffects(*pack, plan);
  if (report) {
    ReportData data = report->finish(*rows, plan, options);
    data.effects = effects;
    writeReport(data, *file);
  }
  const auto sound = [](const auto& row) { return row.sound(); };
  const bool allSound = std::ranges::all_of(*rows, sound) && std::ranges::all_of(effects, sound);
  if (arguments.json) {
    printJson(arguments.pack, *rows, effects, allSound);
  } else {
    if (!rows->empty()) printTable(*rows);
    if (!rows->empty() && !effects.empty()) fmt::print("\n");
    if (!effects.empty()) printTable(effects);
  }
  if (allSound) return kDone;
  fmt::print(stderr, "billow: error: {}: does not hold what the source holds\n", arguments.pack);
  return kInvalid;
}

}  // namespace

void addCompare(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("compare", "Measure a pack's error against its source: per grid and frame, per effect");
  command->add_option("PACK", arguments->pack, "The pack to measure")->required()->type_name("PACK");
  command->add_option("INPUT", arguments->inputs, "The source, as for compile")->required()->type_name("INPUT");
  addImportOptions(*command, arguments->import);
  CLI::Option* level =
      command
          ->add_option("--level", arguments->level,
                       "Measure a coarser level in its volume's place: 1, of voxels twice as long, or 2, of four times")
          ->check(CLI::Range(0u, format::kMaxLevelLog2))
          ->capture_default_str()
          ->type_name("N");
  command->add_option("--report", arguments->report, "Write a page to look at: curves, worst bricks, bytes by kind")
      ->excludes(level)
      ->type_name("OUT.html");
  command->add_flag("--json", arguments->json, "Print the figures as one JSON object");
  command->footer(
      "PSNR is 20 log10((max - min) / RMSE) over active voxels; max and min are the source's, background included.\n"
      "Depth is the same over line integrals (optical depth) along nine directions: what pictures are made of.\n"
      "A level's error is of all voxels, active or not, linear between its own, as if it all lay in active ones.\n"
      "Of effects, each curve, ramp, displacement map and track is held against its description, in its own unit; the\n"
      "numbers must be the same.\n"
      "Exit code 3 when a frame, a grid or an effect of the source is not in the pack, a voxel is active in one of "
      "them\n"
      "only, or an effect's numbers differ.\n"
      "The report is one HTML file that needs no network. For each grid it measures every encoding on its worst "
      "frame.\n"
      "Examples: billow compare fire.blw 'fire_####.vdb' --report fire.html\n"
      "          billow compare smoke.blw campfire_smoke.effect.json");
  command->callback([arguments, &run] { run = [arguments] { return runCompare(*arguments); }; });
}

}  // namespace billow::command
