// SPDX-License-Identifier: BSD-3-Clause
/** The bar on top: which mission, whether the server is there, the phase, the person. */
import type { App } from "../app";
import { many, moment, span } from "../format";
import { silent_after } from "../derive";
import { OLD_STATUS } from "../limits";
import { PHASES } from "../options";
import type { Phase } from "../options";
import { THEMES } from "../theme";
import type { ThemeChoice } from "../theme";
import { save_file } from "../handover";
import { attempt, button, h, icon, panel } from "./dom";
import type { Child } from "./dom";
import { person } from "./login";

export function top_bar(app: App, theme: ThemeChoice): HTMLElement {
  return panel(app, ["data", "link", "me", "options", "tick", "time"], { class: "top" }, () => [
    h("span", { class: "brand" }, "Tutti"),
    h("h1", { title: app.store.get("mission")?.description ?? "" }, app.store.get("mission")?.name ?? ""),
    badge(app),
    facts(app),
    app.store.get("mission")?.mode === "compare"
      ? null
      : h(
          "nav",
          { class: "phases", "aria-label": "Phase of the mission" },
          (Object.keys(PHASES) as Phase[]).map((phase) =>
            button(PHASES[phase].name, () => app.set_phase(phase), {
              title: PHASES[phase].help,
              "aria-pressed": String(app.phase === phase),
            }),
          ),
        ),
    button(
      icon(
        theme.theme === "light" ? "sun" : theme.theme === "dark" ? "moon" : "system",
        `Colours: ${THEMES[theme.theme]}`,
      ),
      () => theme.next(),
      { class: "plain square", key: "theme", "aria-label": `Colours: ${THEMES[theme.theme]}` },
    ),
    app.live
      ? button(
          icon("save", "Save the mission so far as one file that opens offline"),
          () => void attempt(() => save_file(app)),
          { class: "plain square", key: "save", "aria-label": "Save as a file" },
        )
      : null,
    app.live ? person(app) : null,
  ]);
}

/** Since when the server's status is old: its own status is old data, too, when it stops. */
export function status_age(app: App): number | null {
  const times = app.store.track("status")?.times;
  return times?.length ? Math.max(0, app.now() - times[times.length - 1]) : null;
}

function badge(app: App): Child {
  if (!app.live)
    return h(
      "span",
      { class: "badge report", title: "A recorded mission; nothing here changes any more" },
      app.store.get("mission")?.mode === "compare" ? "Comparison" : "Report",
    );
  const { state, heard_ms, why } = app.link;
  if (state === "locked") return h("span", { class: "badge old" }, "Not logged in");
  if (app.has_ended()) return h("span", { class: "badge report", role: "status" }, "The mission is over");
  if (state === "connecting") return h("span", { class: "badge old" }, why ? `No server (${why})` : "Connecting …");
  if (state === "silent")
    return h(
      "span",
      { class: "badge bad", role: "alert" },
      `The server is silent since ${span((performance.now() - heard_ms) / 1000)}`,
    );
  const age = status_age(app);
  if (age !== null && age > OLD_STATUS * silent_after(app.store))
    return h("span", { class: "badge old", role: "alert" }, `Status is ${span(age)} old`);
  if (app.time !== null) return h("span", { class: "badge old" }, `Past: ${moment(app.time)}`);
  return h("span", { class: "badge live", title: "The server is heard" }, "Live");
}

function facts(app: App): Child {
  const status = app.store.get("status", app.at());
  const poses = app.world.poses;
  const parts = app.world.parts.size;
  const words = [
    many(app.robots.length, "robot"),
    app.world.placed.size > 0 || app.live ? many(app.world.placed.size, "submap") : null,
    poses ? many(poses.accepted, "closure") : null,
    parts > 1 ? `${parts} parts` : parts === 1 ? "1 map" : null,
    poses ? `revision ${poses.revision}` : null,
    status && status.pending_jobs > 0 ? `${many(status.pending_jobs, "job")} waiting` : null,
  ].filter((w) => w !== null);
  const trouble = status?.trouble || (status && status.waiting > 0 ? status.why_waiting : "");
  return h(
    "span",
    { class: "facts" },
    words.join(" · "),
    trouble ? h("b", { class: "bad", title: trouble }, ` · ${trouble}`) : null,
  );
}
