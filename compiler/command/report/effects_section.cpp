#include <fmt/format.h>

#include "report/html.h"
#include "report/page.h"

namespace billow::command {
namespace {

std::string cell(double value) {
  return fmt::format(R"(<td data-value="{}">{:.4g}</td>)", value, value);
}

// `number` is what names sort by.
std::string tableRow(const EffectRow& row, std::size_t number) {
  const std::string name = nameElement(row.effect) + (row.emitter.empty() ? "" : " / " + nameElement(row.emitter));
  std::string html = fmt::format(R"(<tr{}><td data-value="{}">{}</td><td data-value="{}">{}</td>)",
                                 row.sound() ? "" : R"( class="bad")", number, name, number, row.part);
  if (!row.sound()) return html + fmt::format(R"(<td colspan="4">{}</td></tr>)", escapeText(row.problem)) + "\n";
  html += cell(row.largest) + cell(row.rmse) + cell(row.maxError);
  return html + (row.asked ? cell(*row.asked) : R"(<td data-value="0"></td>)") + "</tr>\n";
}

}  // namespace

std::string effectsSection(const ReportData& data) {
  if (data.effects.empty()) return "";
  std::string html =
      R"(<section aria-labelledby="effects"><h2 id="effects">Every effect</h2><div class="card scroll" tabindex="0" role="region" aria-labelledby="effects"><table class="frames"><thead><tr>)";
  for (const char* name : {"effect", "part", "largest value", "RMSE", "max error", "asked for"}) {
    html += fmt::format(R"(<th scope="col"><button type="button">{}</button></th>)", name);
  }
  html += "</tr></thead><tbody>\n";
  for (std::size_t i = 0; i < data.effects.size(); ++i) html += tableRow(data.effects[i], i);
  return html +
         R"(</tbody></table></div><p class="note">Tables, maps and tracks against their descriptions, each in its own unit. Numbers are kept exactly or not at all.</p></section>)";
}

}  // namespace billow::command
