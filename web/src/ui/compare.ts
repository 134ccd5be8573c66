// SPDX-License-Identifier: BSD-3-Clause
/** The findings of `tutti compare` between trajectories (docs/compare.md). */
import type { App } from "../app";
import { degrees, figure, metres, moment, span } from "../format";
import type { View } from "../scene/view";
import { h } from "./dom";
import type { Child } from "./dom";
import { curves } from "./report_curves";
import { reading } from "./report_data";
import type { Node } from "./report_data";
import { section, table } from "./report_tables";

const rad = (x: number | null): number | null => (x === null ? null : (x * 180) / Math.PI);
const kMostRows = 100;

export function compare_panel(app: App, view: View): HTMLElement {
  const element = h("div", { class: "report" });
  let drawn = "";
  const draw = (): void => {
    const compare = reading(app.store.get("compare"));
    const state = `${app.dark} ${app.store.version}`;
    if (!app.ready || state === drawn) return;
    drawn = state;
    element.replaceChildren(
      head(compare),
      ...compare.list("robots").map(robot_section),
      curves(app, view, compare),
      notes(compare),
    );
  };
  app.on((topic) => (topic === "data" || topic === "options") && draw());
  queueMicrotask(draw);
  return element;
}

function head(compare: Node): HTMLElement {
  return h(
    "section",
    {},
    h("h2", { class: "title" }, compare.yes("disagree") ? "They disagree" : "Nothing beyond chance"),
    h("p", {}, h("b", {}, "A, which judges: "), compare.s("a")),
    h("p", {}, h("b", {}, "B, which is judged: "), compare.s("b")),
    h(
      "p",
      { class: "lead" },
      compare.n("tolerance_m") === null
        ? ""
        : `A counts as sure to ${metres(compare.n("tolerance_m"))} and ${degrees(compare.n("tolerance_deg"))}.`,
    ),
  );
}

function robot_section(robot: Node): HTMLElement {
  const aligned = (node: Node): Child =>
    node.has("rmse_m")
      ? `${metres(node.n("rmse_m"))} RMSE, ${metres(node.n("max_m"))} at most, ${degrees(node.n("rmse_deg"))}`
      : "-";
  const facts: Child[] = [
    `${robot.s("paired")} of ${robot.s("poses")} poses of B have one of A; ${robot.s("nodes")} nodes along ${metres(robot.n("distance_m"))} and ${span(robot.n("duration_s"))}. After one rigid alignment B is off A by `,
    h("b", {}, aligned(robot.at("aligned"))),
    ".",
  ];
  if (robot.has("fixed.rmse_m"))
    facts.push(
      " With the relative poses below: ",
      h("b", {}, aligned(robot.at("fixed"))),
      `; no motion changes by more than ${metres(robot.n("discontinuity_m"))}.`,
    );
  return section(
    robot.s("name") || "The trajectory",
    "",
    h("p", { class: "lead" }, facts),
    scales(robot),
    origins(robot),
    constraints(robot),
  );
}

function scales(robot: Node): Child {
  const rows = robot
    .list("scales")
    .map((s, i): Child[] => [
      i === 0 ? `whole way, ${metres(s.n("length_m"))}` : metres(s.n("length_m")),
      `${figure(s.n("significance"))} ×`,
      moment(s.n("worst_s")),
      metres(s.n("position_m")),
      degrees(rad(s.n("rotation_rad"))),
      s.n("since_s") === null ? "-" : moment(s.n("since_s")),
    ]);
  return table(["scale", "over threshold", "worst at", "position", "rotation", "above since"], rows);
}

function origins(robot: Node): Child {
  const rows = robot
    .list("origins")
    .map((o): Child[] => [
      moment(o.n("from_s")),
      moment(o.n("until_s")),
      metres(o.n("translation_m")),
      degrees(rad(o.n("rotation_rad"))),
      metres(o.n("scale_length_m") ?? o.n("length_m")),
      `${figure(o.n("significance"))} ×`,
      o.yes("alert") ? "failure?" : "",
    ]);
  return rows.length
    ? [
        h("h3", {}, "Where it was born"),
        table(["from", "until", "moved", "turned", "over", "over threshold", ""], rows, 2),
      ]
    : null;
}

function constraints(robot: Node): Child {
  const all = robot.list("constraints");
  const rows = all.slice(0, kMostRows).map((c): Child[] => {
    const t = c.list("T_from_to.translation_m").map((x) => x.n(""));
    return [moment(c.n("from_s")), moment(c.n("to_s")), metres(t[0]), metres(t[1]), metres(t[2])];
  });
  if (rows.length === 0) return null;
  return [
    h("h3", {}, `Relative poses of A that would fix B: ${all.length}`),
    table(["from", "to", "x", "y", "z"], rows, 2),
    all.length > kMostRows
      ? h("p", { class: "empty" }, `and ${all.length - kMostRows} more; compare.json has all`)
      : null,
  ];
}

function notes(compare: Node): HTMLElement {
  const all = compare.texts("notes");
  return all.length
    ? section(
        "What to keep in mind",
        "",
        h(
          "ul",
          { class: "notes" },
          all.map((note) => h("li", {}, note)),
        ),
      )
    : h("section");
}
