#include "compile.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "import/input_notes.h"
#include "passes/budget.h"
#include "passes/write_pass.h"

namespace billow::compiler {
namespace {

// The rename at the end would put the pack in the source's place.
void refuseToReplaceInputs(const Plan& plan, const std::string& output) {
  const auto check = [&](const std::string& file) {
    std::error_code absent;
    if (!std::filesystem::equivalent(file, output, absent)) return;
    throw Error(Fault::commandLine, output + ": is an input of this compile; give the pack another name");
  };
  for (const PlannedVolume& volume : plan.volumes) {
    for (const PlannedFrame& frame : volume.frames) std::for_each(frame.files.begin(), frame.files.end(), check);
  }
  for (const EffectDescription& effect : plan.effects) {
    check(effect.file);
    for (const EmitterDescription& emitter : effect.emitters) {
      if (emitter.given) std::for_each(emitter.given->files.begin(), emitter.given->files.end(), check);
    }
  }
}

std::unique_ptr<WritePass> writeAtQuality(const std::string& output, const CompileOptions& options, const Plan& plan,
                                          const Warn& warn) {
  auto pass = std::make_unique<WritePass>(output, options, plan);
  pass->run([&](const Job&, std::size_t, const ImportedGrid& grid) { return goalOf(grid, options.quality); }, warn);
  return pass;
}

}  // namespace

CompileReport compile(const std::vector<std::string>& inputs, const std::string& output, const CompileOptions& options,
                      const Warn& warn) {
  std::optional<tbb::global_control> limit;
  if (options.threads != 0) limit.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  std::set<std::string> read;
  Plan plan = [&] {
    const InputNotes notes(read);
    return planInputs(inputs, options.import, warn);
  }();
  addLevels(plan);
  refuseToReplaceInputs(plan, output);
  if (options.budget.any() && plan.volumes.empty()) {
    throw Error(Fault::commandLine, "a budget needs volumes to spend it on; there are only effects");
  }
  const std::unique_ptr<WritePass> pass =
      options.budget.any() ? fitBudget(output, options, plan, warn) : writeAtQuality(output, options, plan, warn);
  pass->commit();
  CompileReport report = pass->report();
  report.inputs = std::move(read);
  return report;
}

}  // namespace billow::compiler
