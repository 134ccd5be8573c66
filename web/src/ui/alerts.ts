// SPDX-License-Identifier: BSD-3-Clause
/** The inbox: what, where, since when, what to do. Acknowledged once; this browser remembers it. */
import type { App } from "../app";
import { moment, span } from "../format";
import { LIMITS } from "../limits";
import { memory } from "../options";
import type { Alert } from "../schema";
import type { View } from "../scene/view";
import { button, h, panel } from "./dom";
import type { Child } from "./dom";

const acknowledged = new Set<string>(memory.read<string[]>("acknowledged", []));

/** An alert of another mission, or one that came again later, is another one. */
const mark_of = (app: App, alert: Alert): string => `${app.store.get("mission")?.name ?? ""} ${alert.id} ${Math.round(alert.since_s ?? 0)}`;

export const open_alerts = (app: App): Alert[] => (app.store.get("alerts", app.at()) ?? []).filter((a) => !acknowledged.has(mark_of(app, a)));

function acknowledge(app: App, alerts: Alert[], yes: boolean): void {
  for (const alert of alerts)
    if (yes) acknowledged.add(mark_of(app, alert));
    else acknowledged.delete(mark_of(app, alert));
  while (acknowledged.size > LIMITS.acknowledged) acknowledged.delete(acknowledged.values().next().value!);
  memory.write("acknowledged", [...acknowledged]);
  app.say("options");
}

export function alerts_panel(app: App, view: View): HTMLElement {
  return panel(app, ["data", "time", "tick", "options"], { class: "alerts" }, () => {
    const all = app.store.get("alerts", app.at()) ?? [];
    const open = open_alerts(app);
    const seen = all.filter((a) => !open.includes(a));
    return [
      open.length > 1 ? h("div", { class: "row end" }, button("Acknowledge all", () => acknowledge(app, open, true), { class: "plain" })) : null,
      open.length === 0 ? h("p", { class: "empty" }, all.length === 0 ? "Nothing to do." : "Everything is acknowledged.") : null,
      open.map((alert) => line(app, view, alert, false)),
      seen.length > 0 ? h("h3", {}, "Acknowledged, still so") : null,
      seen.map((alert) => line(app, view, alert, true)),
    ];
  });
}

function line(app: App, view: View, alert: Alert, seen: boolean): Child {
  const goes = alert.robot !== null || alert.submap !== null || alert.closure !== null;
  return h("article", { class: `alert ${alert.severity}${seen ? " seen" : ""}` },
    h("div", { class: "line" }, h("b", {}, alert.what), h("span", { class: "seen", title: alert.since_s === null ? "" : `since ${moment(alert.since_s)}` }, alert.since_s === null ? "" : span(app.shown() - alert.since_s))),
    alert.where ? h("p", {}, alert.where) : null,
    alert.todo ? h("p", { class: "todo" }, alert.todo) : null,
    h("div", { class: "row" },
      button(seen ? "Show as new again" : "Acknowledge", () => acknowledge(app, [alert], !seen), { key: `ack ${alert.id}` }),
      goes ? button("Show", () => show(app, view, alert), { key: `show ${alert.id}` }) : null));
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
