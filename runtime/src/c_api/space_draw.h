// Draws in a space of metavoxels.
#ifndef BILLOW_RUNTIME_C_API_SPACE_DRAW_H
#define BILLOW_RUNTIME_C_API_SPACE_DRAW_H

#include "c_api/context.h"

namespace billow::c_api {

Outcome<void> drawInSpace(BillowSpace& space, VkCommandBuffer commands, const BillowDrawInfo& draw);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_SPACE_DRAW_H
