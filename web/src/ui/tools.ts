// SPDX-License-Identifier: BSD-3-Clause
/** The tools over the 3-D picture: colours, heights, section, layers, measuring. */
import type { App } from "../app";
import { metres } from "../format";
import { COLOUR_MODES, LAYERS } from "../options";
import type { ColourMode, Layer } from "../options";
import { Measure } from "../scene/measure";
import type { View } from "../scene/view";
import { button, h, panel } from "./dom";
import type { Child } from "./dom";

const open = { layers: false, heights: false, section: false };

export function tool_bar(app: App, view: View): HTMLElement {
  const bar = panel(app, ["options", "tool", "data", "link"], { class: "tools" }, () => {
    const toggle = (name: keyof typeof open, text: string, lit = false) =>
      button(
        text,
        () => {
          const was = open[name];
          Object.assign(open, { layers: false, heights: false, section: false });
          open[name] = !was;
          app.say("options");
        },
        { "aria-expanded": String(open[name]), class: lit ? "lit" : "" },
      );
    const { options } = app;
    return [
      h(
        "div",
        { class: "row" },
        colour_choice(app),
        button("Top", () => view.eye.top(), { title: "Look from above (T)" }),
        button("All", () => view.fit(), { title: "Show the whole map (F)" }),
        toggle("layers", "Layers"),
        toggle("heights", "Heights", options.low_m !== null || options.high_m !== null),
        toggle("section", "Section", options.section),
        button("Measure", () => view.use(view.tool?.name === "measure" ? null : new Measure(() => view.redraw())), {
          "aria-pressed": String(view.tool?.name === "measure"),
          title: "Distance between two places",
        }),
      ),
      open.layers ? layers(app) : null,
      open.heights ? heights(app) : null,
      open.section ? section(app, view) : null,
      app.has_ended() ? h("p", { class: "hint" }, kEnded) : null,
      view.tool
        ? h(
            "p",
            { class: "hint" },
            hint(view),
            button("Stop", () => view.use(null), { class: "plain" }),
          )
        : null,
    ];
  });
  return bar;
}

const kEnded =
  "All robots have finished and have sent everything, and the server has ended: this is how it came out. " +
  "The report is report.html in the mission's folder (--out), which the console of tutti demo --live or tutti mission up names.";

const hint = (view: View): string =>
  view.tool?.name === "measure" ? "Point at two places. Esc ends it. " : `${view.tool?.name ?? ""}. Esc ends it. `;

function colour_choice(app: App): Child {
  const offered = (Object.keys(COLOUR_MODES) as ColourMode[]).filter((m) => m !== "survey" || app.store.get("survey"));
  const select = h(
    "select",
    {
      key: "colour",
      "aria-label": "Colour by",
      on: {
        change: ((e: Event) => {
          (e.target as HTMLSelectElement).blur();
          app.set_options({ colour: (e.target as HTMLSelectElement).value as ColourMode });
        }) as () => void,
      },
    },
    offered.map((mode) =>
      h("option", { value: mode, selected: app.options.colour === mode }, `Colour: ${COLOUR_MODES[mode]}`),
    ),
  );
  return select;
}

function layers(app: App): Child {
  const has: Partial<Record<Layer, boolean>> = {
    survey: app.store.get("survey") !== null,
    estimates: [...app.store.all("trajectory")].length > 0,
  };
  const names = (Object.keys(LAYERS) as Layer[]).filter((layer) => has[layer] ?? true);
  const check = (text: string, checked: boolean, set: (on: boolean) => void) =>
    h(
      "label",
      {},
      h("input", {
        type: "checkbox",
        checked,
        key: text,
        on: { change: ((e: Event) => set((e.target as HTMLInputElement).checked)) as () => void },
      }),
      text,
    );
  return h(
    "div",
    { class: "sheet" },
    names.map((layer) =>
      check(LAYERS[layer], app.options.layers[layer], (on) =>
        app.set_options({ layers: { ...app.options.layers, [layer]: on } }),
      ),
    ),
    check("Shaded edges", app.options.edges, (edges) => app.set_options({ edges })),
  );
}

/** A slider with its value; null at its outer end means no bound. */
function slider(
  label: string,
  low: number,
  high: number,
  value: number,
  text: string,
  set: (x: number) => void,
): HTMLElement {
  const shown = h("span", { class: "right" }, text);
  const input = h("input", {
    type: "range",
    min: low,
    max: high,
    step: "any",
    value,
    on: { input: ((e: Event) => set(Number((e.target as HTMLInputElement).value))) as () => void },
  });
  return h("label", { class: "slider" }, label, input, shown);
}

function heights(app: App): Child {
  const { low, high } = app.world;
  const { low_m, high_m } = app.options;
  const value = (x: number | null) => (x === null ? "all" : metres(x));
  const sheet = h("div", { class: "sheet" });
  const draw = () =>
    sheet.replaceChildren(
      slider("From", low[2], high[2], low_m ?? low[2], value(app.options.low_m), (x) =>
        set({ low_m: x <= low[2] + 0.02 ? null : x }),
      ),
      slider("To", low[2], high[2], high_m ?? high[2], value(app.options.high_m), (x) =>
        set({ high_m: x >= high[2] - 0.02 ? null : x }),
      ),
      button("All heights", () => app.set_options({ low_m: null, high_m: null })),
    );
  const set = (change: { low_m?: number | null; high_m?: number | null }) => {
    Object.assign(app.options, change);
    sheet
      .querySelectorAll("label span")
      .forEach((s, i) => (s.textContent = value(i === 0 ? app.options.low_m : app.options.high_m)));
    app.say("time");
  };
  draw();
  return sheet;
}

/** A vertical slice through what is in the middle of the picture. */
function section(app: App, view: View): Child {
  const { options } = app;
  const put = (section_rad: number) =>
    app.set_options({ section: true, section_rad, section_at: [view.eye.target[0], view.eye.target[1]] });
  return h(
    "div",
    { class: "sheet" },
    h(
      "div",
      { class: "row" },
      button("Across the picture", () => put(view.eye.heading), {
        title: "A slice from left to right through the middle",
      }),
      button("Along it", () => put(view.eye.heading + Math.PI / 2), {
        title: "A slice away from you through the middle",
      }),
      button("Off", () => app.set_options({ section: false })),
    ),
    slider("Thickness", 0.1, 10, 2 * options.section_half_m, metres(2 * options.section_half_m), (x) => {
      options.section_half_m = x / 2;
      app.say("time");
    }),
  );
}
