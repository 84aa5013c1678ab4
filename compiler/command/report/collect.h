// Gathers a report while `compare` goes through the frames; memory grows by some hundred bytes a grid and frame.
#ifndef BILLOW_COMMAND_REPORT_COLLECT_H
#define BILLOW_COMMAND_REPORT_COLLECT_H

#include <span>
#include <string>
#include <vector>

#include "billow/format/pack.h"
#include "report/report_data.h"

namespace billow::command {

class ReportCollector {
 public:
  // Keeps the pack by reference.
  ReportCollector(const format::Pack& pack, std::string path, std::vector<std::string> inputs);

  // For compareFrames(): bytes by kind and the worst bricks of one grid in one frame.
  void observe(const ComparedGrid& compared);

  // After the last frame. Imports, once more, the frames that the curves are measured on: for each grid the one with
  // the lowest PSNR, the largest one where all are exact. Throws Error.
  ReportData finish(std::span<const GridRow> rows, const compiler::Plan& plan, const compiler::ImportOptions& options);

 private:
  ReportGrid& gridOf(const GridRow& row);
  void addDisk(const GridRow& row, const format::GridFrame& gridFrame);

  const format::Pack& pack_;
  ReportData data_;
  std::vector<std::uint8_t> pageSeen_, pageInFrame_;  // by page number
};

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_COLLECT_H
