// Reading scene files: the parts that stand in files of their own. All throw json::Error.
#ifndef BILLOW_COMMAND_RENDER_SCENE_H
#define BILLOW_COMMAND_RENDER_SCENE_H

#include <filesystem>

#include "json/value.h"
#include "render_request.h"

namespace billow::command {

// A member's value into the field, where there is one.
void readNumber(const json::Value& object, const char* key, const json::Range& range, float& field);

// Volume and grids of a pack: members "pack", "volume" and "grids".
void readSource(const json::Value& value, const std::filesystem::path& folder, VolumeRequest& volume);
void readLook(const json::Value& value, LookRequest& look);

// {"translate", "rotate": {"axis", "degrees"}, "scale"}, in the order scale, rotate, translate; or {"matrix"}, three
// rows of four. One that can be turned round.
Matrix readTransform(const json::Value& value);

// Members "volumes" and "effects" of a scene.
void readVolumes(const json::Value& list, const std::filesystem::path& folder, RenderRequest& request);
void readEffects(const json::Value& list, const std::filesystem::path& folder, RenderRequest& request);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_SCENE_H
