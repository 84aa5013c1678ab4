// The report as one page that needs nothing else: no network, no script to be read, the same bytes for the same data.
#ifndef BILLOW_COMMAND_REPORT_PAGE_H
#define BILLOW_COMMAND_REPORT_PAGE_H

#include <string>
#include <string_view>

#include "report/report_data.h"

namespace billow::command {

// HTML that is well-formed XML too.
std::string renderPage(const ReportData& data);

// The parts of the page that are the same in every report.
std::string_view pageStyle();
std::string_view pageScript();

// One grid: its curves, what other encodings would have cost, and its worst bricks. `number` is unique in the page.
std::string gridSection(const ReportGrid& grid, std::size_t number, int effort);

// GPU bytes by kind and frame, disk bytes, and the table of every grid and frame.
std::string bytesSection(const ReportData& data);
std::string tableSection(const ReportData& data);
std::string effectsSection(const ReportData& data);  // "" without effects

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_PAGE_H
