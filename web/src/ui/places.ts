// SPDX-License-Identifier: BSD-3-Clause
/** Findings of robots that localise in a map on its places: what has changed, how far each is trusted, who saw it last. */
import type { App } from "../app";
import { bad, css } from "../colours";
import { many, share, span } from "../format";
import { LIMITS } from "../limits";
import type { Place } from "../schema";
import { LEAST_DISTRUST } from "../scene/dress";
import type { View } from "../scene/view";
import { button, h, panel, swatch } from "./dom";
import type { Child } from "./dom";

export const has_changed = (place: Place): boolean => place.missing + place.appeared > 0;

export function places_panel(app: App, view: View): HTMLElement {
  return panel(app, ["data", "time", "selection", "options", "tick"], { class: "places" }, () => {
    const found = app.store.get("places", app.at());
    if (!found) return [h("p", { class: "empty" }, "No robot has said yet how the map fits.")];
    const changed = found.places.filter(has_changed).sort((a, b) => a.trust - b.trust);
    const worst = Math.max(LEAST_DISTRUST, ...found.places.map((place) => 1 - place.trust));
    const others = found.places.filter((place) => !has_changed(place)).sort((a, b) => a.seen_s - b.seen_s);
    return [
      h(
        "p",
        { class: "lead" },
        `Robots in version ${found.map_version} of map ${found.map_id} saw ${many(found.places.length, "submap")} again; `,
        changed.length === 0 ? "none has changed." : `something has changed in ${changed.length}:`,
      ),
      found.places.some((place) => place.submap !== "") ? in_the_map(app) : null,
      changed.slice(0, LIMITS.rows).map((place) => line(app, view, place, worst)),
      others.length > 0 ? h("p", { class: "lead" }, "Those that fit, the longest unseen first:") : null,
      others.slice(0, LIMITS.rows).map((place) => line(app, view, place, worst)),
    ];
  });
}

function in_the_map(app: App): Child {
  const lit = app.options.colour === "trust";
  return h(
    "div",
    { class: "row" },
    button(
      lit ? "Colour by robot again" : "Show it in the map",
      () => app.set_options({ colour: lit ? "robot" : "trust" }),
      { "aria-pressed": String(lit) },
    ),
  );
}

/** The last that saw it, and how many more. */
function seen_by(app: App, robots: number[]): string {
  const names = robots.slice(0, LIMITS.names).map((n) => app.robot_name(n));
  const more = robots.length - names.length;
  return `by ${names.join(", ")}${more > 0 ? ` and ${more} more` : ""}`;
}

/** `worst`: the largest share of a place that does not fit. */
function line(app: App, view: View, place: Place, worst: number): HTMLElement {
  const chosen = app.selection?.kind === "submap" && place.submap !== "" && app.selection.id === place.submap;
  const change = [
    place.missing > 0 ? `${many(place.missing, "cube")} gone` : "",
    place.appeared > 0 ? `${many(place.appeared, "cube")} new` : "",
  ].filter((words) => words !== "");
  return h(
    "button",
    {
      type: "button",
      class: `closure${chosen ? " chosen" : ""}`,
      key: `place ${place.submap || place.name}`,
      on: {
        click: () => {
          if (place.submap === "") return; // of another map than this page shows
          app.select(chosen ? null : { kind: "submap", id: place.submap });
          const at = app.world.point(place.submap, [0, 0, 0]);
          if (at && !chosen) view.look_at(at);
        },
      },
    },
    h(
      "span",
      { class: "line" },
      swatch(css(bad((1 - place.trust) / worst))),
      h("b", {}, place.name),
      h("span", { class: "seen" }, `${span(app.shown() - place.seen_s)} ago`),
    ),
    h(
      "span",
      { class: "detail" },
      `${[...change, `${share(place.trust)} fits`].join(", ")} · ${seen_by(app, place.robots)}`,
    ),
  );
}
