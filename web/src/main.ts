// SPDX-License-Identifier: BSD-3-Clause
import { App } from "./app";
import { saved_page } from "./handover";
import { View } from "./scene/view";
import { InlinedSource } from "./sources/inlined";
import { LiveSource } from "./sources/live";
import "./styles.css";
import { ThemeChoice } from "./theme";
import { open_alerts } from "./ui/alerts";
import { h } from "./ui/dom";
import { legend } from "./ui/legend";
import { robots_panel } from "./ui/robots";
import { side_panel, splitter } from "./ui/side";
import { Timeline } from "./ui/timeline";
import { tool_bar } from "./ui/tools";
import { top_bar } from "./ui/top";

const app = new App(InlinedSource.of_page(document) ?? new LiveSource());
const theme = new ThemeChoice(app);

const view = new View(app, new URLSearchParams(location.search).get("draw"));
const middle = h("main", { class: "middle" }, view.element, tool_bar(app, view), legend(app, view));
document.body.append(
  h(
    "div",
    { class: `room ${app.live ? "live" : "report"}` },
    top_bar(app, theme),
    app.live ? h("aside", { class: "people" }, robots_panel(app, view)) : null,
    middle,
    splitter(app),
    side_panel(app, view),
    new Timeline(app).element,
  ),
  h("div", { id: "notices", "aria-live": "polite" }),
);
app.on(() => {
  const open = app.live ? open_alerts(app).length : 0;
  document.title = `${open ? `(${open}) ` : ""}${app.store.get("mission")?.name ?? ""} – Tutti`;
});
app.start();

// For tests and measurements.
Object.assign(window, { tutti: { app, view, saved_page } });
