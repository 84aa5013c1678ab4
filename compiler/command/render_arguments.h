// The options of `billow render`.
#ifndef BILLOW_COMMAND_RENDER_ARGUMENTS_H
#define BILLOW_COMMAND_RENDER_ARGUMENTS_H

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render_request.h"

namespace billow::command {

// Options as texts, before they are checked; those that are given override the scene's.
struct RenderArguments {
  std::string input, output;
  std::optional<std::string> frames, method, interpolate, size, camera, sunDirection, sunColor, background, up, filter,
      albedo, ambient;
  std::string shadows = "nearest";
  std::optional<std::string> volume;
  std::optional<std::uint32_t> level;
  GridNames grids;
  std::vector<std::string> effects;
  RenderRequest direct;  // what CLI11 checks by itself
  std::optional<float> fieldOfView, exposure, density, fire;
};

void addRenderOptions(CLI::App& command, RenderArguments& arguments);

// What is asked for: the scene, if the input is one, and what the options say in its place.
Checked<RenderRequest> makeRequest(const RenderArguments& arguments);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_ARGUMENTS_H
