#include "report/report_data.h"

#include <numeric>

namespace billow::command {

std::uint64_t KindBytes::total() const {
  return std::accumulate(bricks.begin(), bricks.end(), index + headers + masks);
}

double ReportFrame::bits() const {
  if (row.error.sourceVoxels == 0) return 0;
  return static_cast<double>(gpu.total()) * 8 / static_cast<double>(row.error.sourceVoxels);
}

}  // namespace billow::command
