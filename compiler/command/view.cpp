#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "command.h"
#include "render_request.h"
#include "viewer.h"

namespace billow::command {
namespace {

struct ViewArguments {
  viewer::ViewOptions options;
  std::optional<std::string> size, volume, effect;
};

Checked<void> view(const ViewArguments& arguments) {
  viewer::ViewOptions options = arguments.options;
  if (arguments.size) {
    RenderRequest window;
    if (auto done = parseSize(*arguments.size, window); !done) return done;
    options.width = window.width;
    options.height = window.height;
  }
  if (arguments.volume) options.choice = viewer::Choice{false, *arguments.volume};
  if (arguments.effect) options.choice = viewer::Choice{true, *arguments.effect};
  if (!std::filesystem::is_directory(options.screenshots)) {
    return tl::unexpected(Refusal{
        kCommandLine, fmt::format("--screenshots is \"{}\"; expected a folder that is there", options.screenshots)});
  }
  return viewer::view(options);
}

int runView(const ViewArguments& arguments) {
  const auto done = view(arguments);
  if (done) return kDone;
  fmt::print(stderr, "billow: error: {}\n", done.error().message);
  return done.error().code;
}

}  // namespace

void addView(CLI::App& app, Run& run) {
  auto arguments = std::make_shared<ViewArguments>();
  viewer::ViewOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("view", "Play a pack or a scene in a window, with its look to change");
  command->footer(
      "Keys: F1 lists them. Dropping a file on the window opens it.\n"
      "Examples:\n"
      "  billow view fire.blw\n"
      "  billow view fireplace.scene.json --screenshots pictures\n"
      "Exit codes: 0 done, 1 command line, 2 a file cannot be read, 3 invalid pack or scene, 4 no display, no usable "
      "GPU,\nor a GPU failure");
  command->add_option("input", options.path, "A pack, or a scene (*.json, see spec/scene.schema.json)")
      ->required()
      ->type_name("PACK|SCENE.json");
  auto* volume =
      command->add_option("--volume", arguments->volume, "Of a pack, the volume to show (default: the first)");
  command->add_option("--effect", arguments->effect, "Of a pack, the effect to show")->excludes(volume);
  command->add_option("--size", arguments->size, "Of the window, WIDTHxHEIGHT (default 1280x920)");
  command->add_option("--screenshots", options.screenshots, "Folder to which F12 writes pictures")
      ->capture_default_str();
  command->add_option("--gpu-budget", options.gpuBudget, "Bytes of GPU memory at most (default 1 GiB)")
      ->transform(CLI::AsSizeValue(false));
  command
      ->add_option("--frame-budget", options.frameBudget,
                   "Bytes of the GPU budget for frames, which come and go as they play (default: half)")
      ->transform(CLI::AsSizeValue(false));
  command
      ->add_option("--cpu-budget", options.cpuBudget,
                   "Bytes of memory for frames on their way to the GPU at most (default 64 MiB)")
      ->transform(CLI::AsSizeValue(false));
  command->add_option("--device", options.device, "Vulkan device number (default: the fastest kind there is)");
  command->callback([arguments, &run] { run = [arguments] { return runView(*arguments); }; });
}

}  // namespace billow::command
