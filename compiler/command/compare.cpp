#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "billow/format/psnr.h"
#include "command.h"
#include "grid_error.h"
#include "import_options.h"
#include "pack_lookup.h"
#include "reconstruct.h"

namespace billow::command {
namespace {

struct Arguments {
  std::string pack;
  std::vector<std::string> inputs;
  ImportArguments import;
  bool json = false;
};

struct Row {
  std::string volume, grid;
  std::int32_t frame = 0;
  GridError error;
  double range = 0;     // max - min of the source's active values and background
  std::string problem;  // "" where the grid was compared
};

double psnrOf(const Row& row) {
  return format::psnr(row.range, row.error.squaredError, row.error.sourceVoxels);
}

bool sound(const Row& row) {
  return row.problem.empty() && row.error.mismatchedVoxels == 0;
}

nlohmann::ordered_json toJson(const Row& row) {
  nlohmann::ordered_json json;
  json["volume"] = row.volume;
  json["frame"] = row.frame;
  json["grid"] = row.grid;
  if (!row.problem.empty()) {
    json["problem"] = row.problem;
    return json;
  }
  const double psnr = psnrOf(row);
  json["activeVoxels"] = row.error.sourceVoxels;
  json["psnr"] = std::isfinite(psnr) ? nlohmann::ordered_json(psnr) : nullptr;  // null: exact
  json["exact"] = row.error.squaredError == 0;
  json["rmse"] = row.error.rmse();
  json["maxError"] = row.error.maxError;
  json["mismatchedVoxels"] = row.error.mismatchedVoxels;
  return json;
}

void printTable(const std::vector<Row>& rows) {
  fmt::print("{:>6} {:<24} {:>13} {:>9} {:>11} {:>11} {:>10}\n", "frame", "grid", "active voxels", "PSNR dB", "RMSE",
             "max error", "mismatched");
  for (const Row& row : rows) {
    const std::string name = row.volume + "/" + row.grid;
    if (!row.problem.empty()) {
      fmt::print("{:>6} {:<24} {}\n", row.frame, name, row.problem);
      continue;
    }
    const std::string psnr = row.error.squaredError == 0 ? "exact" : fmt::format("{:.2f}", psnrOf(row));
    fmt::print("{:>6} {:<24} {:>13} {:>9} {:>11.4g} {:>11.4g} {:>10}\n", row.frame, name, row.error.sourceVoxels, psnr,
               row.error.rmse(), row.error.maxError, row.error.mismatchedVoxels);
  }
}

// A volume of the source and the pack's one of the same name, or the only one of each.
const format::VolumeRecord& matchVolume(const format::Pack& pack, const compiler::Plan& plan,
                                        const compiler::PlannedVolume& volume) {
  const bool single = pack.volumes().size() == 1 && plan.volumes.size() == 1;
  if (single) return pack.volumes().front();
  for (const format::VolumeRecord& record : pack.volumes()) {
    if (pack.string(record.name) == volume.name) return record;
  }
  throw compiler::Error(compiler::Fault::input, fmt::format("the pack has no volume '{}'", volume.name));
}

class Comparison {
 public:
  Comparison(const format::Pack& pack, const compiler::ImportOptions& options) : pack_(pack), options_(options) {}

  // Nullopt, or what is wrong with the pack.
  std::optional<format::Issue> compareVolume(const compiler::PlannedVolume& planned,
                                             const format::VolumeRecord& volume) {
    for (const compiler::PlannedFrame& frame : planned.frames) {
      const std::ptrdiff_t index = findFrame(pack_, volume, frame.number);
      if (index < 0) {
        rows_.push_back({planned.name, "", frame.number, {}, 0, "the pack has no such frame"});
        continue;
      }
      const compiler::ImportedFrame source = compiler::importFrame(planned, frame, options_, printWarning);
      for (std::size_t g = 0; g < planned.grids.size(); ++g) {
        Row row{planned.name, planned.grids[g].name, frame.number, {}, 0, ""};
        auto issue = compareGrid(source.grids[g], volume, static_cast<std::uint32_t>(index), row);
        if (issue) return issue;
        if (source.grids[g].present || !row.problem.empty()) rows_.push_back(row);
      }
    }
    return std::nullopt;
  }

  const std::vector<Row>& rows() const { return rows_; }

 private:
  std::optional<format::Issue> compareGrid(const compiler::ImportedGrid& source, const format::VolumeRecord& volume,
                                           std::uint32_t frame, Row& row) {
    const std::ptrdiff_t grid = findGrid(pack_, volume, row.grid);
    if (grid < 0) {
      row.problem = "the pack has no such grid";
      return std::nullopt;
    }
    const format::GridFrame& gridFrame = pack_.gridFrame(volume, frame, static_cast<std::uint32_t>(grid));
    const bool present = (gridFrame.flags & format::kGridPresent) != 0;
    if (present != source.present) row.problem = present ? "only the pack has it here" : "only the source has it here";
    if (!present || !source.present) return std::nullopt;
    const auto view = format::GridView::load(pack_, gridFrame);
    if (!view) return view.error();
    row.error = measureError(source, reconstruct(*view));
    row.range = static_cast<double>(source.max) - static_cast<double>(source.min);
    if (source.background != gridFrame.background) {
      row.problem = fmt::format("background {} in the pack, {} in the source", gridFrame.background, source.background);
    }
    return std::nullopt;
  }

  const format::Pack& pack_;
  const compiler::ImportOptions& options_;
  std::vector<Row> rows_;
};

int runCompare(const Arguments& arguments) {
  const auto pack = format::Pack::openFile(arguments.pack);
  if (!pack) return reportIssue(arguments.pack, pack.error());
  const compiler::ImportOptions options = importOptions(arguments.import);
  const compiler::Plan plan = compiler::planInputs(arguments.inputs, options, printWarning);
  Comparison comparison(*pack, options);
  for (const compiler::PlannedVolume& volume : plan.volumes) {
    const auto issue = comparison.compareVolume(volume, matchVolume(*pack, plan, volume));
    if (issue) return reportIssue(arguments.pack, *issue);
  }
  const std::vector<Row>& rows = comparison.rows();
  const bool allSound = std::all_of(rows.begin(), rows.end(), sound);
  if (arguments.json) {
    nlohmann::ordered_json json;
    json["pack"] = arguments.pack;
    json["sound"] = allSound;
    json["grids"] = nlohmann::ordered_json::array();
    for (const Row& row : rows) json["grids"].push_back(toJson(row));
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  } else {
    printTable(rows);
  }
  if (allSound) return kDone;
  fmt::print(stderr, "billow: error: {}: does not hold what the source holds\n", arguments.pack);
  return kInvalid;
}

}  // namespace

void addCompare(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("compare", "Measure a pack's error against its source, per grid and frame");
  command->add_option("PACK", arguments->pack, "The pack to measure")->required()->type_name("PACK");
  command->add_option("INPUT", arguments->inputs, "The source, as for compile")->required()->type_name("INPUT");
  addImportOptions(*command, arguments->import);
  command->add_flag("--json", arguments->json, "Print the figures as one JSON object");
  command->footer(
      "PSNR is 20 log10((max - min) / RMSE) over active voxels; max and min are the source's, background included.\n"
      "Exit code 3 when a frame or a grid of the source is not in the pack, or a voxel is active in one of them only.\n"
      "Example: billow compare fire.blw 'fire_####.vdb'");
  command->callback([arguments, &run] { run = [arguments] { return runCompare(*arguments); }; });
}

}  // namespace billow::command
