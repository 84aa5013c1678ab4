#include "shots.h"

#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <system_error>

#include "command.h"
#include "render_image.h"

namespace billow::viewer {
namespace {

constexpr double kLongest = 10;  // seconds that a picture waits for what is on its way

}  // namespace

bool Shots::due(const Player* player, double now) {
  if (!asked_) return false;
  if (player != nullptr && !player->complete() && now - *asked_ < kLongest) return false;
  asked_.reset();
  return true;
}

command::Checked<std::string> Shots::write(const headless::Picture& picture, const std::string& stem, bool exr,
                                           float exposure) const {
  const char* extension = exr ? ".exr" : ".png";
  const std::filesystem::path folder(folder_);
  std::filesystem::path path = folder / (stem + extension);
  std::error_code ignored;
  for (int i = 2; std::filesystem::exists(path, ignored); ++i) {
    path = folder / fmt::format("{}_{}{}", stem, i, extension);
  }
  try {
    command::writeWhole(path.string(), exr ? command::encodeExr(picture) : command::encodePng(picture, exposure));
  } catch (const std::exception& error) {
    return tl::unexpected(command::Refusal{command::kFile, error.what()});
  }
  return path.string();
}

}  // namespace billow::viewer
