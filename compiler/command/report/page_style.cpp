#include "report/page.h"

namespace billow::command {

// No '<' or '&' in either text: both are read as XML too. Colours after Okabe and Ito ("Color Universal Design", 2008),
// lightened on dark; curves differ by their dashes as well.
std::string_view pageStyle() {
  return R"(
:root{color-scheme:light dark;--paper:#f6f6f4;--card:#fff;--ink:#1c2126;--soft:#5b646d;--rule:#e3e4e2;--bad:#a4161a;
--c0:#8a9096;--c1:#0072b2;--c2:#d55e00;--c3:#009e73;--c4:#c4659a;--c5:#b88400;--c6:#6a4fb8;--c7:#3a9bd6;--c8:#7d6127;
--c9:#a61c2e;--c10:#4b7f2f;--c11:#4a5560;--ci:#59636d;--ch:#8b949c;--cm:#bac0c5}
@media (prefers-color-scheme:dark){:root{--paper:#14171a;--card:#1c2024;--ink:#e4e7e9;--soft:#9aa4ad;--rule:#30363b;
--bad:#ff8b8b;--c0:#8d949a;--c1:#56b4e9;--c2:#ec7d3c;--c3:#2cc298;--c4:#e093bf;--c5:#e6b035;--c6:#a993f2;--c7:#8ccbf2;
--c8:#c9a961;--c9:#ef7078;--c10:#93c774;--c11:#aab4bd;--ci:#aab3bb;--ch:#79838c;--cm:#505960}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1560px;padding:1.5rem clamp(.8rem,2.5vw,2.5rem) 3rem;background:var(--paper);
color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;
font-variant-numeric:tabular-nums}
h1{font-size:1.5rem;line-height:1.25;margin:0 0 .2rem;font-weight:650;overflow-wrap:anywhere}
h2{font-size:1.2rem;margin:2.4rem 0 .7rem;font-weight:650;overflow-wrap:anywhere}
h3{font-size:.95rem;margin:0 0 .5rem;font-weight:600}
p{margin:.3rem 0;max-width:75ch}
.note,figcaption,.heads,.scale,dt{color:var(--soft);font-size:.85rem}
.bad{color:var(--bad)}
.card{background:var(--card);border:1px solid var(--rule);border-radius:6px;padding:1rem;min-width:0}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,9.5rem),1fr));gap:.7rem;margin:1.1rem 0 0}
.tiles div{background:var(--card);border:1px solid var(--rule);border-radius:6px;padding:.6rem .9rem}
dt{margin:0}dd{margin:0;overflow-wrap:anywhere}
.tiles dd b{display:block;font-size:1.3rem;font-weight:600;line-height:1.3}
.tiles dd{font-size:.85rem;color:var(--soft)}.tiles dd b{color:var(--ink)}
.pair{display:grid;grid-template-columns:minmax(0,1fr);gap:1rem}
@media (min-width:1000px){.pair{grid-template-columns:minmax(0,5fr) minmax(0,6fr)}
.even{grid-template-columns:minmax(0,1fr) minmax(0,1fr)}}
svg{display:block;max-width:100%}
svg.rate,svg.columns{width:100%;max-width:600px;height:auto;font-size:12.5px}
@media (max-width:560px){svg.rate,svg.columns{font-size:17px}}
svg text{fill:var(--soft)}
.rule{stroke:var(--rule);stroke-width:1}
.curve{fill:none;stroke:currentColor;stroke-width:1.8}
.curve circle{stroke:none;fill:transparent}.curve circle:hover,.curve circle.only{fill:currentColor}
.curve.mix{color:var(--ink);stroke-width:3}
.c2 polyline{stroke-dasharray:8 3}.c3 polyline{stroke-dasharray:2.5 2.5}.c4 polyline{stroke-dasharray:9 3 2 3}
.c5 polyline{stroke-dasharray:5 5}.c6 polyline{stroke-dasharray:12 3}.c7 polyline{stroke-dasharray:1 3}
.c8 polyline{stroke-dasharray:9 2 2 2 2 2}.c9 polyline{stroke-dasharray:4 2}.c10 polyline{stroke-dasharray:14 3 3 3}
.c0{color:var(--c0);fill:var(--c0)}.c1{color:var(--c1);fill:var(--c1)}.c2{color:var(--c2);fill:var(--c2)}
.c3{color:var(--c3);fill:var(--c3)}.c4{color:var(--c4);fill:var(--c4)}.c5{color:var(--c5);fill:var(--c5)}
.c6{color:var(--c6);fill:var(--c6)}.c7{color:var(--c7);fill:var(--c7)}.c8{color:var(--c8);fill:var(--c8)}
.c9{color:var(--c9);fill:var(--c9)}.c10{color:var(--c10);fill:var(--c10)}.c11{color:var(--c11);fill:var(--c11)}
.ci{color:var(--ci);fill:var(--ci)}.ch{color:var(--ch);fill:var(--ch)}.cm{color:var(--cm);fill:var(--cm)}
.curve{fill:none}
.pack{fill:var(--ink);stroke:var(--card);stroke-width:2}.frame{fill:var(--ink);opacity:.45}
.faded{opacity:.12}
.scroll{overflow:auto;max-height:34rem}
table{border-collapse:collapse;width:100%;font-size:.88rem}
caption{text-align:left;color:var(--soft);font-size:.85rem;padding:0 0 .4rem}
th,td{padding:.25rem .6rem;text-align:right;white-space:nowrap;border-bottom:1px solid var(--rule)}
th{font-weight:600;color:var(--soft)}th:first-child,td:first-child,.left{text-align:left}
.scroll th{position:sticky;top:0;background:var(--card)}
th button{all:unset;cursor:pointer}th button:focus-visible{outline:2px solid var(--c1)}
tr.ours{font-weight:600}
.swatch{display:inline-block;width:26px;height:10px;vertical-align:middle;margin-right:.5rem}
tr[data-curve]{cursor:default}
.bricks{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,230px),1fr));gap:1.2rem 1.4rem}
figure{margin:0;min-width:0}
.heads{display:grid;grid-template-columns:1fr 1fr 1fr;column-gap:3.846%}
.brick img{display:block;width:100%;height:auto;image-rendering:pixelated}
.brick img+img{margin-top:.5rem}
.scales{display:grid;grid-template-columns:1fr 1fr;column-gap:3.846%;margin:.4rem 0}
.scale{display:flex;justify-content:space-between;font-size:.75rem;flex-wrap:wrap}
.scale i{flex:1 0 100%;height:6px;border-radius:2px}
.bars{display:grid;gap:.55rem}
.bars p{display:flex;justify-content:space-between;gap:1rem;margin:0;max-width:none;font-size:.88rem}
svg.bar{width:100%;height:16px;background:var(--rule)}
svg.bar rect,svg.columns rect{stroke:var(--card);stroke-width:.6;vector-effect:non-scaling-stroke}
svg.columns.dense rect{stroke:none;shape-rendering:crispEdges}
.legend{display:flex;flex-wrap:wrap;gap:.2rem 1.1rem;list-style:none;margin:0 0 .9rem;padding:0;font-size:.85rem}
.legend .swatch{width:12px;height:12px;margin-right:.35rem}
)";
}

// Sorts the table by the column clicked, and shows the curve whose row is pointed at alone.
std::string_view pageScript() {
  return R"(
"use strict";
(function () {
  function value(row, column) {
    return Number(row.cells[column].dataset.value);
  }
  document.querySelectorAll("th button").forEach(function (button) {
    button.addEventListener("click", function () {
      var head = button.parentElement, body = head.closest("table").tBodies[0];
      var sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      head.parentElement.querySelectorAll("th").forEach(function (other) { other.removeAttribute("aria-sort"); });
      head.setAttribute("aria-sort", sign === 1 ? "ascending" : "descending");
      Array.from(body.rows).sort(function (a, b) {
        var x = value(a, head.cellIndex), y = value(b, head.cellIndex);
        return x === y ? 0 : x > y ? sign : -sign;
      }).forEach(function (row) { body.appendChild(row); });
    });
  });
  document.querySelectorAll("tr[data-curve]").forEach(function (row) {
    function fade(faded) {
      row.closest("section").querySelectorAll("svg.rate .curve").forEach(function (curve) {
        curve.classList.toggle("faded", faded ? curve.dataset.curve !== row.dataset.curve : false);
      });
    }
    row.addEventListener("pointerenter", function () { fade(true); });
    row.addEventListener("pointerleave", function () { fade(false); });
  });
  document.documentElement.dataset.script = "done";
}());
)";
}

}  // namespace billow::command
