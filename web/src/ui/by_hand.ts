// SPDX-License-Identifier: BSD-3-Clause
/** A closure by hand: pick two places, register them, see both clouds and how the map would change, keep it or not, undo it. */
import { api } from "../api";
import type { App } from "../app";
import { correction_between } from "../derive";
import { many, metres } from "../format";
import { TIMES } from "../limits";
import { compose, inverse, kIdentity } from "../pose";
import type { Pose, Registration, SubmapId } from "../schema";
import type { Ink } from "../scene/ink";
import { PairView } from "../scene/pair_view";
import type { Spot } from "../scene/pick";
import type { Tool, View } from "../scene/view";
import { attempt, button, h, notice, panel } from "./dom";
import type { Child } from "./dom";
import { gates } from "./inspector";
import { who } from "./login";

interface Draft {
  from: SubmapId | null;
  to: SubmapId | null;
  /** Where the second is laid before it is registered; null: Tutti searches. */
  guess: Pose | null;
  answer: Registration | null;
  /** Why it is not known what it would change; "": it is, or is being computed. */
  change_why: string;
  /** Name of the closure, once it is kept. */
  kept: string | null;
  busy: boolean;
}
const draft: Draft = { from: null, to: null, guess: null, answer: null, change_why: "", kept: null, busy: false };

export function propose(app: App, from: SubmapId, to: SubmapId): void {
  begin(app, { from, to });
}

/** Another pair, or another place for it: what was found before is void. */
function begin(app: App, change: Partial<Draft>): void {
  Object.assign(draft, { guess: null, answer: null, kept: null, change_why: "" }, change);
  app.preview = null;
  app.say("tool");
}

class Pick implements Tool {
  readonly name: string;
  constructor(
    private readonly app: App,
    private readonly view: View,
    private readonly end: "from" | "to",
  ) {
    this.name = `Point at the ${end === "from" ? "first" : "second"} place`;
  }
  point(spot: Spot): void {
    set_end(this.app, this.end, spot.submap);
    this.view.use(this.end === "from" && !draft.to ? new Pick(this.app, this.view, "to") : null);
  }
  draw(ink: Ink): void {
    for (const id of [draft.from, draft.to]) {
      const placed = id ? this.app.world.placed.get(id) : null;
      if (placed) ink.dot(placed.T, 6, "#fff", "#000");
    }
  }
}

function set_end(app: App, end: "from" | "to", id: SubmapId | null): void {
  begin(app, { [end]: id });
}

export function by_hand_panel(app: App, view: View): HTMLElement {
  const clouds = new PairView(app);
  return panel(app, ["tool", "data", "me", "time"], { class: "by-hand" }, () => {
    const { from, to } = draft;
    if (from && to) clouds.show({ from, to, measured: draft.answer?.T_from_to ?? draft.guess });
    return [
      h(
        "p",
        { class: "lead" },
        "Join two places that you know to be the same. Tutti lays their clouds over each other; nothing is in the map before you keep it.",
      ),
      end_row(app, view, "from"),
      end_row(app, view, "to"),
      from && to ? [clouds.element, nudges(app), ask_row(app)] : null,
      draft.answer ? answer(app, draft.answer) : null,
      draft.kept ? kept(app, draft.kept) : null,
    ];
  });
}

function end_row(app: App, view: View, end: "from" | "to"): Child {
  const id = draft[end];
  const submaps = [...app.store.all("submap")].map(([, s]) => s).sort((a, b) => a.robot - b.robot || a.index - b.index);
  const list = `submaps-${end}`;
  const input = h("input", {
    type: "text",
    list,
    placeholder: "Robot/number",
    value: id ? app.submap_name(id) : "",
    "aria-label": end === "from" ? "First submap" : "Second submap",
    on: {
      change: ((e: Event) => {
        const name = (e.target as HTMLInputElement).value.trim();
        (e.target as HTMLInputElement).blur();
        const found = submaps.find((s) => s.name === name);
        if (found) set_end(app, end, found.id);
        else if (name) notice(`There is no submap ${name}.`, "error");
      }) as () => void,
    },
  });
  return h(
    "div",
    { class: "end" },
    h("span", {}, end === "from" ? "First" : "Second"),
    input,
    h(
      "datalist",
      { id: list },
      submaps.map((s) => h("option", { value: s.name })),
    ),
    button("Pick", () => view.use(new Pick(app, view, end)), { key: `pick ${end}`, title: "Point at it in the map" }),
  );
}

/** Lays the second cloud by hand before it is registered. */
function nudges(app: App): Child {
  if (draft.kept) return null;
  const move = (x: number, y: number, degrees: number) => {
    const yaw = (degrees * Math.PI) / 360;
    const base = draft.answer?.T_from_to ?? draft.guess ?? start_of(app);
    const turned = compose(base, [0, 0, 0, 0, 0, Math.sin(yaw), Math.cos(yaw)]);
    const guess: Pose = [turned[0] + x, turned[1] + y, turned[2], turned[3], turned[4], turned[5], turned[6]];
    begin(app, { guess });
  };
  const nudge = (text: string, title: string, x: number, y: number, degrees: number) =>
    button(text, () => move(x, y, degrees), { key: `nudge ${title}`, title, "aria-label": title, class: "square" });
  return h(
    "div",
    { class: "row" },
    h("span", { class: "soft" }, "Lay the second"),
    nudge("←", "1 m left", -1, 0, 0),
    nudge("→", "1 m right", 1, 0, 0),
    nudge("↑", "1 m forward", 0, 1, 0),
    nudge("↓", "1 m back", 0, -1, 0),
    nudge("⟲", "10° to the left", 0, 0, 10),
    nudge("⟳", "10° to the right", 0, 0, -10),
  );
}

/** As the map has them, or both at one place. */
function start_of(app: App): Pose {
  const [a, b] = [app.world.placed.get(draft.from!), app.world.placed.get(draft.to!)];
  return a && b && a.component === b.component ? compose(inverse(a.target), b.target) : kIdentity;
}

function ask_row(app: App): Child {
  if (draft.kept) return null;
  const label = draft.busy ? "Registering …" : draft.guess ? "Register from here" : "Register";
  return h(
    "div",
    { class: "row" },
    button(label, () => void register(app), {
      key: "register",
      class: draft.answer ? "" : "primary",
      disabled: draft.busy || !app.may("register"),
    }),
    draft.guess ? button("Let Tutti search", () => begin(app, {}), { class: "plain" }) : null,
  );
}

async function register(app: App): Promise<void> {
  const { from, to, guess } = draft;
  draft.busy = true;
  app.say("tool");
  await attempt(async () => {
    const answer = await api.register(from!, to!, guess);
    if (draft.from !== from || draft.to !== to) return;
    draft.answer = answer;
    if (answer.look !== null) void change(app, answer);
  });
  draft.busy = false;
  app.say("tool");
}

/** The map as it would be; it comes when it is there, and nothing waits for it. */
async function change(app: App, answer: Registration): Promise<void> {
  try {
    const after = app.store.read_poses(await api.change(answer.look!));
    const before = app.store.get("poses");
    if (draft.answer !== answer || draft.kept || !before) return;
    app.preview = correction_between(app.store, app.now(), before, after);
  } catch (error) {
    draft.change_why = error instanceof Error ? error.message : String(error);
  }
  app.say("tool");
}

/** How far the map would move: largest, where, and per robot. */
function change_words(app: App): Child {
  const change = app.preview;
  if (!change) return h("p", { class: "soft" }, draft.change_why || "Computing what it would change …");
  const per_robot = new Map<number, number>();
  for (const [id, { submap }] of app.world.placed) {
    const moved = change.moved_m[app.store.place_of(id)];
    if (moved > 0) per_robot.set(submap.robot, Math.max(per_robot.get(submap.robot) ?? 0, moved));
  }
  return [
    change.joined > 0 ? h("p", {}, `It would merge ${many(change.joined + 1, "component")} of the map.`) : null,
    change.largest_m > TIMES.ghost_m
      ? h(
          "p",
          {},
          "The map would move by up to ",
          h("b", {}, metres(change.largest_m)),
          ` (${app.submap_name(change.largest)}); `,
          [...per_robot].map(([robot, m]) => `${app.robot_name(robot)} ${metres(m)}`).join(", "),
          ". Dashed lines show where to.",
        )
      : h("p", {}, `What is joined already would move by less than ${metres(TIMES.ghost_m)}.`),
  ];
}

function answer(app: App, found: Registration): Child {
  const fits = found.found && found.hint === "" && found.evidence.every((gate) => gate.ok);
  const may_keep = found.T_from_to && app.may("closure") && !draft.kept;
  return [
    h(
      "p",
      { class: `state ${fits ? "" : "warn"}` },
      h("b", {}, fits ? "They fit." : found.found ? "Tutti would refuse this:" : "They do not fit."),
      ` ${found.why}`,
      found.hint ? h("span", { class: "detail" }, found.hint) : null,
    ),
    found.look === null || draft.kept ? null : change_words(app),
    gates(found.evidence),
    may_keep
      ? h(
          "div",
          { class: "row decide" },
          button(fits ? "Keep it in the map" : "Keep it all the same", () => void keep(app), {
            key: "keep",
            class: fits ? "primary" : "danger",
          }),
        )
      : null,
  ];
}

async function keep(app: App): Promise<void> {
  const by = await who(app);
  if (!by) return notice("A decision carries a name; nothing was sent.", "error");
  const { from, to, answer: found } = draft;
  await attempt(async () => {
    draft.kept = await api.keep_closure(from!, to!, found!.T_from_to!, by);
    app.preview = null;
    notice("Kept. The map follows with the next update.");
  });
  app.say("tool");
}

function kept(app: App, name: string): Child {
  return h(
    "div",
    { class: "row decide" },
    h("span", {}, "Kept."),
    button("Undo", () => void undo(app, name), { key: "undo", class: "danger" }),
  );
}

async function undo(app: App, name: string): Promise<void> {
  const by = await who(app);
  if (by && (await attempt(() => api.decide(name, "withdraw", by)))) {
    draft.kept = null;
    notice("Taken back. The map follows with the next update.");
    app.say("tool");
  }
}
