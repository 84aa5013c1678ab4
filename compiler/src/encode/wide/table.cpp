#include "encode/wide/parts.h"

namespace billow::compiler::BILLOW_WIDE {

extern const WideEncoder kWideEncoder = {activeRange, texelTargets, texelWeights, measure,
                                         arrange,     bc4Spread,    encodeBc4,    fitMode6};

}  // namespace billow::compiler::BILLOW_WIDE
