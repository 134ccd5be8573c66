// SPDX-License-Identifier: BSD-3-Clause
/** The panel on the right: what is inspected, and below it the tabs. */
import type { App } from "../app";
import { TIMES } from "../limits";
import { memory, PHASES } from "../options";
import type { View } from "../scene/view";
import { alerts_panel, open_alerts } from "./alerts";
import { by_hand_panel } from "./by_hand";
import { closures_panel } from "./closures";
import { compare_panel } from "./compare";
import { curves_panel } from "./curves";
import { disagreement_panel } from "./disagreement";
import { button, h, panel } from "./dom";
import { inspector_panel } from "./inspector";
import { marks_panel } from "./marks";
import { has_changed, places_panel } from "./places";
import { report_panel } from "./report";
import { robots_panel } from "./robots";
import { why_panel } from "./why";

interface Tab {
  name: string;
  title: (app: App) => string;
  /** Whether there is anything to show, and this person may see it. */
  offered: (app: App) => boolean;
  make: (app: App, view: View, open: (tab: string) => void) => HTMLElement;
}

/** To add a tab, add a row. */
const TABS: Tab[] = [
  { name: "report", title: () => "Report", offered: (app) => app.store.get("report") !== null, make: report_panel },
  {
    name: "compare",
    title: () => "Comparison",
    offered: (app) => app.store.get("compare") !== null,
    make: compare_panel,
  },
  {
    name: "robots",
    title: () => "Robots",
    offered: (app) => !app.live && app.world.placed.size > 0,
    make: robots_panel,
  },
  {
    name: "alerts",
    title: (app) => `Alerts${open_alerts(app).length ? ` ${open_alerts(app).length}` : ""}`,
    offered: (app) => app.live || app.store.track("alerts") !== null,
    make: alerts_panel,
  },
  {
    name: "closures",
    title: () => "Closures",
    offered: (app) => app.live || !app.store.all("closure").next().done,
    make: closures_panel,
  },
  { name: "by hand", title: () => "By hand", offered: (app) => app.may("register"), make: by_hand_panel },
  { name: "why", title: () => "Why not?", offered: (app) => app.may("why"), make: why_panel },
  {
    name: "disagreement",
    title: () => "Odometry",
    offered: (app) => [...app.store.all("disagreement", app.at())].length > 0,
    make: disagreement_panel,
  },
  {
    name: "curves",
    title: () => "Curves",
    offered: (app) => app.store.track("status") !== null,
    make: curves_panel,
  },
  {
    name: "places",
    title: (app) => {
      const changed = app.store.get("places", app.at())?.places.filter(has_changed).length;
      return `Places${changed ? ` ${changed}` : ""}`;
    },
    offered: (app) => app.store.get("places", app.at()) !== null,
    make: places_panel,
  },
  {
    name: "marks",
    title: () => "Marks",
    offered: (app) => app.may("mark") || [...app.store.all("mark", app.at())].length > 0,
    make: marks_panel,
  },
];

/** Tabs that leave room for an inspected closure. */
const kBesideClosures = ["closures", "alerts", "robots", "report"];

export function side_panel(app: App, view: View): HTMLElement {
  let tab: string = app.live ? PHASES[app.phase].tab : "report";
  let phase = app.phase;
  const bodies = new Map<string, HTMLElement>();
  const body = h("div", { class: "tab-body", role: "tabpanel" });
  const show = (name: string): void => {
    tab = app.tab = name;
    if (!kBesideClosures.includes(name) && app.selection?.kind === "closure") app.select(null);
    if (!bodies.has(name)) {
      const made = TABS.find((t) => t.name === name)!.make(app, view, show);
      bodies.set(name, made);
      body.append(made);
    }
    for (const [other, element] of bodies) element.hidden = other !== name;
    app.say("options");
  };
  const bar = panel(app, ["data", "options", "me", "time"], { class: "tabs", role: "tablist" }, () => {
    const offered = TABS.filter((t) => t.offered(app));
    if (phase !== app.phase || (app.ready && !offered.some((t) => t.name === tab))) {
      const wanted = [phase === app.phase ? "" : PHASES[app.phase].tab, ...offered.map((t) => t.name)].find((name) =>
        offered.some((t) => t.name === name),
      )!;
      phase = app.phase;
      queueMicrotask(() => show(wanted));
    }
    return offered.map((t) =>
      button(t.title(app), () => show(t.name), {
        key: `tab ${t.name}`,
        role: "tab",
        "aria-selected": String(t.name === tab),
      }),
    );
  });
  queueMicrotask(() => show(tab));
  const inspector = inspector_panel(app);
  app.on((topic) => {
    if (topic === "selection" && app.selection?.kind === "closure")
      // on a phone the list is below it
      setTimeout(() => inspector.scrollIntoView({ block: "nearest" }), TIMES.seen_ms);
  });
  return h("aside", { class: "side" }, inspector, bar, body);
}

const kLeast_px = 280;

/** Between the picture and the panel: dragged, or moved by arrow keys. */
export function splitter(app: App): HTMLElement {
  const name = app.live ? "side" : "side.report";
  const set = (px: number): void => {
    const width = Math.round(Math.min(Math.max(px, kLeast_px), innerWidth - kLeast_px - 80));
    document.documentElement.style.setProperty("--side", `${width}px`);
    memory.write(name, width);
  };
  const held = memory.read<number | null>(name, null);
  if (held !== null) set(held);
  else if (!app.live) document.documentElement.style.setProperty("--side", "48vw");
  const element = h("div", {
    class: "splitter",
    role: "separator",
    tabindex: 0,
    "aria-orientation": "vertical",
    "aria-label": "Width of the panel",
  });
  element.addEventListener("pointerdown", (e) => element.setPointerCapture(e.pointerId));
  element.addEventListener("pointermove", (e) => element.hasPointerCapture(e.pointerId) && set(innerWidth - e.clientX));
  element.addEventListener("keydown", (e) => {
    const step = e.key === "ArrowLeft" ? 24 : e.key === "ArrowRight" ? -24 : 0;
    const side = document.querySelector<HTMLElement>(".side");
    if (step && side) set(side.clientWidth + step);
  });
  return element;
}
