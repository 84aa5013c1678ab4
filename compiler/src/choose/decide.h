// The decision for one grid in one frame, from what was tried and what is stored already. Serial, in frame order.
#ifndef BILLOW_COMPILER_CHOOSE_DECIDE_H
#define BILLOW_COMPILER_CHOOSE_DECIDE_H

#include <span>
#include <string>

#include "choose/choose.h"
#include "choose/goal.h"
#include "choose/reuse.h"
#include "choose/trials.h"

namespace billow::compiler {

// `unchanged`: by leaf, whether `before` held the very same source there, so that the leaf was not tried; empty: none.
// Such a leaf is tried after all where its stored error has become too large for this frame.
// Throws Error(input), naming `where`, when the goal cannot be had, saying what can.
ChosenGrid decide(const ImportedGrid& grid, const Goal& goal, GridTrials& trials, const FrameBefore& before,
                  std::span<const char> unchanged, const std::string& where);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_DECIDE_H
