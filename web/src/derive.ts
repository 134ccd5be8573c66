// SPDX-License-Identifier: BSD-3-Clause
/** Derives from the store what is in no message: where robots may be, when backlogs are empty, what a correction moved. */
import { LOST_ROBOT, REACH_M, SLOWEST_MPS, TIMES } from "./limits";
import { compose, distance, inverse } from "./pose";
import { POSE_ROW } from "./schema";
import type { MapVersion, Pose, Poses, RobotStatus, Submap, SubmapId } from "./schema";
import type { Store } from "./store";

export type Presence = "here" | "silent" | "lost" | "finished" | "unknown";

export interface RobotView {
  number: number;
  /** Place among all robots; its colour. */
  index: number;
  name: string;
  status: RobotStatus | null;
  presence: Presence;
  /** Since the robot was heard, at the time that is shown; null: never. */
  silent_s: number | null;
  /** One who has finished may be heard all the same. */
  is_heard: boolean;
  /** Its newest submap in the map. */
  newest: Submap | null;
  submaps: number;
  /** Speed over its newest submaps, m/s. */
  speed_mps: number;
  /** How far it may be from where it was seen last; 0 while it is heard. */
  reach_m: number;
  drain: Drain;
}

export interface Drain {
  state: "empty" | "drains" | "grows" | "waits";
  seconds: number | null;
}

/** The maps in which robots say that they localise, most robots first. */
export function maps_in_use(robots: RobotView[]): { map: MapVersion; names: string[] }[] {
  const used = new Map<string, { map: MapVersion; names: string[] }>();
  for (const { name, status } of robots) {
    if (!status?.localisation) continue;
    const { map_id, map_version } = status;
    const key = `${map_version} ${map_id}`;
    if (!used.has(key)) used.set(key, { map: { map_id, map_version }, names: [] });
    used.get(key)!.names.push(name);
  }
  return [...used.values()].sort((a, b) => b.names.length - a.names.length);
}

/** All robots that a message names, by number. */
export function robots_at(store: Store, t: number, now: number): RobotView[] {
  const track = store.track("status");
  const index = track ? track.index(t) : -1;
  const status = index < 0 ? null : track!.values[index];
  const age = index < 0 ? 0 : Math.max(0, Math.min(t, now) - track!.times[index]);
  const by_number = new Map<number, { status: RobotStatus | null; submaps: Submap[] }>();
  for (const robot of status?.robots ?? []) by_number.set(robot.number, { status: robot, submaps: [] });
  for (const [, submap] of store.all("submap", t)) {
    let robot = by_number.get(submap.robot);
    if (!robot) by_number.set(submap.robot, (robot = { status: null, submaps: [] }));
    robot.submaps.push(submap);
  }
  const names = new Map<number, string>();
  if (by_number.size === 0)
    for (const [, { robot, name }] of store.all("trajectory", t)) {
      by_number.set(robot ?? 0, { status: null, submaps: [] });
      names.set(robot ?? 0, name);
    }
  const sorted = [...by_number].sort(([a], [b]) => a - b);
  return sorted.map(([number, { status: own, submaps }], place) =>
    view_of(store, t, age, number, place, own, submaps, names.get(number)),
  );
}

function view_of(
  store: Store,
  t: number,
  age_s: number,
  number: number,
  index: number,
  status: RobotStatus | null,
  submaps: Submap[],
  otherwise?: string,
): RobotView {
  submaps.sort((a, b) => a.until_s - b.until_s);
  const newest = submaps.at(-1) ?? null;
  const silent_s = status?.last_seen_s_ago == null ? null : status.last_seen_s_ago + age_s;
  const presence = presence_of(status, silent_s, silent_after(store));
  const speed_mps = speed_of(submaps.slice(-3));
  const away = presence === "silent" || presence === "lost";
  const name = status?.name || newest?.name.split("/")[0] || otherwise || `robot ${number}`;
  const reach_m = away && silent_s !== null ? Math.min(REACH_M, Math.max(speed_mps, SLOWEST_MPS) * silent_s) : 0;
  return {
    number,
    index,
    name,
    status,
    presence,
    silent_s,
    is_heard: silent_s !== null && silent_s < silent_after(store),
    newest,
    submaps: submaps.length,
    speed_mps,
    reach_m,
    drain: drain_of(store, t, number),
  };
}

/** As the program reports it, whose alerts follow from the same. */
export const silent_after = (store: Store): number => store.get("mission")?.robot_silent_s ?? Infinity;

function presence_of(status: RobotStatus | null, silent_s: number | null, silent_after_s: number): Presence {
  if (!status || silent_s === null) return "unknown";
  if (status.finished && status.backlog_submaps === 0) return "finished";
  if (silent_s < silent_after_s) return "here";
  return silent_s < LOST_ROBOT * silent_after_s ? "silent" : "lost";
}

function speed_of(submaps: Submap[]): number {
  let way = 0;
  let time = 0;
  for (const { path, from_s, until_s } of submaps) {
    for (let i = 1; i < path.length; ++i) way += distance(path[i - 1], path[i]);
    time += until_s - from_s;
  }
  return time > 0 ? way / time : 0;
}

/** When a backlog will be empty if it goes on as over the last minute. */
export function drain_of(store: Store, t: number, robot: number): Drain {
  const track = store.track("status");
  const last = track ? track.index(t) : -1;
  const backlog = (i: number) => track!.values[i]?.robots.find((r) => r.number === robot)?.backlog_bytes ?? null;
  const now = last < 0 ? null : backlog(last);
  if (now === null || now === 0) return { state: "empty", seconds: null };
  let first = last;
  while (first > 0 && track!.times[last] - track!.times[first] < TIMES.drain_window_s && backlog(first - 1) !== null)
    --first;
  const time = track!.times[last] - track!.times[first];
  const drained = (backlog(first) ?? now) - now;
  if (time <= 0 || drained === 0) return { state: "waits", seconds: null };
  return drained > 0 ? { state: "drains", seconds: (now * time) / drained } : { state: "grows", seconds: null };
}

export interface Correction {
  t: number;
  /** Each part as it was, laid where its first submap is now. */
  before: Poses;
  after: Poses;
  /** How far each submap moved, by place; NaN: not comparable. */
  moved_m: Float64Array;
  largest_m: number;
  largest: SubmapId;
  /** Parts of the map that became one. */
  joined: number;
  /** By part after it: the part before it whose frame it has. */
  keeper: Map<number, number>;
}

/** The correction by the newest poses at t; null when nothing changed. */
export function correction_at(store: Store, t: number): Correction | null {
  const track = store.track("poses");
  const i = track ? track.index(t) : -1;
  if (i < 1 || !track!.values[i] || !track!.values[i - 1]) return null;
  return correction_between(store, track!.times[i], track!.values[i - 1]!, track!.values[i]!);
}

/** By part: how many submaps it has in common with each part of the other map. */
function common_parts(n: number, of: Poses, other: Poses): Map<number, Map<number, number>> {
  const out = new Map<number, Map<number, number>>();
  for (let p = 0; p < n; ++p) {
    const [here, there] = [of.rows[p * POSE_ROW], other.rows[p * POSE_ROW]];
    if (!Number.isFinite(here) || !Number.isFinite(there)) continue;
    const parts = out.get(here) ?? new Map<number, number>();
    parts.set(there, (parts.get(there) ?? 0) + 1);
    out.set(here, parts);
  }
  return out;
}

/** By part: the part of the other map that most of it is in. */
const most_of = (common: Map<number, Map<number, number>>): Map<number, number> =>
  new Map([...common].map(([part, parts]) => [part, [...parts].sort((a, b) => b[1] - a[1] || a[0] - b[0])[0][0]]));

/**
 * Distances make sense inside one frame only: of the old parts that are now in one, the largest keeps its frame; the
 * others were joined to it. Where a part as a whole lies is nobody's choice, so it is seen from its first submap.
 */
export function correction_between(store: Store, t: number, was: Poses, after: Poses): Correction {
  const n = Math.min(was.rows.length, after.rows.length) / POSE_ROW;
  const sizes = common_parts(n, after, was);
  const keeper = most_of(sizes);
  const heir = most_of(common_parts(n, was, after));
  const before: Poses = { ...was, rows: was.rows.slice() };
  const shift = new Map<number, Pose>();
  const moved_m = new Float64Array(n).fill(Number.NaN);
  let largest_m = 0;
  let largest = "";
  for (let p = 0; p < n; ++p) {
    const at = p * POSE_ROW;
    const [part, old] = [after.rows[at], was.rows[at]];
    if (keeper.get(part) !== old || heir.get(old) !== part) continue;
    const [now, then] = [after.rows.subarray(at + 1, at + 8), was.rows.subarray(at + 1, at + 8)].map((row) =>
      Array.from(row),
    );
    if (!shift.has(part)) shift.set(part, compose(now, inverse(then)));
    before.rows.set(compose(shift.get(part)!, then), at + 1);
    moved_m[p] = distance(
      before.rows.subarray(at + 1, at + 4) as unknown as number[],
      after.rows.subarray(at + 1, at + 4) as unknown as number[],
    );
    if (moved_m[p] > largest_m) [largest_m, largest] = [moved_m[p], store.id_at(p)];
  }
  const joined = [...sizes.values()].reduce((sum, parts) => sum + parts.size - 1, 0);
  return { t, before, after, moved_m, largest_m, largest, joined, keeper };
}

/** The server's wall clock at mission time t, ms since 1970; null: not known. */
export function wall_ms_at(store: Store, t: number): number | null {
  const track = store.track("status");
  const wall = (i: number): number | null => (track?.values[i]?.wall_ns ?? 0) / 1e6 || null;
  const i = track ? track.index(t) : -1;
  const here = wall(i);
  if (!track || here === null) return null;
  // Played at another speed, mission time and the wall's do not go alike: as between the two statuses around it.
  const other = wall(i + 1) !== null ? i + 1 : i - 1;
  const there = wall(other);
  const rate = there === null ? 1000 : (there - here) / (track.times[other] - track.times[i]);
  return here + (t - track.times[i]) * (Number.isFinite(rate) ? rate : 1000);
}

/** The range between the mission's first and last message, for the time line. */
export function time_range(store: Store, now: number): { first: number; last: number } {
  const mission = store.get("mission");
  const last = Math.max(now, store.newest, mission && mission.mode !== "live" ? (mission.duration_s ?? 0) : 0);
  return {
    first: mission && mission.mode !== "live" ? 0 : Math.min(store.get("history")?.first_s ?? store.oldest, last),
    last,
  };
}

/** The worst disagreement of every submap with its robot's odometry, over all scales. */
export function worst_disagreement(store: Store, t: number): Map<SubmapId, number> {
  const out = new Map<SubmapId, number>();
  const submaps = [...store.all("submap", t)].map(([, submap]) => submap);
  for (const [, { robot, nodes }] of store.all("disagreement", t))
    for (const node of nodes) {
      const id = node.submap ?? submap_at(submaps, robot, node.t)?.id;
      if (id) out.set(id, Math.max(out.get(id) ?? 0, ...node.significance));
    }
  return out;
}

/** The submap that a robot drew at time t. */
export const submap_at = (submaps: Iterable<Submap>, robot: number | null, t: number): Submap | null => {
  for (const submap of submaps) if (submap.robot === robot && t >= submap.from_s && t <= submap.until_s) return submap;
  return null;
};
