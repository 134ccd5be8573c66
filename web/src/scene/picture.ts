// SPDX-License-Identifier: BSD-3-Clause
/** Everything over the points: tracks, closures, robots, circles, ghosts, marks, scales. */
import type { App } from "../app";
import { css, robot_rgb } from "../colours";
import type { Correction } from "../derive";
import { beginning, metres, moment, span } from "../format";
import { TIMES } from "../limits";
import { distance, transform } from "../pose";
import { POSE_ROW } from "../schema";
import type { Closure, ClosureState, Vec3 } from "../schema";
import type { Ink } from "./ink";
import { estimate_at, place_at, point_at, position_of } from "./where";

export interface Palette {
  ink: string;
  soft: string;
  halo: string;
  accent: string;
  accepted: string;
  within: string;
  candidate: string;
  rejected: string;
  ghost: string;
  mark: string;
  onboard: string;
}
export const palette_of = (dark: boolean): Palette =>
  dark
    ? {
        ink: "#e7e9ee",
        soft: "#9aa4b2",
        halo: "rgba(12,16,23,.85)",
        accent: "#4fb3ff",
        accepted: "#2fd3a0",
        within: "#5f8fd8",
        candidate: "#e6b422",
        rejected: "#ff5d75",
        ghost: "#f2e8c9",
        mark: "#ffd54a",
        onboard: "#ff8a4c",
      }
    : {
        ink: "#1d2430",
        soft: "#5d6675",
        halo: "rgba(255,255,255,.88)",
        accent: "#0072b2",
        accepted: "#00855f",
        within: "#3f6fb8",
        candidate: "#a67c00",
        rejected: "#c8203c",
        ghost: "#5a4a12",
        mark: "#8a6100",
        onboard: "#c24e00",
      };

export const state_colour = (p: Palette, state: ClosureState, within = false): string =>
  state === "accepted" ? (within ? p.within : p.accepted) : state === "candidate" ? p.candidate : p.rejected;

/** `full`: with halos, dashes and filled rings, which take most of the time where there is no GPU. */
export function draw_picture(app: App, ink: Ink, full: boolean): void {
  const palette = palette_of(app.dark);
  ink.begin(full);
  const { layers } = app.options;
  if (layers.estimates) draw_estimates(app, ink, palette);
  if (layers.tracks) draw_tracks(app, ink);
  draw_closures(app, ink, palette);
  if (app.preview && app.tab === "by hand") draw_preview(app, app.preview, ink, palette);
  else if (app.shows_ghost()) draw_ghost(app, ink, palette);
  draw_selection(app, ink, palette);
  if (layers.robots || layers.reach) draw_robots(app, ink, palette);
  if (layers.marks) draw_marks(app, ink, palette);
  if (app.cursor !== null) draw_cursor(app, ink, palette, app.cursor);
  draw_part_names(app, ink, palette);
  draw_scale(ink, palette);
}

function draw_tracks(app: App, ink: Ink): void {
  const chosen = app.selection?.kind === "robot" ? app.selection.number : null;
  for (const placed of app.world.placed.values()) {
    const { robot, path } = placed.submap;
    const loud = chosen === null || chosen === robot;
    const colour = css(robot_rgb(app.robot_index(robot), app.dark), loud ? 0.95 : 0.3);
    const points = path.map((p) => transform(placed.T, p));
    ink.line(
      points,
      { colour, width: chosen === robot ? 3 : 1.8 },
      { kind: "submap", id: placed.id, at: points[points.length >> 1] ?? [0, 0, 0] },
    );
  }
}

const kEstimates: Record<string, { dash: number[]; width: number }> = {
  onboard: { dash: [6, 4], width: 1.4 },
  corrected: { dash: [], width: 1.4 },
  reference: { dash: [1, 5], width: 1.6 },
  server: { dash: [], width: 2.4 },
};

/** A report's other estimates, as far as the time that is shown. */
function draw_estimates(app: App, ink: Ink, palette: Palette): void {
  for (const [name, trajectory] of app.store.all("trajectory")) {
    const [robot, kind] = name.split("/");
    const style = kEstimates[kind] ?? kEstimates.corrected;
    if (kind === "server" && app.world.placed.size > 0) continue; // the tracks
    const index = app.robots.find((r) => r.number === trajectory.robot || r.name === robot)?.index ?? 0;
    const offset = app.world.offset_of(trajectory.component);
    const points: number[][] = [];
    for (let i = 0; i < trajectory.points.length; i += 4) {
      if (trajectory.points[i] > app.shown()) break;
      points.push([0, 1, 2].map((k) => trajectory.points[i + 1 + k] + offset[k]));
    }
    const colour = kind === "reference" ? palette.soft : css(robot_rgb(index, app.dark), kind === "onboard" ? 0.75 : 1);
    ink.line(points, { colour, ...style });
  }
}

/** Where a closure's ends are drawn. */
export function ends_of(app: App, closure: Closure, link = 0): [Vec3, Vec3] | null {
  const at = closure.links[link];
  const from = app.world.point(closure.from, at?.at_from ?? [0, 0, 0]);
  const to = app.world.point(closure.to, at?.at_to ?? [0, 0, 0]);
  return from && to ? [from, to] : null;
}

function draw_closures(app: App, ink: Ink, palette: Palette): void {
  const { layers } = app.options;
  for (const state of ["rejected", "candidate", "accepted"] as const) {
    if (!layers[state]) continue;
    for (const [name, closure] of app.store.all("closure", app.at())) {
      if (closure.state !== state) continue;
      const ends = ends_of(app, closure);
      if (!ends) continue;
      const within =
        app.world.placed.get(closure.from)?.submap.robot === app.world.placed.get(closure.to)?.submap.robot;
      const dash = state === "candidate" ? [5, 4] : state === "rejected" ? [2, 4] : [];
      ink.line(
        ends,
        { colour: state_colour(palette, state, within), width: closure.by_hand ? 2.6 : 1.2, dash },
        { kind: "closure", name },
      );
    }
  }
}

function draw_selection(app: App, ink: Ink, palette: Palette): void {
  const s = app.selection;
  if (s?.kind === "closure") {
    const closure = app.store.get("closure", app.at(), s.name);
    if (!closure) return;
    closure.links.forEach((_, i) => {
      const ends = ends_of(app, closure, i);
      if (!ends) return;
      ink.line(ends, { colour: palette.ink, width: 4 });
      ink.line(ends, { colour: state_colour(palette, closure.state), width: 2.2 });
      for (const end of ends) ink.dot(end, 4, state_colour(palette, closure.state), palette.ink);
    });
  } else if (s?.kind === "submap") {
    const placed = app.world.placed.get(s.id);
    if (!placed) return;
    const points = placed.submap.path.map((p) => transform(placed.T, p));
    ink.line(points, { colour: palette.ink, width: 4.5 });
    if (points[0])
      ink.label(points[points.length >> 1], placed.submap.name, palette.ink, palette.halo, undefined, true);
  }
}

function draw_robots(app: App, ink: Ink, palette: Palette): void {
  for (const robot of app.robots) {
    const at = position_of(app, robot);
    if (!at) continue;
    const away = robot.presence === "silent" || robot.presence === "lost";
    const colour = away ? "#8a929e" : css(robot_rgb(robot.index, app.dark));
    const target = { kind: "robot", number: robot.number } as const;
    if (away && app.options.layers.reach && robot.reach_m > 0)
      ink.ring(
        at,
        robot.reach_m,
        { colour: palette.candidate, dash: [6, 5], width: 1.5 },
        app.dark ? "rgba(230,180,34,.09)" : "rgba(166,124,0,.10)",
      );
    if (!app.options.layers.robots) continue;
    const chosen = app.selection?.kind === "robot" && app.selection.number === robot.number;
    ink.dot(at, chosen ? 8 : 6, colour, chosen ? palette.ink : palette.halo, target);
    const suffix = away ? `  silent ${span(robot.silent_s)}, within ${metres(robot.reach_m)}` : "";
    ink.label(at, robot.name + suffix, away ? palette.soft : palette.ink, palette.halo, target, true);
  }
}

function draw_ghost(app: App, ink: Ink, palette: Palette): void {
  const { before, moved_m, largest, largest_m } = app.correction!;
  for (const [id, placed] of app.world.placed) {
    const place = app.store.place_of(id);
    if (!(moved_m[place] > TIMES.ghost_m)) continue;
    const offset = app.world.offset_of(placed.component);
    const old = Array.from(before.rows.subarray(place * POSE_ROW + 1, place * POSE_ROW + 8));
    for (let k = 0; k < 3; ++k) old[k] += offset[k];
    const points = placed.submap.path.map((p) => transform(old, p));
    ink.line(points, { colour: palette.ghost, width: 1.3, dash: [4, 4] });
    const middle = points.length >> 1;
    const now = app.world.point(id, placed.submap.path[middle] ?? [0, 0, 0]);
    if (points[middle] && now) ink.line([points[middle], now], { colour: palette.ghost, width: 1 });
  }
  const at = app.world.placed.get(largest);
  if (at)
    ink.label(
      transform(at.T, at.submap.path[at.submap.path.length >> 1] ?? [0, 0, 0]),
      `corrected by ${metres(largest_m)}`,
      palette.ghost,
      palette.halo,
      undefined,
      true,
    );
}

/** Where everything would be if a closure by hand were kept; parts that it joins come to the part that keeps its frame. */
function draw_preview(
  app: App,
  { before, after, moved_m, largest, largest_m, keeper }: Correction,
  ink: Ink,
  palette: Palette,
): void {
  for (const [id, placed] of app.world.placed) {
    const at = app.store.place_of(id) * POSE_ROW;
    const part = keeper.get(after.rows[at]);
    if (part === undefined || !(moved_m[at / POSE_ROW] > TIMES.ghost_m || part !== before.rows[at])) continue;
    const offset = app.world.offset_of(part);
    const next = Array.from(after.rows.subarray(at + 1, at + 8), (x, k) => x + (offset[k] ?? 0));
    const points = placed.submap.path.map((p) => transform(next, p));
    ink.line(points, { colour: palette.ghost, width: 1.6, dash: [4, 4] });
    const middle = points.length >> 1;
    const now = app.world.point(id, placed.submap.path[middle] ?? [0, 0, 0]);
    if (points[middle] && now && part === before.rows[at])
      ink.line([now, points[middle]], { colour: palette.ghost, width: 1 });
  }
  const at = app.world.placed.get(largest);
  if (at && largest_m > TIMES.ghost_m)
    ink.label(
      transform(at.T, at.submap.path[at.submap.path.length >> 1] ?? [0, 0, 0]),
      `would move by ${metres(largest_m)}`,
      palette.ghost,
      palette.halo,
      undefined,
      true,
    );
}

function draw_marks(app: App, ink: Ink, palette: Palette): void {
  for (const [id, mark] of app.store.all("mark", app.at())) {
    const at = app.world.point(mark.submap, mark.at);
    if (!at) continue;
    const target = { kind: "mark", id } as const;
    const chosen = app.selection?.kind === "mark" && app.selection.id === id;
    ink.dot(at, chosen ? 7 : 5, palette.mark, palette.ink, target);
    ink.label(at, beginning(mark.text, 40) || "mark", palette.mark, palette.halo, target);
  }
}

/** More have their names alone. */
const kFewParts = 4;

/** Where there is more than one part, each has its name. */
function draw_part_names(app: App, ink: Ink, palette: Palette): void {
  const { parts } = app.world;
  if (parts.size < 2) return;
  const largest = Math.max(...[...parts.values()].map((p) => p.submaps));
  const beside = parts.size > kFewParts ? "" : ": not merged, placed beside";
  for (const part of parts.values()) {
    const at = [0, 1, 2].map((k) => (k === 1 ? part.low[1] : (part.low[k] + part.high[k]) / 2) + part.offset[k]);
    const text = part.submaps === largest ? `part ${part.component + 1}` : `part ${part.component + 1}${beside}`;
    const spot = ink.eye.project(at);
    if (spot) ink.text(spot[0] - 20, spot[1] + 24, text, palette.soft, palette.halo);
  }
}

/** Where everybody was at the time that somebody points at in a plot; in a report, by every estimate. */
function draw_cursor(app: App, ink: Ink, palette: Palette, t: number): void {
  for (const robot of app.robots) {
    const at = place_at(app, robot.number, t) ?? estimate_at(app, robot.number, t);
    if (!at) continue;
    ink.dot(at, 7, css(robot_rgb(robot.index, app.dark)), palette.ink);
    ink.label(at, `${robot.name} at ${moment(t)}`, palette.ink, palette.halo, undefined, true);
    for (const [name, trajectory] of app.store.all("trajectory")) {
      if (trajectory.robot !== robot.number && name.split("/")[0] !== robot.name) continue;
      const other = point_at(trajectory.points, t);
      const kind = name.split("/")[1];
      if (!other || kind === "server") continue;
      const shown = other.map((x, k) => x + app.world.offset_of(trajectory.component)[k]);
      ink.line([at, shown], { colour: palette.soft, width: 1 });
      ink.dot(shown, 4, estimate_colour(palette, kind), palette.halo);
      const off_m = distance(at, shown);
      if (off_m > kLabelled_m) ink.label(shown, `${kind}, ${metres(off_m)} off`, palette.soft, palette.halo);
    }
  }
}

/** Estimates nearer than this to the map have a dot and no text. */
const kLabelled_m = 0.3;

const estimate_colour = (palette: Palette, kind: string): string =>
  kind === "onboard" ? palette.onboard : kind === "corrected" ? palette.accent : palette.ink;

function draw_scale(ink: Ink, palette: Palette): void {
  const { eye } = ink;
  const per_m = eye.pixels_per_m(eye.distance);
  const most = 130 / per_m;
  const decade = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((m) => m * decade).find((m) => m <= most) ?? decade;
  const [x, y] = [18, eye.height - 20];
  const width = length * per_m;
  for (const stroke of [
    { colour: palette.halo, width: 5 },
    { colour: palette.ink, width: 1.6 },
  ]) {
    ink.bar(x, y, x + width, y, stroke);
    ink.bar(x, y - 5, x, y + 1, stroke);
    ink.bar(x + width, y - 5, x + width, y + 1, stroke);
  }
  ink.text(x + width + 8, y + 4, length >= 1000 ? `${length / 1000} km` : `${length} m`, palette.ink, palette.halo);
  draw_compass(ink, palette, x + 22, y - 48);
}

/** Where the map's x and y go. */
function draw_compass(ink: Ink, palette: Palette, x: number, y: number): void {
  const a = ink.eye.heading;
  for (const [name, right, up] of [
    ["x", Math.cos(a), -Math.sin(a)],
    ["y", Math.sin(a), Math.cos(a)],
  ] as const) {
    ink.bar(x, y, x + 20 * right, y - 20 * up, { colour: palette.soft, width: 1.5 });
    ink.text(x + 26 * right - 3, y - 26 * up + 4, name, palette.soft, palette.halo);
  }
}
