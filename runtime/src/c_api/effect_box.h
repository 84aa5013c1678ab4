// Where an effect's particles are.
#ifndef BILLOW_RUNTIME_C_API_EFFECT_BOX_H
#define BILLOW_RUNTIME_C_API_EFFECT_BOX_H

#include "billow/format/effect.h"
#include "billow/runtime/look.h"

namespace billow::c_api {

// Of all that live at one of sixteen moments spread over the effect's time, in its own world.
runtime::WorldBox effectBox(const format::EffectTables& tables, std::uint32_t effect);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_EFFECT_BOX_H
