// SPDX-License-Identifier: BSD-3-Clause
/** Who drifted where and when: errors over time; the cursor is shown in the 3-D picture. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import type { Errors } from "../schema";
import type { View } from "../scene/view";
import { place_at } from "../scene/where";
import { h, swatch } from "./dom";
import type { Child } from "./dom";
import { Plot } from "./plot";
import type { Band } from "./plot";
import type { Node } from "./report_data";

const kBands: Record<string, string> = { slip: "rgba(230,180,34,.30)", degeneracy: "rgba(169,156,240,.28)", failure: "rgba(255,93,117,.30)", suspected: "rgba(79,179,255,.16)" };
const kMost = 2000; // points of a curve: more than a screen has pixels

export function curves(app: App, view: View, report: Node): HTMLElement {
  const all = [...app.store.all("errors")];
  if (all.length === 0) return h("section");
  const style = getComputedStyle(document.documentElement);
  const colours = (name: string): string => style.getPropertyValue(`--${name}`).trim() || style.getPropertyValue("--soft");
  const names = [...new Set(all.flatMap(([, e]) => e.names))];
  return h("section", {},
    h("h2", {}, "Who drifted where and when"),
    h("p", { class: "lead" }, "Distance of every keyframe to the reference after one rigid alignment. Point at a curve to see the place in the map; click to look there."),
    h("p", { class: "row key" }, names.map((n) => h("span", {}, swatch(colours(n)), n)), bands_key(report)),
    all.map(([name, errors]) => one(app, view, report, name, errors, colours)));
}

function bands_key(report: Node): Child {
  const kinds = new Set(report.list("robots").flatMap((r) => r.list("drift_origins").map((o) => o.s("kind"))));
  if (report.list("robots").some((r) => r.list("explanation.suspected_origins").length > 0)) kinds.add("suspected");
  return [...kinds].filter((kind) => kBands[kind]).map((kind) => h("span", {}, swatch(kBands[kind]), kind === "suspected" ? "suspected origin of drift" : `true ${kind}`));
}

function one(app: App, view: View, report: Node, name: string, errors: Errors, colours: (name: string) => string): HTMLElement[] {
  const robot = app.robots.find((r) => r.name === name || String(r.number) === name);
  const own = report.list("robots").find((r) => r.s("name") === (robot?.name ?? name));
  const every = Math.max(1, Math.ceil(errors.columns[0].length / kMost));
  const thin = (column: Float64Array) => Array.from(column).filter((_, i) => i % every === 0);
  const known = errors.columns.slice(1).flatMap((c) => Array.from(c)).filter((x) => x > 0);
  const log = known.length > 0 && Math.max(...known.slice(0, 50_000)) > 20 * median(known);
  const plot = new Plot(app, {
    times: thin(errors.columns[0]),
    curves: errors.names.map((n, i) => ({ label: n, colour: colours(n), width: n === "server" ? 2.4 : 1.5, values: thin(errors.columns[i + 1]).map((x) => (Number.isFinite(x) && (!log || x > 0) ? x : null)) })),
    unit: "m",
    log,
    bands: own ? bands(own) : [],
    height: 190,
    on_click: (t) => {
      const at = robot && place_at(app, robot.number, t);
      if (at) view.look_at(at);
    },
  });
  return [h("h3", { class: "line" }, swatch(css(robot_rgb(robot?.index ?? 0, app.dark))), h("b", {}, robot?.name ?? name), h("span", { class: "seen" }, `error in m${log ? ", logarithmic" : ""}`)), plot.element];
}

function bands(robot: Node): Band[] {
  const of = (nodes: Node[], kind: (n: Node) => string) => nodes.map((n) => ({ from_s: n.n("from_s") ?? 0, until_s: n.n("until_s") ?? 0, colour: kBands[kind(n)] ?? kBands.suspected }));
  return [...of(robot.list("explanation.suspected_origins"), () => "suspected"), ...of(robot.list("drift_origins"), (n) => n.s("kind"))];
}

const median = (values: number[]): number => [...values].sort((a, b) => a - b)[values.length >> 1] ?? 0;
