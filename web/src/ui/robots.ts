// SPDX-License-Identifier: BSD-3-Clause
/** One card per robot: is it there, what can it do now, what does it still keep. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import { maps_in_use, silent_after } from "../derive";
import type { RobotView } from "../derive";
import { bytes, many, metres, span } from "../format";
import { LIMITS, TIMES } from "../limits";
import type { MapVersion } from "../schema";
import type { View } from "../scene/view";
import { position_of } from "../scene/where";
import { button, h, held, icon, panel, swatch } from "./dom";
import type { Child } from "./dom";

export function robots_panel(app: App, view: View): HTMLElement {
  const filter = { words: "" };
  const heading = panel(app, ["data", "time", "tick"], {}, () => {
    search.hidden = app.robots.length <= LIMITS.dense_robots;
    return [h("h2", {}, "Robots", h("small", {}, summary(app.robots)))];
  });
  const search = h("input", {
    type: "search",
    placeholder: "Search: a name, silent, trouble, …",
    "aria-label": "Search robots",
    hidden: true,
  });
  search.addEventListener("input", () => {
    filter.words = search.value.toLowerCase().trim();
    app.say("options");
  });
  const list = panel(app, ["data", "selection", "time", "tick", "options", "tool"], {}, () => {
    const dense = app.robots.length > LIMITS.dense_robots;
    const found = ordered(app).filter((robot) => !dense || words_of(robot).includes(filter.words));
    return [
      app.robots.length === 0
        ? h("p", { class: "empty" }, "No robot was heard yet.")
        : found.length === 0
          ? h("p", { class: "empty" }, "None fits the search.")
          : null,
      found.slice(0, LIMITS.rows).map((robot) => card(app, view, robot, dense)),
      found.length > LIMITS.rows
        ? h("p", { class: "empty" }, `and ${found.length - LIMITS.rows} more: search to see them`)
        : null,
      maps(app.robots),
      workers(app),
    ];
  });
  return h("div", { class: "robots" }, heading, search, list);
}

const map_name = ({ map_id, map_version }: MapVersion): string =>
  map_id ? `version ${map_version} of map ${map_id}` : "no map yet";

/** Who is on which map that does not move: said where they are not all on one. */
function maps(robots: RobotView[]): Child {
  const used = maps_in_use(robots);
  if (used.length < 2) return null;
  return h(
    "p",
    { class: "maps" },
    used.map(({ map, names }) =>
      h("span", { class: "detail", title: names.join(", ") }, `${many(names.length, "robot")} in ${map_name(map)}`),
    ),
  );
}

const is_away = (robot: RobotView): boolean => robot.presence === "silent" || robot.presence === "lost";
const is_troubled = ({ status }: RobotView): boolean =>
  status !== null &&
  (status.trouble !== "" || status.conflict !== "" || (status.battery_percent !== null && status.battery_percent < 15));

/** The words that the search looks at. */
function words_of(robot: RobotView): string {
  const { status } = robot;
  return [
    robot.name,
    is_away(robot) ? "silent" : robot.presence,
    is_troubled(robot) ? "trouble" : "",
    status?.trouble,
    status?.conflict,
  ]
    .join(" ")
    .toLowerCase();
}

/** The silent stand first, the longest silent before all, then the troubled; in the phase of recovery, those with nothing to send last. */
function ordered(app: App): RobotView[] {
  const rank = (r: RobotView): number =>
    is_away(r) ? -(r.silent_s ?? 0) : is_troubled(r) ? 1 : app.phase === "recover" && r.drain.state === "empty" ? 3 : 2;
  return [...app.robots].sort((a, b) => rank(a) - rank(b));
}

function summary(robots: RobotView[]): string {
  const n = (presence: RobotView["presence"][]) => robots.filter((r) => presence.includes(r.presence)).length;
  return [
    [n(["here"]), "here"],
    [n(["silent", "lost"]), "silent"],
    [n(["finished"]), "finished"],
  ]
    .filter(([count]) => count !== 0)
    .map(([count, word]) => `${count} ${word}`)
    .join(", ");
}

function card(app: App, view: View, robot: RobotView, dense: boolean): HTMLElement {
  const chosen = app.selection?.kind === "robot" && app.selection.number === robot.number;
  const away = is_away(robot);
  if (dense && !chosen) return row(app, view, robot);
  const colour = css(robot_rgb(robot.index, app.dark));
  const body = h(
    "button",
    {
      type: "button",
      class: "who",
      key: `robot ${robot.number}`,
      "aria-pressed": String(chosen),
      on: { click: () => choose(app, view, robot, chosen) },
    },
    h(
      "span",
      { class: "line" },
      swatch(away ? "var(--soft)" : colour),
      h("b", {}, robot.name),
      h("span", { class: "seen" }, seen(app, robot)),
    ),
    h("span", { class: "icons" }, icons(app, robot), h("span", { class: "right" }, many(robot.submaps, "submap"))),
    details(app, robot),
    held(app, `robot/${robot.number}`),
    chosen ? radio(app, robot) : null,
  );
  return h(
    "article",
    { class: `robot ${robot.presence}${chosen ? " chosen" : ""}` },
    body,
    chosen ? actions(app, view, robot) : null,
  );
}

/** One of many: a line, with what is wrong in it. */
function row(app: App, view: View, robot: RobotView): HTMLElement {
  const wrong = robot.status?.conflict || robot.status?.trouble;
  const colour = is_away(robot) ? "var(--soft)" : css(robot_rgb(robot.index, app.dark));
  const body = h(
    "button",
    {
      type: "button",
      class: "who",
      key: `robot ${robot.number}`,
      "aria-pressed": "false",
      on: { click: () => choose(app, view, robot, false) },
    },
    h(
      "span",
      { class: "line" },
      swatch(colour),
      h("b", {}, robot.name),
      wrong ? h("span", { class: "wrong bad", title: wrong }, wrong) : null,
      h("span", { class: "icons" }, icons(app, robot)),
      h("span", { class: "seen" }, seen(app, robot)),
    ),
    held(app, `robot/${robot.number}`),
  );
  return h("article", { class: `robot brief ${robot.presence}` }, body);
}

function choose(app: App, view: View, robot: RobotView, chosen: boolean): void {
  app.select(chosen ? null : { kind: "robot", number: robot.number });
  const at = position_of(app, robot);
  if (!chosen && at) view.look_at(at, Math.max(30, robot.reach_m * 2.5));
}

function actions(app: App, view: View, robot: RobotView): Child {
  const follows = view.followed === robot.number;
  return h(
    "div",
    { class: "row" },
    button(
      follows ? "Stop following" : "Follow",
      () => {
        view.followed = follows ? null : robot.number;
        app.say("tool");
      },
      { "aria-pressed": String(follows) },
    ),
  );
}

function seen(app: App, robot: RobotView): Child {
  switch (robot.presence) {
    case "here":
      return span(robot.silent_s);
    case "finished":
      return "finished";
    case "unknown":
      return app.store.get("status", app.at()) ? "not heard" : "";
    default:
      return h("em", {}, `silent ${span(robot.silent_s)}`);
  }
}

const kHeard: Record<RobotView["presence"], [string, "on" | "off" | "bad"]> = {
  here: ["Is heard", "on"],
  silent: ["Cannot be heard now", "bad"],
  lost: ["Cannot be heard now", "bad"],
  finished: ["Has finished and is not heard any more", "off"],
  unknown: ["Not heard since the server started", "off"],
};
const heard = (robot: RobotView): (typeof kHeard)["here"] => (robot.is_heard ? kHeard.here : kHeard[robot.presence]);

/** Icons of what a robot can do now. */
function icons(app: App, robot: RobotView): Child[] {
  const { status } = robot;
  const away = is_away(robot);
  const joined = robot.newest !== null && app.world.placed.has(robot.newest.id);
  const largest = Math.max(0, ...[...app.world.parts.values()].map((p) => p.submaps));
  const part = robot.newest ? app.world.parts.get(app.world.placed.get(robot.newest.id)?.component ?? -1) : undefined;
  const main = joined && (part?.submaps ?? 0) === largest;
  const out: Child[] = [
    icon("link", ...heard(robot)),
    icon(
      "joined",
      main ? "Merged into the map" : joined ? "Its component is not merged with the largest" : "Not in the map yet",
      main ? "on" : joined ? "warn" : "off",
    ),
    icon("corrects", corrects(status), status?.update_age_s == null ? "off" : "on"),
  ];
  if (!status) return out;
  if (status.backlog_submaps > 0)
    out.push(
      icon(
        "upload",
        `Holds ${many(status.backlog_submaps, "submap")} that the server has not stored`,
        robot.drain.state === "grows" || away ? "warn" : "on",
      ),
    );
  if (status.battery_percent !== null)
    out.push(
      icon(
        "battery",
        `Battery ${status.battery_percent.toFixed(0)} %`,
        status.battery_percent < 15 ? "bad" : status.battery_percent < 30 ? "warn" : "on",
      ),
    );
  if (status.finished) out.push(icon("flag", "Its recording has ended"));
  if (status.trouble || status.conflict || status.alerts > 0)
    out.push(icon("alert", status.trouble || status.conflict || many(status.alerts, "alert"), "bad"));
  return out;
}

const corrects = (status: RobotView["status"]): string =>
  status?.update_age_s == null
    ? "Has not used the map yet: drives by its own odometry"
    : `Corrects itself: used the map of revision ${status.heard_revision}, ${span(status.update_age_s)} ago`;

function details(app: App, robot: RobotView): Child[] {
  const { status, drain } = robot;
  const out: Child[] = [];
  const line = (text: Child, severity = "") => out.push(h("span", { class: `detail ${severity}` }, text));
  const away = is_away(robot);
  if (away)
    line(
      `May be within ${metres(robot.reach_m)} of where it was seen (drove ${robot.speed_mps.toFixed(1)} m/s)`,
      "warn",
    );
  if (status && status.backlog_submaps > 0)
    line(
      `Backlog ${many(status.backlog_submaps, "submap")}, ${bytes(status.backlog_bytes)} · ${drains(robot, drain)}`,
      drain.state === "grows" ? "warn" : "",
    );
  if (status?.localisation)
    line(
      `In ${map_name(status)}${status.floor > 1 ? `, floor ${status.floor}` : ""}: ${status.localisation}, ${status.localisation_why}`,
      status.localisation === "localised" || status.localisation === "searching" ? "" : "warn",
    );
  if (status?.conflict) line(status.conflict, "bad");
  if (status?.trouble) line(status.trouble, "bad");
  const loud = app.phase === "deploy" || (app.selection?.kind === "robot" && app.selection.number === robot.number);
  if (loud && status) {
    line(
      [
        status.version ? `Version ${status.version}` : null,
        status.battery_percent === null ? null : `battery ${status.battery_percent.toFixed(0)} %`,
        status.battery_v === null ? null : `${status.battery_v.toFixed(1)} V`,
      ]
        .filter((x) => x)
        .join(" · ") || "No version reported",
    );
    line(corrects(status));
    if (status.refused_submaps + status.unread_submaps > 0)
      line(`${many(status.refused_submaps + status.unread_submaps, "submap")} not taken by the map`, "warn");
  }
  return out;
}

/** The bytes it has sent and was sent since the server's start, the most first; and their rate of late. */
function radio(app: App, robot: RobotView): Child[] {
  const track = app.store.track("radio");
  const last = track ? track.index(app.at()) : -1;
  const now = last < 0 ? undefined : track!.values[last]?.get(robot.number);
  if (!now) return [];
  let first = last;
  while (first > 0 && track!.times[last] - track!.times[first] < TIMES.drain_window_s) --first;
  const before = track!.values[first]?.get(robot.number);
  const seconds = track!.times[last] - track!.times[first];
  const total = (of: Record<string, number> = {}) => Object.values(of).reduce((sum, n) => sum + n, 0);
  const line = (way: "up" | "down", words: string) => {
    const rate =
      before && seconds > 0 ? ` · ${bytes(Math.max(0, total(now[way]) - total(before[way])) / seconds)}/s` : "";
    const kinds = Object.entries(now[way])
      .sort((a, b) => b[1] - a[1])
      .map(([kind, n]) => `${kind} ${bytes(n)}`)
      .join(", ");
    return h("span", { class: "detail" }, `${words} ${bytes(total(now[way]))}${rate}${kinds ? `: ${kinds}` : ""}`);
  };
  return [line("up", "Sent"), line("down", "Was sent")];
}

function drains(robot: RobotView, drain: RobotView["drain"]): string {
  if (is_away(robot)) return "waits for the link";
  return drain.state === "drains" ? `sent in ${span(drain.seconds)}` : drain.state === "grows" ? "grows" : "not moving";
}

function workers(app: App): Child {
  const status = app.store.get("status", app.at());
  if (!status || status.workers.length === 0) return null;
  const silent_s = silent_after(app.store);
  const late = status.workers.filter((w) => (w.last_seen_s_ago ?? 0) > silent_s).length;
  return h(
    "p",
    { class: "workers" },
    `${many(status.workers.length, "worker")} look${status.workers.length === 1 ? "s" : ""} for closures`,
    late ? h("em", {}, ` · ${late} silent`) : null,
  );
}
