// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "tutti/mission/report/colours.hpp"
#include "tutti/mission/report/html_parts.hpp"

namespace tutti::mission {
namespace {

// Estimates: vermillion, blue, green of the Okabe-Ito palette and ink; also told apart by width and dashes.
constexpr std::string_view kStyle = R"css(
:root {
  color-scheme: light dark;
  --paper: #fbfaf7; --card: #ffffff; --ink: #1d2430; --soft: #5d6675; --line: #e3e1da; --grid: #eceae4;
  --onboard: #d55e00; --corrected: #0072b2; --server: #009e73; --reference: #1d2430; --cloud: #3a4454;
  --closure: #b59a00; --accent: #0072b2;
  --slip: #b8860b; --degeneracy: #7b68c8; --failure: #c8203c;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #12161d; --card: #191f28; --ink: #e7e9ee; --soft: #9aa4b2; --line: #2b3340; --grid: #252c37;
    --onboard: #ff8a4c; --corrected: #4fb3ff; --server: #2fd3a0; --reference: #e7e9ee; --cloud: #aab6c8;
    --closure: #e6cf4a; --accent: #4fb3ff;
    --slip: #e6b422; --degeneracy: #a99cf0; --failure: #ff5d75;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); line-height: 1.5;
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
main { max-width: 1240px; margin: 0 auto; padding: 40px 28px 64px; }
h1 { font-size: 34px; line-height: 1.15; margin: 4px 0 8px; letter-spacing: -0.02em; overflow-wrap: anywhere; }
h2 { font-size: 21px; margin: 52px 0 4px; letter-spacing: -0.01em; }
h3 { font-size: 16px; margin: 30px 0 8px; }
.brand { color: var(--accent); font-weight: 650; letter-spacing: 0.14em; text-transform: uppercase; font-size: 12px; margin: 0; }
.lead, .description { color: var(--soft); max-width: 78ch; margin: 0 0 16px; }
.description { font-size: 17px; }
.facts { display: flex; flex-wrap: wrap; gap: 8px; margin: 0 0 24px; padding: 0; list-style: none; }
.facts li { border: 1px solid var(--line); background: var(--card); border-radius: 999px; padding: 3px 12px; font-size: 13px; }
.facts li.input { border-color: var(--accent); color: var(--accent); font-weight: 600; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(260px, 1fr)); gap: 14px; }
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
th { font-weight: 600; color: var(--soft); font-size: 12.5px; text-align: right; padding: 9px 9px 7px; vertical-align: bottom; }
td { text-align: right; padding: 6px 9px; border-top: 1px solid var(--line); white-space: nowrap; }
th.left, td.left { text-align: left; }
tr.group td { border-top: 2px solid var(--line); font-weight: 650; padding-top: 12px; }
tr.chosen td { background: color-mix(in srgb, var(--accent) 9%, transparent); font-weight: 600; }
td .track { display: inline-block; width: 64px; height: 8px; border-radius: 4px; background: var(--grid); vertical-align: middle;
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
.onpicture.scalebar { stroke: #e7e9ee; } svg text.onpicture { fill: #e7e9ee; font-size: 12.5px; paint-order: stroke; stroke: #0e121a; stroke-width: 3.5px; }
.drift { stroke-opacity: 0.42; stroke-width: 8; } rect.drift { stroke: none; fill-opacity: 0.22; }
.drift.slip { stroke: var(--slip); } rect.drift.slip { stroke: none; fill: var(--slip); fill-opacity: 0.55; }
.drift.degeneracy { stroke: var(--degeneracy); } rect.drift.degeneracy { stroke: none; fill: var(--degeneracy); }
.drift.failure { stroke: var(--failure); } rect.drift.failure { stroke: none; fill: var(--failure); }
rect.suspect { fill: none; stroke: var(--failure); stroke-width: 1.6; stroke-dasharray: 5 3; }
.suspect { stroke: var(--failure); stroke-width: 2; stroke-dasharray: 5 3; }
.origin { stroke: var(--accent); stroke-width: 8; } rect.origin { stroke: none; fill: var(--accent); }
.origin.alert { stroke: var(--failure); } rect.origin.alert { stroke: none; fill: var(--failure); }
.origin.along { stroke-opacity: 0.4; stroke-width: 11; }
rect.originbox { fill: none; stroke: #ffffff; stroke-width: 1.6; pointer-events: none; }
.figures + .figures { margin-top: 18px; }
.figures + .scroll { margin: 8px 0 26px; }
.rowline { stroke: #ffffff; stroke-width: 0.5; stroke-opacity: 0.28; }
rect.truth.slip { fill: var(--slip); } rect.truth.degeneracy { fill: var(--degeneracy); } rect.truth.failure { fill: var(--failure); }
.born { stroke: none; fill: var(--onboard); fill-opacity: 0.75; }
.mark.held { stroke: var(--ink); stroke-width: 1.6; stroke-opacity: 0.8; }
.alerts { list-style: none; padding: 0; margin: 0 0 18px; }
.alerts li { border: 1px solid var(--failure); border-left-width: 6px; border-radius: 10px; padding: 8px 14px; margin: 6px 0;
  background: color-mix(in srgb, var(--failure) 8%, var(--card)); }
.alerts li.withdrawn { border-color: var(--line); background: var(--card); color: var(--soft); }
.robots { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 14px; margin: 0 0 14px; }
.robots .card { padding: 18px 22px; } .robots .what { font-size: 16px; font-weight: 650; color: var(--ink); }
.robots .value { font-size: 33px; } .robots .value small { font-size: 19px; white-space: nowrap; }
.robots .what small { font-weight: 400; color: var(--soft); margin-left: 6px; } .robots .value .up { color: var(--onboard); }
.robots .value .down { color: var(--corrected); } .robots .detail b { color: var(--ink); }
.node { stroke-width: 4.4; stroke-opacity: 0.85; }
@media (max-width: 1240px) { table { font-size: 13px; } th, td { padding-left: 6px; padding-right: 6px; } td .track { width: 40px; } }
@media print { main { max-width: none; padding: 0; } figure, .card, .scroll { break-inside: avoid; } }
)css";

/// Every robot's colour, light and dark, and what is drawn in it.
std::string robot_colours() {
  std::string light;
  std::string dark;
  std::string classes;
  for (std::size_t r = 0; r < kRobotColours; ++r) {
    light += fmt::format(" --r{}: {};", r, hex(robot_rgb(r)));
    dark += fmt::format(" --r{}: {};", r, hex(robot_rgb_on_dark(r)));
    classes += fmt::format(
        ".r{0} {{ stroke: var(--r{0}); }} .end.r{0} {{ fill: var(--r{0}); }} .swatch.r{0} {{ background: var(--r{0}); "
        "}}\n",
        r);
  }
  return fmt::format("\n:root {{{} }}\n@media (prefers-color-scheme: dark) {{ :root {{{} }} }}\n{}", light, dark,
                     classes);
}

}  // namespace

std::string report_style() { return robot_colours() + std::string(kStyle); }

}  // namespace tutti::mission
