// Rate against distortion: what other choices of encodings would have cost one grid in one frame.
#ifndef BILLOW_COMMAND_REPORT_RATE_CURVES_H
#define BILLOW_COMMAND_REPORT_RATE_CURVES_H

#include "report/report_data.h"

namespace billow::command {

// One curve for each encoding family, with as many bits as each brick needs and constant bricks beside, and one for the
// mix that --psnr chooses, by the compiler's own allocation. Counted: index and headers as the pack has them, and of
// each brick its payload and mask, before equal ones are shared. `frame`: the pack's own bytes and error, where
// `RateCurve::bits` is taken. effort: 0 to 9, of the BC7 encoder. No point where the source's range is 0.
std::vector<RateCurve> measureCurves(const compiler::ImportedGrid& source, const ReportFrame& frame, int effort);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_RATE_CURVES_H
