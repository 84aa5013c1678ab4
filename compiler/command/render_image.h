// Pictures as files, written whole or not at all.
#ifndef BILLOW_COMMAND_RENDER_IMAGE_H
#define BILLOW_COMMAND_RENDER_IMAGE_H

#include <string>

#include "billow/headless/headless.h"

namespace billow::command {

// Half-float RGBA, premultiplied and linear, and depth Z in single floats (distance along the view's axis).
// Throws std::exception when OpenEXR cannot encode it.
std::string encodeExr(const headless::Picture& picture);

// Tone-mapped 8-bit sRGB; `exposure` in stops. The picture must be opaque or is shown over black.
std::string encodePng(const headless::Picture& picture, float exposure);

// Writes to a temporary name beside `path`, then renames. Throws std::system_error with the path.
void writeWhole(const std::string& path, const std::string& bytes);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_IMAGE_H
