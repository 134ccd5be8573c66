// SPDX-License-Identifier: BSD-3-Clause
/** Marks: a place, a text, a photo. Pinned to a submap, so that they move with the map. */
import { api } from "../api";
import type { App } from "../app";
import { is_photo } from "../schema";
import { metres, wall } from "../format";
import { LIMITS } from "../limits";
import type { Mark } from "../schema";
import type { Ink } from "../scene/ink";
import type { Spot } from "../scene/pick";
import type { Tool, View } from "../scene/view";
import { attempt, button, h, notice, panel } from "./dom";
import type { Child } from "./dom";
import { who } from "./login";

const kPhoto_px = 1280;
/** The server takes 1 MiB. */
const kPhoto_bytes = 1_000_000;

const draft: { spot: Spot | null; photo: string | null } = { spot: null, photo: null };

class PlaceMark implements Tool {
  readonly name = "Point at the place";
  constructor(
    private readonly app: App,
    private readonly view: View,
  ) {}
  point(spot: Spot): void {
    draft.spot = spot;
    this.view.use(null);
    this.app.say("tool");
  }
  draw(_ink: Ink): void {}
}

export function marks_panel(app: App, view: View): HTMLElement {
  const text = h("textarea", {
    rows: 2,
    maxlength: "400",
    placeholder: "What is here?",
    "aria-label": "Words of the mark",
  });
  return h(
    "div",
    { class: "marks" },
    panel(app, ["tool", "me", "time"], {}, () => (app.may("mark") ? [form(app, view, text)] : [])),
    panel(app, ["data", "time", "selection", "me"], {}, () => {
      const all = [...app.store.all("mark", app.at())];
      return [
        all.length === 0 ? h("p", { class: "empty" }, "No marks yet.") : null,
        all.slice(0, LIMITS.rows).map(([id, mark]) => line(app, view, id, mark)),
      ];
    }),
  );
}

function form(app: App, view: View, text: HTMLTextAreaElement): Child {
  if (!draft.spot)
    return h(
      "div",
      { class: "row" },
      button("New mark", () => view.use(new PlaceMark(app, view)), { class: "primary", key: "new mark" }),
    );
  const photo = h("input", {
    type: "file",
    accept: "image/*",
    class: "hidden",
    "aria-label": "Photo",
    on: {
      change: ((e: Event) => {
        const file = (e.target as HTMLInputElement).files?.[0];
        if (file)
          void attempt(async () => {
            draft.photo = await shrink(file);
            app.say("tool");
          });
      }) as () => void,
    },
  });
  return h(
    "div",
    { class: "sheet" },
    h("p", {}, `In ${app.submap_name(draft.spot.submap)}`),
    text,
    draft.photo ? h("img", { src: draft.photo, alt: "Photo of the mark" }) : null,
    h(
      "div",
      { class: "row" },
      button("Save", () => void save(app, text), { class: "primary", key: "save mark" }),
      h("label", { class: "button" }, draft.photo ? "Another photo" : "Photo", photo),
      button("Cancel", () => clear(app, text), { key: "cancel mark" }),
    ),
  );
}

function clear(app: App, text: HTMLTextAreaElement): void {
  Object.assign(draft, { spot: null, photo: null });
  text.value = "";
  app.say("tool");
}

async function save(app: App, text: HTMLTextAreaElement): Promise<void> {
  const by = await who(app);
  if (!by) return notice("A mark carries a name; nothing was sent.", "error");
  const { submap, at } = draft.spot!;
  if (await attempt(() => api.mark(submap, at, text.value.trim(), draft.photo, by))) clear(app, text);
}

/** Photos become small JPEGs: they go over the radio, and nothing but pixels is in them. */
async function shrink(file: Blob): Promise<string> {
  const image = await createImageBitmap(file).catch(() => {
    throw new Error("This file is no picture that the browser can read.");
  });
  const scale = Math.min(1, kPhoto_px / Math.max(image.width, image.height));
  const canvas = h("canvas", { width: Math.round(image.width * scale), height: Math.round(image.height * scale) });
  canvas.getContext("2d")!.drawImage(image, 0, 0, canvas.width, canvas.height);
  const at = (quality: number) => canvas.toDataURL("image/jpeg", quality);
  return [0.8, 0.6, 0.4].map(at).find((url) => url.length * 0.75 < kPhoto_bytes) ?? at(0.2);
}

function line(app: App, view: View, id: string, mark: Mark): HTMLElement {
  const chosen = app.selection?.kind === "mark" && app.selection.id === id;
  const sigma_m = app.world.placed.get(mark.submap)?.sigma_m ?? NaN;
  return h(
    "article",
    { class: `mark${chosen ? " chosen" : ""}` },
    h(
      "button",
      {
        type: "button",
        class: "closure",
        key: `mark ${id}`,
        "aria-pressed": String(chosen),
        on: {
          click: () => {
            app.select(chosen ? null : { kind: "mark", id });
            const at = app.world.point(mark.submap, mark.at);
            if (at && !chosen) view.look_at(at);
          },
        },
      },
      h(
        "span",
        { class: "line" },
        h("b", {}, mark.text.split("\n")[0] || "Mark"),
        h("span", { class: "seen" }, wall(mark.wall_ns)),
      ),
      h("span", { class: "detail" }, `${mark.by || "somebody"}, ${app.submap_name(mark.submap)}`),
    ),
    chosen
      ? [
          mark.text.includes("\n") ? h("p", { class: "words" }, mark.text) : null,
          Number.isFinite(sigma_m)
            ? h(
                "p",
                { class: "detail" },
                `Its submap is known to ${metres(sigma_m)} (one sigma) beside the rest of its robot's way. How well its place is known from the first keyframe of its component, which is another number, is in the table of marks (tutti export STATE/map.tutti --live -o marks.csv).`,
              )
            : null,
          mark.photo && is_photo(mark.photo) ? h("img", { src: mark.photo, alt: "Photo of the mark" }) : null,
          app.may("mark")
            ? h(
                "div",
                { class: "row" },
                button("Remove", () => void attempt(() => api.unmark(id)), { class: "danger", key: `remove ${id}` }),
              )
            : null,
        ]
      : null,
  );
}
