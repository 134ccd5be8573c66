// SPDX-License-Identifier: BSD-3-Clause
/** The story of a mission afterwards: what was corrected with how little, the map beside the survey, who drifted where and when, tables. */
import type { App } from "../app";
import { bytes, many, metres, moment, share, span } from "../format";
import type { View } from "../scene/view";
import { beside } from "./beside";
import { h } from "./dom";
import type { Child } from "./dom";
import { curves } from "./report_curves";
import { followed, reading } from "./report_data";
import type { Node } from "./report_data";
import { robot_cell, tables } from "./report_tables";

export function report_panel(app: App, view: View): HTMLElement {
  const element = h("div", { class: "report" });
  let drawn = "";
  const draw = (): void => {
    const report = reading(app.store.get("report"));
    const state = `${app.dark} ${app.store.version}`;
    if (!app.ready || state === drawn) return;
    drawn = state;
    element.replaceChildren(headline(app, report), beside(app, view), curves(app, view, report), tables(app, report));
  };
  app.on((topic) => (topic === "data" || topic === "options") && draw());
  queueMicrotask(draw);
  return element;
}

function headline(app: App, report: Node): HTMLElement {
  const robots = report.list("robots");
  const way = robots.reduce((sum, r) => sum + (r.n("distance_m") ?? 0), 0);
  const facts = [
    report.s("input"),
    `${many(robots.length, "robot")}, ${many(report.n("server.components") ?? 0, "map")}`,
    `${metres(way)} in ${span(report.n("duration_s"))}`,
    report.s("default_policy") && `policy ${report.s("default_policy")}`,
    report.has("seed") && `seed ${report.s("seed")}`,
  ];
  const measured = robots.some((r) => r.has("onboard_rmse_m"));
  return h(
    "section",
    {},
    h("h2", { class: "title" }, report.s("mission")),
    h("p", { class: "lead" }, report.s("description")),
    h(
      "p",
      { class: "chips-line" },
      facts.filter((f) => f).map((f) => h("span", { class: "chip" }, f as string)),
    ),
    report.texts("warnings").map((w) => h("p", { class: "alert warning" }, h("b", {}, "Warning: "), w)),
    failures(report),
    h(
      "h3",
      {},
      measured
        ? "Error of every robot, RMSE: by its own odometry → corrected"
        : "Every robot's distance to the server's map, RMSE: by its own odometry → corrected. Without a reference nobody knows the error",
    ),
    h(
      "div",
      { class: "cards wide" },
      robots.map((r) => robot_card(app, report, r)),
    ),
    h("div", { class: "cards" }, map_cards(report)),
  );
}

/** Where robots or the server report that localisation failed. */
function failures(report: Node): Child {
  const lines: Child[] = [];
  for (const robot of report.list("robots"))
    for (const alert of robot.list("alerts")) {
      const gone = alert.n("withdrawn_s");
      lines.push(
        h(
          "p",
          { class: `alert ${gone === null ? "error" : "info seen"}` },
          h("b", {}, robot.s("name")),
          `: localisation left the map by ${metres(alert.n("translation_m"))} between ${moment(alert.n("from_s"))} and ${moment(alert.n("until_s"))}; noticed at ${moment(alert.n("known_since_s"))}`,
          gone === null ? "" : `, withdrawn at ${moment(gone)}`,
        ),
      );
    }
  for (const failed of report.list("server.failed_odometry"))
    lines.push(
      h(
        "p",
        { class: "alert error" },
        h("b", {}, failed.s("robot")),
        `: closures contradict its odometry by ${metres(failed.n("error_m"))} between ${moment(failed.n("from_s"))} and ${moment(failed.n("until_s"))}`,
      ),
    );
  return lines;
}

function card(what: Child, value: Child, detail: Child): HTMLElement {
  return h(
    "div",
    { class: "card" },
    h("p", { class: "what" }, what),
    h("p", { class: "value" }, value),
    h("p", { class: "detail" }, detail),
  );
}

/** A figure for headlines: none when it was scored on too little of the distance. */
const headline_m = (node: Node, key: string, partial: string): string =>
  node.yes(partial) ? "-" : metres(node.n(key));

/** Without a reference, an estimate's curve is its distance to the server's. */
function off_server_m(app: App, robot: Node, estimate: string): number | null {
  const errors = app.store.get("errors", Infinity, robot.s("name"));
  const column = errors?.columns[errors.names.indexOf(estimate) + 1].filter(Number.isFinite);
  if (errors?.against !== "server" || !column?.length) return null;
  return Math.sqrt(column.reduce((sum, x) => sum + x * x, 0) / column.length);
}

function robot_card(app: App, report: Node, robot: Node): HTMLElement {
  const policy = followed(report, robot);
  const value: Child = robot.has("onboard_rmse_m")
    ? [
        h("span", { class: "up" }, headline_m(robot, "onboard_rmse_m", "onboard_partial")),
        " → ",
        h("span", { class: "down" }, headline_m(policy, "rmse_m", "partial")),
        h("small", {}, ` server ${headline_m(robot, "server_rmse_m", "server_partial")}`),
      ]
    : [
        h("span", { class: "up" }, metres(off_server_m(app, robot, "onboard"))),
        " → ",
        h("span", { class: "down" }, metres(policy.n("agreement_rmse_m") ?? off_server_m(app, robot, "corrected"))),
      ];
  const constraints = policy.n("constraints") ?? 0;
  const factors = robot.n("odometry_factors") ?? 0;
  const duration = robot.n("duration_s") ?? 0;
  const rate = (key: string) =>
    `${bytes(robot.n(key))} (${duration > 0 ? `${bytes((robot.n(key) ?? 0) / duration)}/s` : "-"})`;
  const detail: Child[] = [
    h("b", {}, constraints),
    ` constraints beside ${factors} odometry factors (${share(factors ? constraints / factors : null)}); `,
    h("b", {}, rate("bytes_down")),
    " received, ",
    rate("bytes_up"),
    " sent",
  ];
  if (robot.has("map_error.corrected"))
    detail.push(
      h("br"),
      "its map, mean distance to the survey: ",
      h("b", {}, `${metres(robot.n("map_error.onboard.mean_m"))} → ${metres(robot.n("map_error.corrected.mean_m"))}`),
    );
  for (const [what, node, key, scored, flag] of [
    ["onboard", robot, "onboard_rmse_m", "onboard_scored_share", "onboard_partial"],
    ["corrected", policy, "rmse_m", "scored_share", "partial"],
    ["server", robot, "server_rmse_m", "server_scored_share", "server_partial"],
  ] as const)
    if (node.yes(flag))
      detail.push(
        h("br"),
        `partial, scored on ${share(node.n(scored), 0)} of its trajectory only: ${what} (${metres(node.n(key))})`,
      );
  return card(
    [robot_cell(app, robot.s("name")), h("small", {}, ` ${metres(robot.n("distance_m"))} in ${span(duration)}`)],
    value,
    detail,
  );
}

function map_cards(report: Node): HTMLElement[] {
  const server = report.at("server");
  const partial = server.yes("partial");
  const out: HTMLElement[] = [];
  if (server.has("rmse_m"))
    out.push(
      card(
        "Error of the server's map, RMSE",
        partial ? "-" : metres(server.n("rmse_m")),
        partial
          ? `partial, scored on ${share(server.n("scored_share"), 0)}: (${metres(server.n("rmse_m"))})`
          : `all robots in one alignment; largest ${metres(server.n("max_error_m"))}`,
      ),
    );
  if (server.has("map_error.mean_m"))
    out.push(
      card(
        "Joint map off the survey, mean",
        metres(server.n("map_error.mean_m")),
        `95 % of ${many(server.n("map_error.points") ?? 0, "point")} within ${metres(server.n("map_error.p95_m"))}`,
      ),
    );
  out.push(
    card(
      "Loop closures in the map",
      server.s("closures_accepted") || "-",
      `${server.n("closures_accepted_inter") ?? 0} between robots; ${many(server.n("closures_rejected") ?? 0, "pair")} of submaps refused`,
    ),
  );
  const updates = report.list("robots").reduce((sum, r) => sum + (r.n("updates") ?? 0), 0);
  if (updates > 0)
    out.push(card("Broadcasts answered", String(updates), `by ${many(report.list("robots").length, "robot")}`));
  return out;
}
