// SPDX-License-Identifier: BSD-3-Clause
/** Where a robot's own odometry and the map disagree: by time and scale here, by place in the 3-D picture. */
import type { App } from "../app";
import { css, even, robot_rgb } from "../colours";
import type { Disagreement } from "../schema";
import { button, h, swatch } from "./dom";
import { Plot } from "./plot";

const kRedraw_ms = 2000;

export function disagreement_panel(app: App): HTMLElement {
  const element = h("div", { class: "disagreement" });
  let plots: Plot[] = [];
  let drawn = "";
  let last = -Infinity;
  const draw = (): void => {
    if (!element.isConnected || element.hidden) return;
    const all = [...app.store.all("disagreement", app.at())];
    const state = JSON.stringify([app.dark, app.options.colour === "disagreement", all.map(([name, d]) => [name, d.nodes.length, d.nodes.at(-1)])]);
    if (state === drawn || (drawn !== "" && performance.now() - last < kRedraw_ms && app.live)) return;
    [drawn, last] = [state, performance.now()];
    for (const plot of plots) plot.destroy();
    plots = [];
    element.replaceChildren(intro(app), ...all.flatMap(([name, d]) => one(app, name, d, plots)));
    if (all.length === 0) element.append(h("p", { class: "empty" }, "No robot has compared its odometry with the map yet."));
  };
  app.on((topic) => (topic === "data" || topic === "time" || topic === "options" || topic === "tick") && draw());
  queueMicrotask(draw);
  return element;
}

function intro(app: App): HTMLElement {
  const lit = app.options.colour === "disagreement";
  return h("div", {}, h("p", { class: "lead" }, "How far a robot's own odometry and the map disagree, over what chance explains: above 1 one of them is wrong. Each scale speaks of a distance."),
    h("div", { class: "row" }, button(lit ? "Colour by robot again" : "Show it in the map", () => app.set_options({ colour: lit ? "robot" : "disagreement" }), { "aria-pressed": String(lit) })));
}

function one(app: App, name: string, d: Disagreement, plots: Plot[]): HTMLElement[] {
  const robot = app.robots.find((r) => r.name === name || String(r.number) === name);
  const colours = d.scales.map((_, i) => css(i === 0 ? [235, 90, 90] : even(1 - i / Math.max(d.scales.length, 2))));
  const plot = new Plot(app, {
    times: d.nodes.map((n) => n.t),
    curves: d.scales.map((label, i) => ({ label, colour: colours[i], values: d.nodes.map((n) => n.d[i] ?? null) })),
    unit: "",
    log: false,
    level: 1,
    height: 170,
    on_click: (t) => {
      const node = d.nodes.reduce((a, b) => (Math.abs(a.t - t) < Math.abs(b.t - t) ? a : b), d.nodes[0]);
      if (node) app.select({ kind: "submap", id: node.submap });
    },
  });
  plots.push(plot);
  return [
    h("h3", { class: "line" }, swatch(css(robot_rgb(robot?.index ?? 0, app.dark))), h("b", {}, robot?.name ?? name), h("span", { class: "seen" }, worst(d))),
    plot.element,
    h("div", { class: "row key" }, d.scales.map((scale, i) => h("span", {}, swatch(colours[i]), scale)), h("span", {}, h("i", { class: "dashed" }), "threshold")),
  ];
}

function worst(d: Disagreement): string {
  let most = 0;
  for (const node of d.nodes) for (const x of node.d) most = Math.max(most, x);
  return most > 1 ? `up to ${most.toFixed(1)} times the threshold` : "nothing beyond chance";
}
