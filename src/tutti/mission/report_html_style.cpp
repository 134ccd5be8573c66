// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report_html_parts.hpp"

namespace tutti::mission {

// Estimates: vermillion, blue, green of the Okabe-Ito palette and ink; robots: hues between those. All keep apart
// under the common colour deficiencies and are also told apart by width and dashes.
std::string_view report_style() {
  return R"css(
:root {
  color-scheme: light dark;
  --paper: #fbfaf7; --card: #ffffff; --ink: #1d2430; --soft: #5d6675; --line: #e3e1da; --grid: #eceae4;
  --onboard: #d55e00; --corrected: #0072b2; --server: #009e73; --reference: #1d2430; --cloud: #3a4454;
  --closure: #b59a00; --accent: #0072b2;
  --r0: #0f6fb5; --r1: #c2410c; --r2: #0b8f6a; --r3: #8b3fa8; --r4: #a67c00; --r5: #1b9bb8; --r6: #c2397a; --r7: #5f7d2a;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #12161d; --card: #191f28; --ink: #e7e9ee; --soft: #9aa4b2; --line: #2b3340; --grid: #252c37;
    --onboard: #ff8a4c; --corrected: #4fb3ff; --server: #2fd3a0; --reference: #e7e9ee; --cloud: #aab6c8;
    --closure: #e6cf4a; --accent: #4fb3ff;
    --r0: #4fb3ff; --r1: #ff8a4c; --r2: #2fd3a0; --r3: #c58be0; --r4: #e0b541; --r5: #5fd3ea; --r6: #f47fb5; --r7: #a9c86a;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); line-height: 1.5;
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
main { max-width: 1240px; margin: 0 auto; padding: 40px 28px 64px; }
h1 { font-size: 34px; line-height: 1.15; margin: 4px 0 8px; letter-spacing: -0.02em; overflow-wrap: anywhere; }
h2 { font-size: 21px; margin: 52px 0 4px; letter-spacing: -0.01em; }
.brand { color: var(--accent); font-weight: 650; letter-spacing: 0.14em; text-transform: uppercase; font-size: 12px; margin: 0; }
.lead, .description { color: var(--soft); max-width: 78ch; margin: 0 0 16px; }
.description { font-size: 17px; }
.facts { display: flex; flex-wrap: wrap; gap: 8px; margin: 0 0 24px; padding: 0; list-style: none; }
.facts li { border: 1px solid var(--line); background: var(--card); border-radius: 999px; padding: 3px 12px; font-size: 13px; }
.facts li.input { border-color: var(--accent); color: var(--accent); font-weight: 600; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(330px, 1fr)); gap: 14px; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 14px; padding: 16px 18px; }
.card .what { color: var(--soft); font-size: 13px; margin: 0; }
.card .value { font-size: 28px; line-height: 1.3; font-weight: 650; letter-spacing: -0.02em; margin: 2px 0;
  font-variant-numeric: tabular-nums; }
.card .value small { font-size: 18px; font-weight: 500; color: var(--soft); }
.card .detail { color: var(--soft); font-size: 13px; margin: 0; }
.figures { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 18px; }
@media (max-width: 820px) { .figures { grid-template-columns: minmax(0, 1fr); } }
figure { display: flex; flex-direction: column; margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 14px; padding: 14px 16px 12px; }
figure.wide { grid-column: 1 / -1; }
figure svg { display: block; width: 100%; height: auto; margin: auto 0; }
figcaption { font-size: 13px; color: var(--soft); margin: 0 0 8px; }
figcaption b { color: var(--ink); font-size: 15px; margin-right: 8px; }
.legend { display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 0 0 12px; font-size: 13px; color: var(--soft); }
.legend span { display: inline-flex; align-items: center; gap: 7px; }
.legend svg { width: 26px; height: 10px; }
.legend .edge, .legend .intra, .legend .inter, .legend .closure { stroke-width: 2; stroke-opacity: 0.9; }
.colourbar { max-width: 560px; margin: -6px 0 10px; } .colourbar svg { display: block; width: 100%; }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 14px; padding: 4px 14px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th { font-weight: 600; color: var(--soft); font-size: 12.5px; text-align: right; padding: 9px 10px 7px; white-space: nowrap; }
td { text-align: right; padding: 6px 10px; border-top: 1px solid var(--line); white-space: nowrap; }
th.left, td.left { text-align: left; }
tr.group td { border-top: 2px solid var(--line); font-weight: 650; padding-top: 12px; }
tr.chosen td { background: color-mix(in srgb, var(--accent) 9%, transparent); font-weight: 600; }
td .track { display: inline-block; width: 130px; height: 8px; border-radius: 4px; background: var(--grid); vertical-align: middle;
  margin-right: 12px; overflow: hidden; text-align: left; }
td .bar { display: block; height: 8px; border-radius: 4px; background: var(--accent); min-width: 2px; }
td .bar.onboard { background: var(--onboard); } td .bar.server { background: var(--server); }
td .bar.other { background: var(--soft); opacity: 0.55; }
.swatch { display: inline-block; width: 10px; height: 10px; border-radius: 3px; margin-right: 8px; }
.notes { border-left: 3px solid var(--accent); padding: 2px 0 2px 18px; margin: 8px 0 0; max-width: 84ch; }
.notes li { margin: 4px 0; }
ul.notes { list-style: none; }
details { margin-top: 44px; } summary { cursor: pointer; font-weight: 600; }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 14px; padding: 16px; overflow-x: auto;
  font: 12.5px/1.5 ui-monospace, "DejaVu Sans Mono", Menlo, monospace; }
footer { margin-top: 36px; color: var(--soft); font-size: 13px; }
svg text { fill: var(--soft); font: 11.5px system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
svg text.name { fill: var(--ink); font-size: 12.5px; font-weight: 600; paint-order: stroke; stroke: var(--card); stroke-width: 3.5px; }
svg path { fill: none; stroke-linecap: round; stroke-linejoin: round; }
.gridline { stroke: var(--grid); stroke-width: 1; }
.baseline { stroke: var(--soft); stroke-width: 1; stroke-opacity: 0.6; }
.scalebar { stroke: var(--soft); stroke-width: 1.5; }
.onboard { stroke: var(--onboard); stroke-width: 1.4; }
.corrected { stroke: var(--corrected); stroke-width: 1.7; }
.server { stroke: var(--server); stroke-width: 5; stroke-opacity: 0.38; }
.curve.server { stroke-width: 2.4; stroke-opacity: 0.75; }
.reference { stroke: var(--reference); stroke-width: 1.3; stroke-dasharray: 0.5 5; stroke-opacity: 0.9; }
path.cloud1 { fill: var(--cloud); fill-opacity: 0.10; } path.cloud2 { fill: var(--cloud); fill-opacity: 0.24; }
path.cloud3 { fill: var(--cloud); fill-opacity: 0.42; }
path.cloudkey { stroke: var(--cloud); stroke-width: 7; stroke-opacity: 0.35; }
.route { stroke-width: 2; }
.edge { stroke: var(--soft); stroke-width: 0.6; stroke-opacity: 0.35; }
.intra { stroke: var(--soft); stroke-width: 0.9; stroke-opacity: 0.65; }
.closure { stroke: var(--soft); stroke-width: 1.2; stroke-opacity: 0.8; stroke-dasharray: 1 3; }
.inter { stroke: var(--closure); stroke-width: 1.1; stroke-opacity: 0.85; }
.small { stroke: var(--r5); stroke-width: 2.2; } .mid { stroke: var(--r4); stroke-width: 2.2; }
.large { stroke: var(--r6); stroke-width: 2.2; } .other { stroke: var(--r3); stroke-width: 2.2; }
.constraint { stroke-opacity: 0.85; }
.held { stroke: var(--accent); stroke-width: 1.7; }
.hover { fill: transparent; stroke: none; } .hover:hover { fill: var(--accent); fill-opacity: 0.45; }
.start { fill: var(--card); stroke-width: 2; } .seen { fill: none; stroke-width: 2; }
.cell { stroke: none; }
.r0 { stroke: var(--r0); } .r1 { stroke: var(--r1); } .r2 { stroke: var(--r2); } .r3 { stroke: var(--r3); }
.r4 { stroke: var(--r4); } .r5 { stroke: var(--r5); } .r6 { stroke: var(--r6); } .r7 { stroke: var(--r7); }
.end.r0 { fill: var(--r0); } .end.r1 { fill: var(--r1); } .end.r2 { fill: var(--r2); } .end.r3 { fill: var(--r3); } 
.end.r4 { fill: var(--r4); } .end.r5 { fill: var(--r5); } .end.r6 { fill: var(--r6); } .end.r7 { fill: var(--r7); } 
.node { stroke-width: 4.4; stroke-opacity: 0.85; }
.swatch.r0 { background: var(--r0); } .swatch.r1 { background: var(--r1); } .swatch.r2 { background: var(--r2); }
.swatch.r3 { background: var(--r3); } .swatch.r4 { background: var(--r4); } .swatch.r5 { background: var(--r5); }
.swatch.r6 { background: var(--r6); } .swatch.r7 { background: var(--r7); }
@media (max-width: 1120px) { table { font-size: 13px; } th, td { padding-left: 6px; padding-right: 6px; } th { white-space: normal; } td .track { width: 60px; } }
@media print { main { max-width: none; padding: 0; } figure, .card, .scroll { break-inside: avoid; } }
)css";
}

}  // namespace tutti::mission
