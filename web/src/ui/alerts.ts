// SPDX-License-Identifier: BSD-3-Clause
/** The inbox: what, where, since when, what to do. Many of one kind are one line that unfolds. Acknowledged by one, acknowledged for all. */
import { api } from "../api";
import type { App } from "../app";
import { moment, span } from "../format";
import { LIMITS } from "../limits";
import type { Alert } from "../schema";
import type { View } from "../scene/view";
import { attempt, button, h, panel } from "./dom";
import type { Child } from "./dom";
import { who } from "./login";

/** Who has acknowledged it; null: nobody. An alert that came again later is another one. */
const seen_by = (app: App, alert: Alert): string | null =>
  app.store.get("acknowledged", app.at(), `${alert.id}@${Math.round(alert.since_s ?? 0)}`)?.by ?? null;

export const open_alerts = (app: App): Alert[] =>
  (app.store.get("alerts", app.at()) ?? []).filter((a) => seen_by(app, a) === null);

function acknowledge(app: App, alerts: Alert[], yes: boolean): void {
  void attempt(async () =>
    api.acknowledge(
      alerts.map((a) => a.id),
      !yes,
      await who(app),
    ),
  );
}

/** Offered to who may: it holds for everybody. */
function seen_button(app: App, label: string, alerts: Alert[], seen: boolean, key: string): Child {
  return app.may("acknowledge")
    ? button(seen ? "Show as new again" : label, () => acknowledge(app, alerts, !seen), { key })
    : null;
}

/** Alerts of one cause differ in the robots, sessions and places that their ids have. */
const cause_of = (alert: Alert): string => `${alert.severity} ${alert.id.replace(/\d+/g, "*")}`;
const unfolded = new Set<string>();

/** In the order of each cause's first alert. */
function lines(app: App, view: View, alerts: Alert[], seen: boolean): Child[] {
  const causes = new Map<string, Alert[]>();
  for (const alert of alerts) {
    const cause = cause_of(alert);
    const same = causes.get(cause);
    if (same) same.push(alert);
    else causes.set(cause, [alert]);
  }
  return [...causes].map(([cause, same]) =>
    same.length < LIMITS.folds
      ? same.map((alert) => line(app, view, alert, seen))
      : group(app, view, cause, same, seen),
  );
}

function group(app: App, view: View, cause: string, alerts: Alert[], seen: boolean): Child {
  const [first] = alerts;
  const robots = new Set(alerts.map((a) => a.robot).filter((r) => r !== null)).size;
  const what = alerts.every((a) => a.what === first.what) ? first.what : first.what.replace(/\d+([.,]\d+)*/g, "…");
  const since = Math.min(...alerts.map((a) => a.since_s ?? Infinity));
  const key = `${seen ? "seen " : ""}${cause}`;
  const open = unfolded.has(key);
  const fold = (): void => {
    if (!unfolded.delete(key)) unfolded.add(key);
    app.say("options");
  };
  return h(
    "div",
    { class: "cause" },
    h(
      "article",
      { class: `alert ${first.severity}${seen ? " seen" : ""}` },
      h(
        "div",
        { class: "line" },
        h("b", {}, robots > 1 ? `${robots} robots: ` : `${alerts.length} times: `, what),
        h("span", { class: "seen" }, Number.isFinite(since) ? span(app.shown() - since) : ""),
      ),
      h(
        "p",
        { class: "names" },
        alerts
          .map((a) => a.where)
          .filter((x) => x)
          .join(", "),
      ),
      first.todo ? h("p", { class: "todo" }, first.todo) : null,
      h(
        "div",
        { class: "row" },
        seen_button(app, `Acknowledge ${alerts.length}`, alerts, seen, `ack ${key}`),
        button(open ? "Fold" : "Unfold", fold, { key: `fold ${key}`, "aria-expanded": String(open) }),
      ),
    ),
    open ? alerts.map((alert) => line(app, view, alert, seen)) : null,
  );
}

export function alerts_panel(app: App, view: View): HTMLElement {
  return panel(app, ["data", "time", "tick", "options"], { class: "alerts" }, () => {
    const all = app.store.get("alerts", app.at()) ?? [];
    const open = open_alerts(app);
    const seen = all.filter((a) => !open.includes(a));
    return [
      open.length > 1 && app.may("acknowledge")
        ? h(
            "div",
            { class: "row end" },
            button("Acknowledge all", () => acknowledge(app, open, true), { class: "plain" }),
          )
        : null,
      open.length === 0
        ? h("p", { class: "empty" }, all.length === 0 ? "Nothing to do." : "Everything is acknowledged.")
        : null,
      lines(app, view, open, false),
      seen.length > 0 ? h("h3", {}, "Acknowledged, still so") : null,
      lines(app, view, seen, true),
    ];
  });
}

function line(app: App, view: View, alert: Alert, seen: boolean): Child {
  const goes = alert.robot !== null || alert.submap !== null || alert.closure !== null;
  return h(
    "article",
    { class: `alert ${alert.severity}${seen ? " seen" : ""}` },
    h(
      "div",
      { class: "line" },
      h("b", {}, alert.where ? `${alert.where}: ${alert.what}` : alert.what),
      h(
        "span",
        { class: "seen", title: alert.since_s === null ? "" : `since ${moment(alert.since_s)}` },
        alert.since_s === null ? "" : span(app.shown() - alert.since_s),
      ),
    ),
    seen && seen_by(app, alert) ? h("p", { class: "names" }, `${seen_by(app, alert)} has seen it`) : null,
    alert.todo ? h("p", { class: "todo" }, alert.todo) : null,
    h(
      "div",
      { class: "row" },
      seen_button(app, "Acknowledge", [alert], seen, `ack ${alert.id}`),
      goes ? button("Show", () => show(app, view, alert), { key: `show ${alert.id}` }) : null,
    ),
  );
}

function show(app: App, view: View, alert: Alert): void {
  if (alert.closure !== null) app.select({ kind: "closure", name: alert.closure });
  else if (alert.submap !== null) app.select({ kind: "submap", id: alert.submap });
  else if (alert.robot !== null) app.select({ kind: "robot", number: alert.robot });
  const closure = alert.closure === null ? null : app.store.get("closure", app.at(), alert.closure);
  const robot = app.robots.find((r) => r.number === alert.robot);
  const id = closure?.from ?? alert.submap ?? robot?.newest?.id;
  const at = id ? app.world.point(id, [0, 0, 0]) : null;
  if (at) view.look_at(at);
}
