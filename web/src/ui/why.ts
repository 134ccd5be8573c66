// SPDX-License-Identifier: BSD-3-Clause
/** Why two robots are not joined: the nearest candidates, the gate that stopped each, what would help. */
import { api } from "../api";
import type { App } from "../app";
import { figure } from "../format";
import type { Why } from "../schema";
import type { View } from "../scene/view";
import { propose } from "./by_hand";
import { attempt, button, h, panel } from "./dom";
import type { Child } from "./dom";

const asked: { from: string; to: string; answer: Why | null; busy: boolean } = {
  from: "",
  to: "",
  answer: null,
  busy: false,
};

export function why_panel(app: App, view: View, open: (tab: string) => void): HTMLElement {
  return panel(app, ["tool", "me", "data"], { class: "why" }, () => {
    const names = app.robots.map((r) => r.name);
    if (!names.includes(asked.from)) asked.from = names[0] ?? "";
    if (!names.includes(asked.to) || asked.to === asked.from) asked.to = names.find((n) => n !== asked.from) ?? "";
    const choice = (end: "from" | "to") =>
      h(
        "select",
        {
          key: `why ${end}`,
          "aria-label": end === "from" ? "Robot" : "Other robot",
          on: {
            change: ((e: Event) => {
              asked[end] = (e.target as HTMLSelectElement).value;
              (e.target as HTMLSelectElement).blur();
              asked.answer = null;
              app.say("tool");
            }) as () => void,
          },
        },
        names.map((name) => h("option", { value: name, selected: asked[end] === name }, name)),
      );
    return [
      h("p", { class: "lead" }, "Why are these two not merged?"),
      h(
        "div",
        { class: "row" },
        choice("from"),
        "and",
        choice("to"),
        button(asked.busy ? "Asking …" : "Ask", () => void ask(app), {
          key: "ask",
          class: "primary",
          disabled: asked.busy || names.length < 2,
        }),
      ),
      asked.answer ? answer(app, view, asked.answer, open) : null,
    ];
  });
}

async function ask(app: App): Promise<void> {
  asked.busy = true;
  app.say("tool");
  await attempt(async () => {
    asked.answer = await api.why(asked.from, asked.to);
  });
  asked.busy = false;
  app.say("tool");
}

function answer(app: App, view: View, why: Why, open: (tab: string) => void): Child {
  return [
    h("p", { class: "state" }, why.sentence),
    why.candidates.map((c) =>
      h(
        "article",
        { class: `alert ${c.nearest ? "warning" : "info"}` },
        h(
          "div",
          { class: "line" },
          h("b", {}, c.pair),
          c.nearest ? h("span", { class: "seen" }, "nearest to being taken") : null,
        ),
        h(
          "p",
          {},
          `${c.reason}${c.value === null ? "" : `: ${figure(c.value, c.unit)}`}${c.limit === null ? "" : `, limit ${figure(c.limit, c.unit)}`}`,
        ),
        c.hint ? h("p", { class: "todo" }, c.hint) : null,
        h(
          "div",
          { class: "row" },
          button(
            "Show",
            () => {
              app.select({ kind: "submap", id: c.from });
              const at = app.world.point(c.from, [0, 0, 0]);
              if (at) view.look_at(at);
            },
            { key: `show ${c.pair}` },
          ),
          app.may("register")
            ? button(
                "Join by hand",
                () => {
                  propose(app, c.from, c.to);
                  open("by hand");
                },
                { key: `join ${c.pair}` },
              )
            : null,
        ),
      ),
    ),
  ];
}
