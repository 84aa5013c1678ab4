// A pack with the least error that fits a budget: one Lagrange multiplier for all bricks of all frames and grids, and
// where two budgets are given the balance of both kinds of bytes.
#ifndef BILLOW_COMPILER_PASSES_BUDGET_H
#define BILLOW_COMPILER_PASSES_BUDGET_H

#include <memory>
#include <string>

#include "passes/write_pass.h"

namespace billow::compiler {

// Errors of different grids are compared by the squares of their ranges over the whole sequence (of voxels' values, or
// by Metric::depth of line integrals), every voxel (or line) alike. A first pass surveys what each grid frame takes at
// each multiplier; the multiplier at which the sum fits writes the pack; what the pack takes corrects the sum, and
// again, until it fits and little is left: two to four passes as a rule, ten at most. Two budgets are tried as the
// GPU's alone first; where that does not fit the disk, both together, as many passes again. Returns the pass that fits,
// not committed. Throws Error(input), naming the least that is possible, when none does.
std::unique_ptr<WritePass> fitBudget(const std::string& output, const CompileOptions& options, const Plan& plan,
                                     const Warn& warn);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PASSES_BUDGET_H
