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

const kBands: Record<string, string> = {
  slip: "rgba(230,180,34,.30)",
  degeneracy: "rgba(169,156,240,.28)",
  failure: "rgba(255,93,117,.30)",
  suspected: "rgba(79,179,255,.16)",
};
/** Columns that are no distance to the reference. */
const kAside = ["born", "distance"];
const kMost = 2000; // points of a curve: more than a screen has pixels

export function curves(app: App, view: View, report: Node): HTMLElement {
  const all = [...app.store.all("errors")];
  if (all.length === 0) return h("section");
  const style = getComputedStyle(document.documentElement);
  const colours = (name: string): string =>
    style.getPropertyValue(`--${name}`).trim() || style.getPropertyValue("--soft");
  const names = [...new Set(all.flatMap(([, e]) => e.names))].filter((n) => !kAside.includes(n));
  const known = all[0][1].against !== "server";
  const lead = known
    ? "Distance of every keyframe to the reference after one rigid alignment. New drift: the error of the odometry's motion over the last 20 s, which shows where drift was born."
    : "Distance of every keyframe to the server's map after one rigid alignment; without a reference nobody knows the error.";
  return h(
    "section",
    {},
    h("h2", {}, "Who drifted where and when"),
    h("p", { class: "lead" }, `${lead} Point at a curve to see the place in the map; click to look there.`),
    h(
      "p",
      { class: "row key" },
      names.map((n) => h("span", {}, swatch(colours(n)), n)),
      bands_key(report),
    ),
    all.map(([name, errors]) => one(app, view, report, name, errors, colours)),
  );
}

function bands_key(report: Node): Child {
  const kinds = new Set(report.list("robots").flatMap((r) => r.list("drift_origins").map((o) => o.s("kind"))));
  if (report.list("robots").some((r) => r.list("explanation.suspected_origins").length > 0)) kinds.add("suspected");
  return [...kinds]
    .filter((kind) => kBands[kind])
    .map((kind) =>
      h("span", {}, swatch(kBands[kind]), kind === "suspected" ? "suspected origin of drift" : `true ${kind}`),
    );
}

function one(
  app: App,
  view: View,
  report: Node,
  name: string,
  errors: Errors,
  colours: (name: string) => string,
): HTMLElement[] {
  const robot = app.robots.find((r) => r.number === errors.robot || r.name === name);
  const own = report.list("robots").find((r) => r.s("name") === (robot?.name ?? name));
  const every = Math.max(1, Math.ceil(errors.columns[0].length / kMost));
  const thin = (column: Float64Array) => Array.from(column).filter((_, i) => i % every === 0);
  const shown = errors.names
    .map((n, i) => ({ name: n, column: thin(errors.columns[i + 1]) }))
    .filter((c) => !kAside.includes(c.name));
  const known = shown.flatMap((c) => c.column).filter((x) => x > 0);
  const log = known.length > 0 && known.reduce((a, b) => Math.max(a, b), 0) > 20 * median(known);
  const plot = new Plot(app, {
    times: thin(errors.columns[0]),
    curves: shown.map(({ name: n, column }) => ({
      label: n,
      colour: colours(n),
      width: n === "server" ? 2.4 : 1.5,
      values: column.map((x) => (Number.isFinite(x) && (!log || x > 0) ? x : null)),
    })),
    unit: "m",
    log,
    bands: own ? bands(own) : [],
    height: 190,
    on_click: (t) => {
      const at = robot && place_at(app, robot.number, t);
      if (at) view.look_at(at);
    },
  });
  return [
    h(
      "h3",
      { class: "line" },
      swatch(css(robot_rgb(robot?.index ?? 0, app.dark))),
      h("b", {}, robot?.name ?? name),
      h(
        "span",
        { class: "seen" },
        `${errors.against === "server" ? "distance to the server's map" : "error"}, m${log ? ", logarithmic" : ""}`,
      ),
    ),
    plot.element,
    ...born(app, errors, thin, colours),
  ];
}

/** Where drift was born: needs no alignment. */
function born(
  app: App,
  errors: Errors,
  thin: (column: Float64Array) => number[],
  colours: (name: string) => string,
): HTMLElement[] {
  const column = errors.names.indexOf("born");
  if (column < 0) return [];
  const values = thin(errors.columns[column + 1]).map((x) => (Number.isFinite(x) ? x : null));
  if (values.every((x) => x === null)) return [];
  const plot = new Plot(app, {
    times: thin(errors.columns[0]),
    curves: [{ label: "new drift", colour: colours("onboard"), values, fill: true }],
    unit: "m",
    log: false,
    height: 100,
  });
  return [h("p", { class: "row key" }, h("span", {}, swatch(colours("onboard")), "new drift over 20 s")), plot.element];
}

function bands(robot: Node): Band[] {
  const of = (nodes: Node[], kind: (n: Node) => string) =>
    nodes.map((n) => ({
      from_s: n.n("from_s") ?? 0,
      until_s: n.n("until_s") ?? 0,
      colour: kBands[kind(n)] ?? kBands.suspected,
    }));
  return [
    ...of(robot.list("explanation.suspected_origins"), () => "suspected"),
    ...of(robot.list("drift_origins"), (n) => n.s("kind")),
  ];
}

const median = (values: number[]): number => [...values].sort((a, b) => a - b)[values.length >> 1] ?? 0;
