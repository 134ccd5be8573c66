// SPDX-License-Identifier: BSD-3-Clause
/** One closure: both clouds, the numbers, the gates, why it was refused; and the decision. */
import type { App } from "../app";
import { api } from "../api";
import { degrees, figure, metres, wall } from "../format";
import { compose, distance, inverse, turn_deg } from "../pose";
import type { Closure, Gate, Link, Wish } from "../schema";
import { kPairColours, PairView } from "../scene/pair_view";
import { palette_of, state_colour } from "../scene/picture";
import { pair_name, STATE_WORDS } from "./closures";
import { attempt, button, h, held, notice, panel, swatch } from "./dom";
import type { Child } from "./dom";
import { who } from "./login";

export function inspector_panel(app: App): HTMLElement {
  const clouds = new PairView(app);
  return panel(app, ["selection", "data", "time", "me", "options"], { class: "inspector" }, () => {
    const s = app.selection;
    const closure = s?.kind === "closure" ? app.store.get("closure", app.at(), s.name) : null;
    if (s?.kind !== "closure") return [];
    if (!closure) return [h("p", { class: "empty" }, "This closure is not there at this time.")];
    clouds.show({ from: closure.from, to: closure.to, measured: closure.links[0]?.T_from_to ?? null });
    return [
      heading(app, s.name, closure),
      clouds.element,
      legend(app, closure, clouds),
      decisions(app, s.name, closure),
      numbers(app, closure),
      gates(closure.evidence),
      origin(closure),
    ];
  });
}

function heading(app: App, name: string, closure: Closure): Child {
  const colour = state_colour(palette_of(app.dark), closure.state);
  return [
    h(
      "div",
      { class: "line" },
      h("h2", {}, pair_name(app, closure)),
      button("×", () => app.select(null), { class: "plain", "aria-label": "Close", key: `close ${name}` }),
    ),
    h(
      "p",
      { class: "state" },
      swatch(colour),
      h("b", {}, `${closure.by_hand ? "By hand, " : ""}${STATE_WORDS[closure.state]}`),
      closure.reason ? `: ${closure.reason}` : "",
    ),
    held(app, `closure/${name}`),
    closure.decision
      ? h(
          "p",
          { class: "decision" },
          `${closure.decision.by || "Somebody"} decided ${closure.decision.wish}${closure.decision.wall_ns ? ` at ${wall(closure.decision.wall_ns)}` : ""}.`,
        )
      : null,
  ];
}

function legend(app: App, closure: Closure, clouds: PairView): Child {
  const colours = kPairColours[app.dark ? "dark" : "light"];
  const toggle = (by_map: boolean, text: string) =>
    button(
      text,
      () => {
        clouds.by_map = by_map;
        app.say("options");
      },
      { "aria-pressed": String(clouds.by_map === by_map) },
    );
  return h(
    "div",
    { class: "row legend" },
    swatch(`rgb(${colours[0].join()})`),
    app.submap_name(closure.from),
    swatch(`rgb(${colours[1].join()})`),
    app.submap_name(closure.to),
    h("span", { class: "segmented" }, toggle(false, "As measured"), toggle(true, "As in the map")),
  );
}

/** The decisions that a person may take on a closure now. */
function decisions(app: App, name: string, closure: Closure): Child {
  if (!app.may("decide")) return null;
  const say = (wish: Wish, text: string, props = {}) =>
    button(text, () => void decide(app, name, wish), { ...props, key: `decide ${wish}` });
  const said = closure.decision && closure.decision.wish !== "withdraw" ? closure.decision.wish : null;
  return h(
    "div",
    { class: "row decide" },
    closure.state !== "accepted" && said !== "accept" ? say("accept", "Accept", { class: "primary" }) : null,
    closure.state !== "rejected" && said !== "reject" ? say("reject", "Reject", { class: "danger" }) : null,
    said ? say("withdraw", `Take back “${said}”`) : null,
  );
}

async function decide(app: App, name: string, wish: Wish): Promise<void> {
  const by = await who(app);
  if (!by) return notice("A decision carries a name; nothing was sent.", "error");
  if (await attempt(() => api.decide(name, wish, by))) notice(`Sent: ${wish}. The map follows with the next update.`);
}

function numbers(app: App, closure: Closure): Child {
  if (closure.links.length === 0) return null;
  const counted = closure.links.length > 1 ? ["link"] : []; // six columns are more than a phone shows
  return [
    h("h3", {}, "Numbers"),
    h(
      "div",
      { class: "scroll" },
      h(
        "table",
        {},
        h(
          "thead",
          {},
          h(
            "tr",
            {},
            [...counted, "measured", "turn", "map differs", "by", "χ²"].map((t) => h("th", {}, t)),
          ),
        ),
        h(
          "tbody",
          {},
          closure.links.map((link, i) =>
            h(
              "tr",
              { title: link.reason },
              [...counted.map(() => String(i + 1)), ...row(app, closure, link)].map((t) => h("td", {}, t)),
            ),
          ),
        ),
      ),
    ),
  ];
}

function row(app: App, closure: Closure, link: Link): string[] {
  let [metres_off, degrees_off] = [link.misfit_m, link.misfit_deg];
  const [a, b] = [app.world.placed.get(closure.from), app.world.placed.get(closure.to)];
  if (metres_off === null && a && b && a.component === b.component) {
    const off = compose(inverse(link.T_from_to), compose(inverse(a.target), b.target));
    [metres_off, degrees_off] = [distance(off, [0, 0, 0]), turn_deg(off)];
  }
  return [
    metres(Math.hypot(...link.T_from_to.slice(0, 3))),
    degrees(turn_deg(link.T_from_to)),
    metres(metres_off),
    degrees(degrees_off),
    figure(link.chi2),
  ];
}

/** Measured values against their limits; those that fail first. */
export function gates(evidence: Gate[]): Child {
  if (evidence.length === 0) return null;
  const sorted = [...evidence].sort((a, b) => Number(a.ok) - Number(b.ok));
  return [
    h("h3", {}, "What was checked"),
    h(
      "ul",
      { class: "gates" },
      sorted.map((gate) =>
        h(
          "li",
          { class: gate.ok ? "ok" : "failed" },
          h("span", { class: "mark" }, gate.ok ? "✓" : "✗"),
          h("span", {}, gate.reason),
          h(
            "span",
            { class: "right" },
            gate.value === null ? "" : figure(gate.value, gate.unit),
            gate.limit === null
              ? ""
              : h("small", {}, ` at ${gate.at_least ? "least" : "most"} ${figure(gate.limit, gate.unit)}`),
          ),
        ),
      ),
    ),
  ];
}

function origin(closure: Closure): Child {
  const words = [
    closure.verifier && `found by ${closure.verifier}`,
    closure.worker && `verified by ${/^\d+$/.test(closure.worker) ? "worker " : ""}${closure.worker}`,
    closure.verified_ns && `at ${wall(closure.verified_ns)}`,
  ].filter((w) => w);
  return words.length ? h("p", { class: "detail" }, words.join(", ")) : null;
}
