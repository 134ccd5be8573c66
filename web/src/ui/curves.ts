// SPDX-License-Identifier: BSD-3-Clause
/** Any number that the server sends, of anybody, over time. The list is made of what came. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import { many } from "../format";
import { fields, series, unit_of, words_of } from "../numbers";
import { memory } from "../options";
import type { View } from "../scene/view";
import { place_at } from "../scene/where";
import { h, swatch } from "./dom";
import type { Child } from "./dom";
import { Plot } from "./plot";

const kRedraw_ms = 2000;
const kFirst = "battery_percent";
const kHeight_px = 220;

export function curves_panel(app: App, view: View): HTMLElement {
  const chosen = { field: memory.read("curve", kFirst), who: memory.read("curve.who", "") };
  const picked = (key: "field" | "who", name: string) => (e: Event) => {
    chosen[key] = (e.target as HTMLSelectElement).value;
    memory.write(name, chosen[key]);
    drawn = "";
    draw();
  };
  const number = h("select", { "aria-label": "Number", on: { change: picked("field", "curve") as () => void } });
  const who = h("select", { "aria-label": "Of whom", on: { change: picked("who", "curve.who") as () => void } });
  const body = h("div");
  let plot: Plot | null = null;
  let drawn = "";
  let last = -Infinity;

  const draw = (): void => {
    if (!element.isConnected || element.hidden) return;
    if (drawn !== "" && app.live && performance.now() - last < kRedraw_ms) return;
    const names = fields(app.store);
    if (!names.includes(chosen.field)) chosen.field = names[0] ?? "";
    const { times, by } = series(app.store, chosen.field);
    const state = `${app.dark} ${chosen.field} ${chosen.who} ${app.store.version}`;
    if (state === drawn) return;
    [drawn, last] = [state, performance.now()];
    offer(
      number,
      names.map((name) => [name, words_of(name)]),
      chosen.field,
    );
    offer(
      who,
      [["", `everybody (${by.size})`], ...[...by.keys()].filter(Boolean).map((n): [string, string] => [n, n])],
      chosen.who,
    );
    const shown = [...by].filter(([name]) => !by.has(chosen.who) || chosen.who === "" || name === chosen.who);
    plot?.destroy();
    plot = null;
    if (times.length < 2) return body.replaceChildren(h("p", { class: "empty" }, "Nothing came twice yet."));
    const curves = shown.map(([name, values]) => ({ label: name || "server", colour: colour_of(app, name), values }));
    plot = new Plot(app, {
      times,
      curves,
      unit: unit_of(chosen.field),
      log: false,
      height: kHeight_px,
      on_click: (t) => {
        const robot = app.robots.find((r) => r.name === chosen.who);
        const at = robot && place_at(app, robot.number, t);
        if (at) view.look_at(at);
      },
    });
    body.replaceChildren(plot.element, h("p", { class: "row key" }, curves.map(latest)));
  };
  const element = h(
    "div",
    { class: "curves" },
    h("p", { class: "lead" }, "Any number that the server sends, as far back as this page has it."),
    h("div", { class: "row" }, number, who),
    body,
  );
  app.on((topic) => (topic === "data" || topic === "time" || topic === "options") && draw());
  queueMicrotask(draw);
  return element;

  /** Its name and its newest value. */
  function latest(curve: { label: string; colour: string; values: (number | null)[] }): Child {
    const value = curve.values.filter((x) => x !== null).at(-1);
    const text = value == null ? "-" : `${Number(value.toPrecision(5))} ${unit_of(chosen.field)}`.trim();
    return h("span", {}, swatch(curve.colour), `${curve.label} ${text}`);
  }
}

/** Fills a choice anew where it has others now. */
function offer(select: HTMLSelectElement, all: [string, string][], value: string): void {
  const names = all.map(([name, text]) => `${name}=${text}`).join();
  if (select.dataset.names !== names) {
    select.dataset.names = names;
    select.replaceChildren(...all.map(([name, text]) => h("option", { value: name }, text)));
    select.title = many(all.length, "choice");
  }
  select.value = all.some(([name]) => name === value) ? value : all[0]?.[0];
}

function colour_of(app: App, name: string): string {
  const robot = app.robots.find((r) => r.name === name);
  return robot
    ? css(robot_rgb(robot.index, app.dark))
    : getComputedStyle(document.documentElement).getPropertyValue("--soft");
}
