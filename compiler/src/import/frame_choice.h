// Which frames of a sequence are wanted, as manifests and effects say it.
#ifndef BILLOW_COMPILER_IMPORT_FRAME_CHOICE_H
#define BILLOW_COMPILER_IMPORT_FRAME_CHOICE_H

#include "json/value.h"
#include "stages.h"

namespace billow::compiler {

// "A", "A-B" or "A-B:STEP", A and B of 0 or more, STEP of 1 or more; passed over where the options have frames already.
// Throws json::Error.
void readFrames(const json::Value& node, ImportOptions& options);

// "error", "hold" or "blank"; passed over where the options have another than error. Throws json::Error.
void readMissing(const json::Value& node, ImportOptions& options);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_FRAME_CHOICE_H
