// SPDX-License-Identifier: BSD-3-Clause
/** Legend of colours and lines, in a corner of the picture. It folds, and is never more than a third of the picture. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import { LIMITS } from "../limits";
import { memory } from "../options";
import { legend_of } from "../scene/dress";
import type { Legend } from "../scene/dress";
import { palette_of } from "../scene/picture";
import type { View } from "../scene/view";
import { button, h, panel, swatch } from "./dom";
import type { Child } from "./dom";

/** Its state as this browser remembers it; "": nobody has chosen. */
type Fold = "folded" | "open" | "";

export function legend(app: App, view: View): HTMLElement {
  let chosen = memory.read<Fold>("legend", "");
  const folds = (entries: number): boolean =>
    chosen === "" ? entries > LIMITS.dense_robots || view.element.clientWidth < LIMITS.narrow_px : chosen === "folded";
  const heading = (title: string, folded: boolean): Child =>
    button(
      `${folded ? "▸" : "▾"} ${title}`,
      () => {
        chosen = folded ? "open" : "folded";
        memory.write("legend", chosen);
        app.say("options");
      },
      { class: "plain", key: "legend", "aria-expanded": String(!folded) },
    );
  return panel(app, ["options", "data", "time", "cloud", "me"], { class: "legend-box" }, () => {
    const { placed } = app.world;
    if (placed.size === 0 && app.is_locked())
      return [
        h("p", { class: "empty" }, "Log in (above) with an operator's or a viewer's credential to see the mission."),
      ];
    if (placed.size === 0 && (app.live || app.robots.length === 0))
      return [h("p", { class: "empty" }, app.ready ? "No submap is in the map yet." : "Waiting for the map …")];
    const { title, entries, scale } = placed.size === 0 ? of_robots(app) : legend_of(app.world, view.dressing());
    const folded = folds(entries.length);
    const many = entries.length > LIMITS.dense_robots;
    return [
      heading(many ? `${title} (${entries.length})` : title, folded),
      folded
        ? null
        : h(
            "div",
            { class: `entries${many ? " many" : ""}` },
            scale ? gradient(scale) : null,
            entries.map((e) => h("span", { class: "entry", title: e.label }, swatch(e.colour), e.label)),
            lines(app),
          ),
      app.clouds.waiting > 0 ? h("span", { class: "entry soft" }, `${app.clouds.waiting} clouds to come`) : null,
    ];
  });
}

/** A comparison has robots and no submaps. */
const of_robots = (app: App): Legend => ({
  title: "robot",
  entries: app.robots.map((r) => ({ colour: css(robot_rgb(r.index, app.dark)), label: r.name })),
  scale: null,
});

function gradient(scale: NonNullable<Legend["scale"]>): Child {
  const ground = `linear-gradient(90deg,${scale.colours.join()})`;
  return h(
    "span",
    { class: "scale" },
    h("span", {}, scale.low),
    h("span", { class: "gradient", style: { background: ground } }, scale.middle ? h("i", {}, scale.middle) : null),
    h("span", {}, scale.high),
  );
}

/** The meaning of the lines that are drawn now. */
function lines(app: App): Child {
  const palette = palette_of(app.dark);
  const { layers } = app.options;
  const states = new Set([...app.store.all("closure", app.at())].map(([, c]) => c.state));
  const line = (colour: string, label: string, style = "solid") =>
    h(
      "span",
      { class: "entry" },
      h("i", { class: "stroke", style: { "border-top-color": colour, "border-top-style": style } }),
      label,
    );
  const kinds = layers.estimates
    ? new Set([...app.store.all("trajectory")].map(([name]) => name.split("/")[1]))
    : new Set<string>();
  return [
    layers.accepted && states.has("accepted")
      ? [line(palette.accepted, "closure between robots"), line(palette.within, "closure within a robot")]
      : null,
    layers.candidate && states.has("candidate") ? line(palette.candidate, "closure waiting", "dashed") : null,
    layers.rejected && states.has("rejected") ? line(palette.rejected, "closure refused", "dotted") : null,
    app.shows_ghost() ? line(palette.ghost, "before the correction", "dashed") : null,
    [...kinds]
      .filter((k) => k !== "server" || app.world.placed.size === 0)
      .map((k) => line(palette.soft, k, k === "onboard" ? "dashed" : k === "reference" ? "dotted" : "solid")),
  ];
}
