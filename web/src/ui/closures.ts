// SPDX-License-Identifier: BSD-3-Clause
/** All closures, newest decisions first; filtered by state and by text. */
import type { App } from "../app";
import { figure, many } from "../format";
import { LIMITS } from "../limits";
import type { Closure, ClosureState } from "../schema";
import { ends_of, palette_of, state_colour } from "../scene/picture";
import type { View } from "../scene/view";
import { button, h, held, panel, swatch } from "./dom";
import type { Child } from "./dom";
import { reading } from "./report_data";

export const STATE_WORDS: Record<ClosureState, string> = {
  accepted: "in the map",
  candidate: "waiting",
  rejected: "refused",
};
const filter = { state: "all" as ClosureState | "all" | "hand", words: "", between: false };

export function closures_panel(app: App, view: View): HTMLElement {
  const search = h("input", {
    type: "search",
    placeholder: "Filter: alpha/12, overlap, …",
    "aria-label": "Filter closures",
  });
  const list = panel(app, ["data", "time", "selection", "options"], {}, () => content(app, view));
  search.addEventListener("input", () => {
    filter.words = search.value.toLowerCase().trim();
    app.say("options");
  });
  return h("div", { class: "closures" }, search, list, refusals(app));
}

function content(app: App, view: View): Child[] {
  const all = [...app.store.all("closure", app.at())];
  const count = (state: ClosureState) => all.filter(([, c]) => c.state === state).length;
  const choose = (state: typeof filter.state, text: string) =>
    button(
      text,
      () => {
        filter.state = state;
        app.say("options");
      },
      { key: `filter ${state}`, "aria-pressed": String(filter.state === state) },
    );
  const unshown = app.store.get("poses", app.at())?.unshown ?? 0;
  const rows = all.filter(([, c]) => shown(app, c)).reverse();
  return [
    h(
      "p",
      { class: "lead" },
      "Closures: pairs of submaps whose relative pose was found. Pairs that were refused before that are not in this list.",
    ),
    h(
      "div",
      { class: "row chips" },
      choose("all", `All ${all.length}`),
      choose("accepted", `In the map ${count("accepted")}`),
      choose("candidate", `Waiting ${count("candidate")}`),
      choose("rejected", `Refused ${count("rejected")}`),
      all.some(([, c]) => c.by_hand || c.decision) ? choose("hand", "By a person") : null,
    ),
    rows.slice(0, LIMITS.rows).map(([name, closure]) => row(app, view, name, closure)),
    rows.length === 0
      ? h("p", { class: "empty" }, all.length === 0 ? "No closure was found yet." : "None fits the filter.")
      : null,
    unshown > 0
      ? h("p", { class: "empty" }, `${unshown} more are not sent: pairs that wait to be judged, or are refused`)
      : null,
    rows.length > LIMITS.rows
      ? h("p", { class: "empty" }, `and ${rows.length - LIMITS.rows} more: filter to see them`)
      : null,
  ];
}

function shown(app: App, c: Closure): boolean {
  if (filter.state === "hand" ? !c.by_hand && !c.decision : filter.state !== "all" && c.state !== filter.state)
    return false;
  if (filter.words === "") return true;
  return `${pair_name(app, c)} ${c.reason} ${c.decision?.by ?? ""}`.toLowerCase().includes(filter.words);
}

export const pair_name = (app: App, c: Closure): string => `${app.submap_name(c.from)} – ${app.submap_name(c.to)}`;

function row(app: App, view: View, name: string, closure: Closure): HTMLElement {
  const chosen = app.selection?.kind === "closure" && app.selection.name === name;
  const palette = palette_of(app.dark);
  const misfit = closure.links[0]?.misfit_m;
  return h(
    "button",
    {
      type: "button",
      class: `closure${chosen ? " chosen" : ""}`,
      key: `closure ${name}`,
      on: {
        click: () => {
          app.select({ kind: "closure", name });
          const ends = ends_of(app, closure);
          const middle = ends?.[0].map((x, k) => (x + ends[1][k]) / 2);
          if (middle) view.look_at(middle, 45);
        },
      },
    },
    h(
      "span",
      { class: "line" },
      swatch(state_colour(palette, closure.state)),
      h("b", {}, pair_name(app, closure)),
      h(
        "span",
        { class: "seen" },
        closure.by_hand ? "by hand" : misfit == null ? STATE_WORDS[closure.state] : `off ${figure(misfit, "m")}`,
      ),
    ),
    closure.state !== "accepted" && closure.reason ? h("span", { class: "detail" }, closure.reason) : null,
    held(app, `closure/${name}`),
    closure.decision
      ? h("span", { class: "detail" }, `${closure.decision.by || "somebody"}: ${closure.decision.wish}`)
      : null,
  );
}

/** A report counts them; a running server does not. */
function refusals(app: App): HTMLElement {
  return panel(app, ["data", "time"], {}, () => {
    const server = reading(app.store.get("report")).at("server");
    const all = server
      .list("rejections")
      .map((r) => ({ reason: r.s("reason"), count: (r.n("intra") ?? 0) + (r.n("inter") ?? 0) }))
      .sort((a, b) => b.count - a.count);
    if (all.length === 0) return [];
    return [
      h("h3", {}, `${many(server.n("closures_rejected") ?? 0, "pair")} of submaps refused, by reason`),
      all.map((r) =>
        h(
          "div",
          { class: "bar-row" },
          h("span", {}, r.reason),
          h(
            "span",
            { class: "track" },
            h("span", { class: "bar", style: { width: `${(100 * r.count) / all[0].count}%` } }),
          ),
          h("span", { class: "right" }, r.count),
        ),
      ),
    ];
  });
}
