// SPDX-License-Identifier: BSD-3-Clause
/** Where a robot's own odometry and the map disagree: by time and scale here, by place in the 3-D picture. */
import type { App } from "../app";
import { css, even, robot_rgb } from "../colours";
import { submap_at } from "../derive";
import { degrees, metres, moment } from "../format";
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
    const state = JSON.stringify([
      app.dark,
      app.options.colour === "disagreement",
      all.map(([name, d]) => [name, d.nodes.length, d.nodes.at(-1)]),
    ]);
    if (state === drawn || (drawn !== "" && performance.now() - last < kRedraw_ms && app.live)) return;
    [drawn, last] = [state, performance.now()];
    for (const plot of plots) plot.destroy();
    plots = [];
    element.replaceChildren(intro(app), ...all.flatMap(([name, d]) => one(app, name, d, plots)));
    if (all.length === 0)
      element.append(h("p", { class: "empty" }, "No robot has compared its odometry with the map yet."));
  };
  app.on((topic) => (topic === "data" || topic === "time" || topic === "options" || topic === "tick") && draw());
  queueMicrotask(draw);
  return element;
}

function intro(app: App): HTMLElement {
  const lit = app.options.colour === "disagreement";
  return h(
    "div",
    {},
    h(
      "p",
      { class: "lead" },
      "How far a robot's own odometry and the map disagree, over what chance explains: above 1 one of them is wrong. Each scale speaks of a distance.",
    ),
    app.world.placed.size === 0
      ? null
      : h(
          "div",
          { class: "row" },
          button(
            lit ? "Colour by robot again" : "Show it in the map",
            () => app.set_options({ colour: lit ? "robot" : "disagreement" }),
            { "aria-pressed": String(lit) },
          ),
        ),
  );
}

const kOrigin = { drift: "rgba(79,179,255,.18)", alert: "rgba(255,93,117,.25)" };

function one(app: App, name: string, d: Disagreement, plots: Plot[]): HTMLElement[] {
  const robot = app.robots.find((r) => r.number === d.robot || r.name === name);
  const scales = d.scale_length_m.map((m, i) => `${i === 0 ? "whole way, " : ""}${metres(m)}`);
  const colours = scales.map((_, i) => css(i === 0 ? [235, 90, 90] : even(1 - i / Math.max(scales.length, 2))));
  const plot = new Plot(app, {
    times: d.nodes.map((n) => n.t),
    curves: scales.map((label, i) => ({
      label,
      colour: colours[i],
      values: d.nodes.map((n) => n.significance[i] ?? null),
    })),
    unit: "×",
    log: false,
    level: 1,
    bands: d.origins.map((o) => ({
      from_s: o.from_s,
      until_s: o.until_s,
      colour: o.alert ? kOrigin.alert : kOrigin.drift,
    })),
    height: 180,
    on_click: (t) => {
      const node = d.nodes.reduce((a, b) => (Math.abs(a.t - t) < Math.abs(b.t - t) ? a : b), d.nodes[0]);
      const id =
        node?.submap ??
        submap_at(
          [...app.store.all("submap", app.at())].map(([, s]) => s),
          d.robot,
          t,
        )?.id;
      if (id) app.select({ kind: "submap", id });
    },
  });
  plots.push(plot);
  return [
    h(
      "h3",
      { class: "line" },
      swatch(css(robot_rgb(robot?.index ?? 0, app.dark))),
      h("b", {}, name),
      h("span", { class: "seen" }, worst(d)),
    ),
    plot.element,
    h(
      "div",
      { class: "row key" },
      scales.map((scale, i) => h("span", {}, swatch(colours[i]), scale)),
      h("span", {}, h("i", { class: "dashed" }), "threshold"),
      d.origins.some((o) => !o.alert) ? h("span", {}, swatch(kOrigin.drift), "drift was born") : null,
      d.origins.some((o) => o.alert) ? h("span", {}, swatch(kOrigin.alert), "more than odometry allows for") : null,
    ),
    ...d.origins.map((o) =>
      h(
        "p",
        { class: "detail" },
        `${moment(o.from_s)} to ${moment(o.until_s)}: odometry left the map by ${metres(o.translation_m)} and ${degrees((o.rotation_rad * 180) / Math.PI)}, ${o.significance.toFixed(1)} times the threshold`,
      ),
    ),
  ];
}

function worst(d: Disagreement): string {
  let most = 0;
  for (const node of d.nodes) for (const x of node.significance) most = Math.max(most, x);
  return most > 1 ? `up to ${most.toFixed(1)} times the threshold` : "nothing beyond chance";
}
