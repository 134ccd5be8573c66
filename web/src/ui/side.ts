// SPDX-License-Identifier: BSD-3-Clause
/** The panel on the right: tabs, and what is inspected above them. */
import type { App } from "../app";
import { PHASES } from "../options";
import type { View } from "../scene/view";
import { alerts_panel, open_alerts } from "./alerts";
import { closures_panel } from "./closures";
import { button, h, panel } from "./dom";
import { inspector_panel } from "./inspector";

interface Tab {
  name: string;
  title: (app: App) => string;
  /** Whether there is anything to show. */
  offered: (app: App) => boolean;
  make: (app: App, view: View) => HTMLElement;
}

/** To add a tab, add a row. */
const TABS: Tab[] = [
  { name: "alerts", title: (app) => `Alerts${open_alerts(app).length ? ` ${open_alerts(app).length}` : ""}`, offered: () => true, make: alerts_panel },
  { name: "closures", title: () => "Closures", offered: () => true, make: closures_panel },
];

export function side_panel(app: App, view: View): HTMLElement {
  let tab: string = PHASES[app.phase].tab;
  let phase = app.phase;
  const bodies = new Map<string, HTMLElement>();
  const body = h("div", { class: "tab-body" });
  const show = (name: string): void => {
    tab = name;
    for (const [other, element] of bodies) element.hidden = other !== name;
    if (!bodies.has(name)) {
      const made = TABS.find((t) => t.name === name)!.make(app, view);
      bodies.set(name, made);
      body.append(made);
    }
    app.say("options");
  };
  const bar = panel(app, ["data", "options", "me", "time"], { class: "tabs", role: "tablist" }, () => {
    if (phase !== app.phase) {
      phase = app.phase;
      queueMicrotask(() => show(PHASES[phase].tab));
    }
    return TABS.filter((t) => t.offered(app)).map((t) => button(t.title(app), () => show(t.name), { key: `tab ${t.name}`, role: "tab", "aria-selected": String(t.name === tab) }));
  });
  const element = h("aside", { class: "side" }, inspector_panel(app), bar, body);
  queueMicrotask(() => show(tab));
  return element;
}
