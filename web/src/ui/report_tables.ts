// SPDX-License-Identifier: BSD-3-Clause
/** A report's figures as tables. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import { bytes, degrees, figure, metres, milliseconds, share, span } from "../format";
import { h, swatch } from "./dom";
import type { Child } from "./dom";
import { reading } from "./report_data";
import type { Node } from "./report_data";

export const robot_cell = (app: App, name: string): Child => {
  const index = app.robots.find((r) => r.name === name)?.index ?? 0;
  return [swatch(css(robot_rgb(index, app.dark))), " ", name];
};

export function table(head: string[], rows: Child[][], left = 1): HTMLElement {
  const cells = (tag: "th" | "td", row: Child[]) =>
    h(
      "tr",
      {},
      row.map((cell, i) => h(tag, { class: i < left ? "left" : "" }, cell)),
    );
  return h(
    "div",
    { class: "scroll" },
    h(
      "table",
      {},
      h("thead", {}, cells("th", head)),
      h(
        "tbody",
        {},
        rows.map((row) => cells("td", row)),
      ),
    ),
  );
}

export function section(title: string, lead: string, ...body: Child[]): HTMLElement {
  return h("section", {}, h("h2", {}, title), lead ? h("p", { class: "lead" }, lead) : null, body);
}

export function tables(app: App, report: Node): HTMLElement {
  const timing = reading(app.store.get("timing"));
  const out = [
    policies(app, report),
    map_errors(report),
    closures(report),
    frames(app, report),
    radio(app, report),
    time(timing),
    origins(report),
    notes(report),
    settings(app),
  ];
  const version = app.store.get("mission")?.version;
  return h(
    "div",
    {},
    out,
    h(
      "p",
      { class: "empty" },
      `Made by Tutti${version ? ` ${version}` : ""}. Every figure is defined in docs/report.md.`,
    ),
  );
}

/** In brackets when it was scored on too little of the distance. */
const error = (x: number | null, partial: boolean): string => (partial && x !== null ? `(${metres(x)})` : metres(x));

function policies(app: App, report: Node): HTMLElement | null {
  if (report.list("robots").length === 0) return null;
  const rows: Child[][] = [];
  for (const robot of report.list("robots")) {
    const line = (what: Child, at: (key: string) => number | null, partial: boolean, rest: Child[]) =>
      rows.push([
        robot_cell(app, robot.s("name")),
        what,
        error(at("rmse_m"), partial),
        error(at("max_error_m"), partial),
        metres(at("rpe_m")),
        metres(at("rpe_10m_m")),
        share(at("scored_share"), 0),
        ...rest,
      ]);
    line("onboard", (key) => robot.n(`onboard_${key}`), robot.yes("onboard_partial"), ["", "", ""]);
    for (const name of robot.keys("policies")) {
      const policy = robot.at("policies").at(name);
      const chosen = name === report.s("default_policy");
      line(chosen ? h("b", {}, name) : name, (key) => policy.n(key), policy.yes("partial"), [
        metres(policy.n("discontinuity_m")),
        metres(policy.n("agreement_rmse_m")),
        policy.s("constraints"),
      ]);
    }
    line("server", (key) => robot.n(`server_${key}`), robot.yes("server_partial"), ["", "", ""]);
  }
  const interval = report.s("rpe_interval");
  return section(
    "Each robot in figures",
    `RMSE and largest error at keyframes after one rigid alignment${interval ? `; RPE over ${interval}` : ""}. Scored: the share of the way that they were scored on; below 95 % they are in brackets. Jump: the most that correcting changed a motion over 1 s.`,
    table(
      ["robot", "estimate", "RMSE", "largest", "RPE", "RPE, 10 m", "scored", "jump", "to server", "constraints"],
      rows,
      2,
    ),
  );
}

function map_errors(report: Node): HTMLElement | null {
  const rows: Child[][] = [];
  const add = (whose: string, how: string, e: Node) =>
    e.has("mean_m") &&
    rows.push([
      whose,
      how,
      metres(e.n("mean_m")),
      metres(e.n("rms_m")),
      metres(e.n("p95_m")),
      share(e.n("within_10cm")),
      share(e.n("within_30cm")),
      share(e.n("within_1m")),
    ]);
  for (const robot of report.list("robots")) {
    add(robot.s("name"), "onboard odometry", robot.to("map_error.onboard"));
    add(robot.s("name"), "corrected", robot.to("map_error.corrected"));
  }
  add("all robots", "server", report.to("server.map_error"));
  if (rows.length === 0) return null;
  const covered = report.n("server.survey_covered");
  return section(
    "The map against the survey",
    `Distance of the map's points to the true surface.${covered === null ? "" : ` ${share(covered)} of the survey is covered within 0.3 m.`}`,
    table(["map of", "put together by", "mean", "RMS", "95 %", "within 10 cm", "30 cm", "1 m"], rows, 2),
  );
}

function closures(report: Node): HTMLElement {
  const server = report.at("server");
  const line = (what: Child, intra: number, inter: number): Child[] => [what, intra, inter, intra + inter];
  const rows = [
    line(h("b", {}, "in the map"), server.n("closures_accepted_intra") ?? 0, server.n("closures_accepted_inter") ?? 0),
  ];
  for (const r of server.list("rejections")) {
    const nearest =
      r.n("nearest") === null
        ? ""
        : ` (nearest ${figure(r.n("nearest"), r.s("unit"))}, limit ${figure(r.n("limit"), r.s("unit"))})`;
    rows.push(line([`pairs refused: ${r.s("reason")}`, h("small", {}, nearest)], r.n("intra") ?? 0, r.n("inter") ?? 0));
  }
  const check = server.at("closure_check");
  const lead = check.has("checked")
    ? ` Against the reference, ${check.s("wrong")} of ${check.s("checked")} in the map are wrong by more than ${check.s("wrong_m")} m or ${check.s("wrong_deg")}°; the largest errors are ${metres(check.n("max_error_m"))} and ${degrees(check.n("max_error_deg"))}.`
    : "";
  return section(
    "Loop closures",
    `What the server took into the map, and why it refused other pairs of submaps.${lead}`,
    table(["pairs of submaps", "within a robot", "between robots", "together"], rows),
  );
}

function frames(app: App, report: Node): HTMLElement | null {
  const rows = report.list("transforms").map((t): Child[] => {
    const [x, y, z] = t.list("translation_m").map((v) => v.n(""));
    const w = Math.min(1, Math.abs(t.list("quaternion_xyzw")[3]?.n("") ?? 1));
    return [
      robot_cell(app, t.s("to")),
      robot_cell(app, t.s("from")),
      metres(x),
      metres(y),
      metres(z),
      degrees((2 * Math.acos(w) * 180) / Math.PI),
      metres(t.n("error_m")),
      degrees(t.n("error_deg")),
    ];
  });
  return rows.length
    ? section(
        "How the robots' frames lie",
        "Nobody told the server where the robots started.",
        table(["odometry frame of", "seen from", "x", "y", "z", "turned by", "off by", ""], rows, 2),
      )
    : null;
}

function radio(app: App, report: Node): HTMLElement | null {
  const rows: Child[][] = [];
  for (const robot of report.list("robots"))
    for (const t of robot.list("traffic"))
      rows.push([
        robot_cell(app, robot.s("name")),
        `${t.s("from")} to ${t.s("to")}`,
        t.s("kind"),
        t.s("messages"),
        bytes(t.n("largest_message")),
        bytes(t.n("bytes")),
        bytes(t.n("transmitted_bytes")),
        `${bytes(t.n("bytes_per_s"))}/s`,
      ]);
  return rows.length
    ? section(
        "What goes over the radio",
        "Encoded and compressed messages: submaps go up, proxy graphs come down. On the air: without what was never sent, repetitions included.",
        table(["robot", "way", "kind", "messages", "largest", "handed over", "on the air", "mean rate"], rows, 3),
      )
    : null;
}

function time(timing: Node): HTMLElement | null {
  const rows: Child[][] = [];
  const add = (work: string, whom: string, s: Node) =>
    (s.n("count") ?? 0) > 0 &&
    rows.push([work, whom, s.s("count"), milliseconds(s.n("median_ms")), milliseconds(s.n("max_ms"))]);
  for (const p of timing.list("policies"))
    for (const [key, work] of [
      ["comparison", "comparison with the map"],
      ["optimisation", "onboard optimisation"],
      ["update", "whole update"],
    ])
      add(work, `${p.s("robot")}, ${p.s("policy")}`, p.at(key));
  add("verification of one candidate", "server", timing.to("server.verification"));
  add("joint optimisation", "server", timing.to("server.optimisation"));
  add("submap in to proxy graph out", "server", timing.to("server.load.update_latency"));
  if (rows.length === 0) return null;
  const load = timing.n("server.load.share_of_one_core");
  return section(
    "Time",
    `Wall-clock time, ${span(timing.n("wall_s"))} in all.${load === null ? "" : ` In real time the server needs ${share(load)} of one core.`} Machine: ${timing.s("machine") || "-"}.`,
    table(["work", "who", "times", "median", "largest"], rows, 2),
  );
}

/** Where odometry and map part, and what is known to be true. */
function origins(report: Node): HTMLElement | null {
  const rows: Child[][] = [];
  for (const robot of report.list("robots")) {
    for (const o of robot.list("explanation.suspected_origins"))
      rows.push([
        robot.s("name"),
        "suspected",
        span(o.n("from_s")),
        span(o.n("until_s")),
        metres(o.n("translation_m")),
        degrees(((o.n("rotation_rad") ?? 0) * 180) / Math.PI),
        `${figure(o.n("significance"))} x`,
        o.yes("alert") ? "alert" : "",
      ]);
    for (const o of robot.list("drift_origins"))
      rows.push([
        robot.s("name"),
        `true: ${o.s("kind")}`,
        span(o.n("from_s")),
        span(o.n("until_s")),
        metres(o.n("translation_m")),
        degrees(((o.n("rotation_rad") ?? 0) * 180) / Math.PI),
        "",
        "",
      ]);
  }
  return rows.length
    ? section(
        "Where odometry and map differ",
        "Suspected: segments where the robot's comparison says that its odometry left the map. True: only the simulator knows them.",
        table(["robot", "origin", "from", "until", "moved", "turned", "over chance", ""], rows, 2),
      )
    : null;
}

function notes(report: Node): HTMLElement | null {
  const all = report.texts("notes");
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
    : null;
}

function settings(app: App): HTMLElement | null {
  const text = app.store.get("settings");
  return text ? h("details", {}, h("summary", {}, "Effective settings"), h("pre", {}, text)) : null;
}
