// SPDX-License-Identifier: BSD-3-Clause
/** From JSON to the values of schema.ts; one function per kind of key, one table of all of them. */
import {
  count,
  DecodeError,
  fields,
  list,
  maybe,
  maybe_list,
  named_numbers,
  number,
  numbers,
  one_of,
  text,
  words,
} from "./reading";
import type { Fields } from "./reading";
import type { Rgb, RobotColours } from "./colours";
import { POSE_ROW } from "./schema";
import type * as s from "./schema";

/** Gives every submap's id its place in the rows of poses. */
export interface IdTable {
  place(id: string): number;
}

const kStates = ["accepted", "rejected", "candidate"] as const;
const kWishes = ["accept", "reject", "withdraw"] as const;
const kSeverities = ["error", "warning", "info"] as const;
const vec3 = (value: unknown, what: string) => numbers<s.Vec3>(value, what, 3);
const pose = (value: unknown, what: string) => numbers<s.Pose>(value, what, 7);

function mission(value: unknown): s.Mission {
  const f = fields(value, "mission");
  return {
    name: text(f.name, "name"),
    description: words(f.description, "description"),
    version: words(f.version, "version"),
    mode: f.mode === "report" || f.mode === "compare" ? f.mode : "live",
    duration_s: maybe(f.duration_s, "duration_s"),
    robots: maybe_list(f.robots, "robots", text),
    robot_silent_s: maybe(f.robot_silent_s, "robot_silent_s") ?? Infinity,
    robot_colours: robot_colours(f.robot_colours),
  };
}

function robot_colours(value: unknown): RobotColours | null {
  if (value === null || value === undefined) return null;
  const f = fields(value, "robot_colours");
  const all = (of: unknown, what: string) => list(of, what, (one) => numbers<Rgb>(one, what, 3));
  const out = { light: all(f.light, "light"), dark: all(f.dark, "dark") };
  if (out.light.length === 0 || out.dark.length === 0) throw new DecodeError("robot_colours: expected some");
  return out;
}

function position(value: unknown): s.Vec3 | null {
  if (value === null || value === undefined) return null;
  return vec3(fields(value, "T_odom_body").translation_m, "translation_m");
}

function robot_status(value: unknown, what: string): s.RobotStatus {
  const f = fields(value, what);
  return {
    number: number(f.number, "number"),
    name: words(f.name, "name"),
    session: words(f.session, "session"),
    last_seen_s_ago: maybe(f.last_seen_s_ago, "last_seen_s_ago"),
    last_update_s_ago: maybe(f.last_update_s_ago, "last_update_s_ago"),
    submaps: count(f.submaps, "submaps"),
    submaps_begun: maybe(f.submaps_begun, "submaps_begun"),
    refused_submaps: count(f.refused_submaps, "refused_submaps"),
    unread_submaps: count(f.unread_submaps, "unread_submaps"),
    conflict: words(f.conflict, "conflict"),
    version: words(f.version, "version"),
    backlog_submaps: count(f.backlog_submaps, "backlog_submaps"),
    backlog_bytes: count(f.backlog_bytes, "backlog_bytes"),
    heard_revision: count(f.heard_revision, "heard_revision"),
    update_age_s: maybe(f.update_age_s, "update_age_s"),
    keyframes: count(f.keyframes, "keyframes"),
    position: position(f.T_odom_body),
    alerts: count(f.alerts, "alerts"),
    finished: f.finished === true,
    trouble: words(f.trouble, "trouble"),
    battery_v: maybe(f.battery_v, "battery_v"),
    battery_percent: maybe(f.battery_percent, "battery_percent"),
    localisation: f.localisation === undefined ? "" : words(f.localisation, "localisation"),
    localisation_why: f.localisation_why === undefined ? "" : words(f.localisation_why, "localisation_why"),
    map_id: f.map_id === undefined ? "" : words(f.map_id, "map_id"),
    map_version: f.map_version === undefined ? 0 : count(f.map_version, "map_version"),
    floor: f.floor === undefined ? 1 : count(f.floor, "floor"),
  };
}

function worker_status(value: unknown, what: string): s.WorkerStatus {
  const f = fields(value, what);
  return {
    number: number(f.number, "number"),
    name: words(f.name, "name"),
    last_seen_s_ago: maybe(f.last_seen_s_ago, "last_seen_s_ago"),
    jobs_done: count(f.jobs_done, "jobs_done"),
    trouble: words(f.trouble, "trouble"),
  };
}

function status(value: unknown): s.Status {
  const f = fields(value, "status");
  return {
    version: words(f.version, "version"),
    revision: count(f.revision, "revision"),
    submaps: count(f.submaps, "submaps"),
    closures: count(f.closures, "closures"),
    components: count(f.components, "components"),
    pending_jobs: count(f.pending_jobs, "pending_jobs"),
    has_news: f.has_news === true,
    robots: maybe_list(f.robots, "robots", robot_status),
    workers: maybe_list(f.workers, "workers", worker_status),
    refused: maybe_list(f.refusals, "refusals", (r, what) => {
      const e = fields(r, what);
      return {
        from: words(e.from, "from"),
        kind: words(e.kind, "kind"),
        count: count(e.count, "count"),
        why: words(e.last_why, "last_why"),
      };
    }),
    trouble: words(f.trouble, "trouble"),
    wall_ms: (maybe(f.wall_ns, "wall_ns") ?? 0) / 1e6 || null,
    verifier: words(f.verifier, "verifier"),
    waiting: count(f.waiting, "waiting"),
    why_waiting: words(f.why_waiting, "why_waiting"),
    numbers: named_numbers(f),
  };
}

function alert(value: unknown, what: string): s.Alert {
  const f = fields(value, what);
  return {
    id: words(f.id, "id"),
    severity: one_of(f.severity, "severity", kSeverities),
    what: text(f.what, "what"),
    where: words(f.where, "where"),
    since_s: maybe(f.since_s, "since_s"),
    todo: words(f.todo, "todo"),
    robot: maybe(f.robot, "robot"),
    submap: f.submap ? text(f.submap, "submap") : null,
    closure: f.closure ? text(f.closure, "closure") : null,
  };
}

function submap(value: unknown): s.Submap {
  const f = fields(value, "submap");
  return {
    id: text(f.id, "id"),
    name: text(f.name, "name"),
    robot: number(f.robot, "robot"),
    session: words(f.session, "session"),
    index: number(f.index, "index"),
    from_s: count(f.from_s, "from_s"),
    until_s: count(f.until_s, "until_s"),
    path: list(f.path, "path", vec3),
    T_odom_submap: f.T_odom_submap ? pose(f.T_odom_submap, "T_odom_submap") : null,
    points: count(f.points, "points"),
    bytes: count(f.bytes, "bytes"),
  };
}

function poses(value: unknown, ids: IdTable): s.Poses {
  const f = fields(value, "poses");
  const entries = Object.entries(fields(f.submaps, "submaps"));
  const places = entries.map(([id]) => ids.place(id));
  const rows = new Float64Array((Math.max(-1, ...places) + 1) * POSE_ROW).fill(Number.NaN);
  entries.forEach(([id, row], i) => {
    if (!Array.isArray(row) || row.length < 8)
      throw new DecodeError(`submaps.${id}: expected 8 to ${POSE_ROW} numbers`);
    const first = places[i] * POSE_ROW;
    for (let k = 0; k < 8; ++k) rows[first + k] = number(row[k], id);
    rows[first + 8] = maybe(row[8], id) ?? Number.NaN;
    rows[first + 9] = maybe(row[9], id) ?? Number.NaN;
  });
  return {
    revision: count(f.revision, "revision"),
    accepted: count(f.accepted, "accepted"),
    components: count(f.components, "components"),
    unshown: count(f.unshown ?? 0, "unshown"),
    rows,
  };
}

export function gate(value: unknown, what: string): s.Gate {
  const f = fields(value, what);
  return {
    reason: words(f.reason, "reason"),
    value: maybe(f.value, "value"),
    limit: maybe(f.limit, "limit"),
    unit: words(f.unit, "unit"),
    at_least: f.at_least === true,
    ok: f.ok === true,
  };
}

function link(value: unknown, what: string): s.Link {
  const f = fields(value, what);
  return {
    at_from: vec3(f.at_from, "at_from"),
    at_to: vec3(f.at_to, "at_to"),
    T_from_to: pose(f.T_from_to, "T_from_to"),
    misfit_m: maybe(f.misfit_m, "misfit_m"),
    misfit_deg: maybe(f.misfit_deg, "misfit_deg"),
    chi2: maybe(f.chi2, "chi2"),
    reason: words(f.reason, "reason"),
  };
}

function operator_decision(value: unknown): s.Closure["decision"] {
  if (value === null || value === undefined) return null;
  const f = fields(value, "decision");
  return { wish: one_of(f.wish, "wish", kWishes), by: words(f.by, "by"), wall_ns: maybe(f.wall_ns, "wall_ns") };
}

function closure(value: unknown): s.Closure {
  const f = fields(value, "closure");
  return {
    name: text(f.name, "name"),
    from: text(f.from, "from"),
    to: text(f.to, "to"),
    state: one_of(f.state, "state", kStates),
    reason: words(f.reason, "reason"),
    by_hand: f.by_hand === true,
    decision: operator_decision(f.decision),
    verifier: words(f.verifier, "verifier"),
    worker: words(f.worker, "worker"),
    verified_ns: maybe(f.verified_ns, "verified_ns"),
    links: maybe_list(f.links, "links", link),
    evidence: maybe_list(f.evidence, "evidence", gate),
  };
}

function disagreement(value: unknown): s.Disagreement {
  const f = fields(value, "disagreement");
  return {
    robot: maybe(f.robot, "robot"),
    scale_length_m: list(f.scale_length_m, "scale_length_m", number),
    nodes: list(f.nodes, "nodes", (n, what) => {
      const e = fields(n, what);
      const significance = list(e.significance, "significance", number);
      return {
        submap: e.submap ? text(e.submap, "submap") : null,
        t: number(e.t, "t"),
        distance_m: count(e.distance_m, "distance_m"),
        d_m: maybe_list(e.d, "d", number),
        significance,
      };
    }),
    origins: maybe_list(f.origins, "origins", (o, what) => {
      const e = fields(o, what);
      const n = (key: string) => count(e[key], key);
      return {
        from_s: n("from_s"),
        until_s: n("until_s"),
        translation_m: n("translation_m"),
        rotation_rad: n("rotation_rad"),
        significance: n("significance"),
        alert: e.alert === true,
      };
    }),
  };
}

function trajectory(value: unknown): s.Trajectory {
  const f = fields(value, "trajectory");
  const rows = list(f.points, "points", (p, what) => numbers<[number, number, number, number]>(p, what, 4));
  const points = new Float64Array(rows.length * 4);
  rows.forEach((row, i) => points.set(row, 4 * i));
  return {
    robot: maybe(f.robot, "robot"),
    component: count(f.component, "component"),
    name: words(f.name, "name"),
    points,
  };
}

function errors(value: unknown): s.Errors {
  const f = fields(value, "errors");
  const names = list(f.names, "names", text);
  const rows = list(f.points, "points", (p, what) => list(p, what, maybe));
  const columns = [0, ...names].map((_, c) => Float64Array.from(rows, (row) => row[c] ?? Number.NaN));
  return { robot: maybe(f.robot, "robot"), against: words(f.against, "against"), names, columns };
}

function survey(value: unknown): s.Survey {
  const f = fields(value, "survey");
  return { component: count(f.component, "component"), cloud: text(f.cloud, "cloud") };
}

/** Photos are the server's, or pictures inside the message; anything else could be fetched from elsewhere. */
export const is_photo = (url: string): boolean =>
  /^(\/api\/photo\/\d{1,20}|data:image\/(jpeg|png);base64,[A-Za-z0-9+/=]*)$/.test(url);

function mark(value: unknown): s.Mark {
  const f = fields(value, "mark");
  return {
    id: text(f.id, "id"),
    submap: text(f.submap, "submap"),
    at: vec3(f.at, "at"),
    text: words(f.text, "text"),
    by: words(f.by, "by"),
    wall_ns: maybe(f.wall_ns, "wall_ns"),
    photo: typeof f.photo === "string" && is_photo(f.photo) ? f.photo : null,
  };
}

function held(value: unknown, what: string): s.Held {
  const f = fields(value, what);
  return { by: text(f.by, "by"), what: text(f.what, "what") };
}

function radio(value: unknown): Map<number, s.RadioBytes> {
  const sums = (of: unknown) =>
    Object.fromEntries(
      Object.entries(of === undefined ? {} : fields(of, "radio")).map(([kind, bytes]) => [kind, number(bytes, kind)]),
    );
  return new Map(
    Object.entries(fields(value, "radio")).map(([robot, of]) => {
      const f = fields(of, robot);
      return [Number(robot), { up: sums(f.up), down: sums(f.down) }];
    }),
  );
}

function places(value: unknown): s.Places {
  const f = fields(value, "places");
  return {
    map_id: words(f.map_id, "map_id"),
    map_version: count(f.map_version, "map_version"),
    places: maybe_list(f.places, "places", (place, what) => {
      const e = fields(place, what);
      return {
        submap: words(e.submap, "submap"),
        name: text(e.name, "name"),
        matched: count(e.matched, "matched"),
        missing: count(e.missing, "missing"),
        appeared: count(e.appeared, "appeared"),
        trust: number(e.trust, "trust"),
        seen_s: number(e.seen_s, "seen_s"),
        robots: list(e.robots, "robots", number),
      };
    }),
  };
}

function acknowledged(value: unknown): s.Acknowledged {
  const f = fields(value, "acknowledged");
  return { alert: text(f.alert, "alert"), by: words(f.by, "by") };
}

function history(value: unknown): s.Known {
  const f = fields(value, "history");
  return {
    first_s: maybe(f.first_s, "first_s"),
    gaps: maybe_list(f.gaps, "gaps", (gap, what) => numbers<[number, number]>(gap, what, 2)),
    trouble: words(f.trouble, "trouble"),
  };
}

/** Every kind of key and what reads its values. */
export const DECODERS: { [K in s.Kind]: (value: unknown, ids: IdTable) => s.Values[K] } = {
  mission,
  status,
  alerts: (value) => list(value, "alerts", alert),
  submap,
  poses,
  closure,
  disagreement,
  trajectory,
  errors,
  survey,
  report: (value) => fields(value, "report"),
  timing: (value) => fields(value, "timing"),
  settings: (value) => text(value, "settings"),
  compare: (value) => fields(value, "compare"),
  odometry: (value) =>
    new Map(Object.entries(fields(fields(value, "odometry").submaps, "submaps")).map(([id, T]) => [id, pose(T, id)])),
  mark,
  held: (value) => list(value, "held", held),
  places,
  radio,
  acknowledged,
  history,
};

export function decode_me(value: unknown): s.Me {
  const f = fields(value, "me");
  return {
    login: f.login === true,
    name: words(f.name, "name"),
    role: f.role === "operator" || f.role === "viewer" ? f.role : null,
    mission: words(f.mission, "mission"),
    may_decide: f.may_decide === true,
    nonce: words(f.nonce, "nonce"),
    offers: maybe_list(f.offers, "offers", text) as s.Offer[],
  };
}

export function decode_registration(value: unknown): s.Registration {
  const f = fields(value, "registration");
  return {
    found: f.found === true,
    why: words(f.why, "why"),
    hint: words(f.hint, "hint"),
    T_from_to: f.T_from_to ? pose(f.T_from_to, "T_from_to") : null,
    evidence: maybe_list(f.evidence, "evidence", gate),
    look: maybe(f.look, "look"),
  };
}

function candidate(value: unknown, what: string): s.Why["candidates"][number] {
  const f: Fields = fields(value, what);
  return {
    pair: words(f.pair, "pair"),
    from: words(f.from, "from"),
    to: words(f.to, "to"),
    reason: words(f.reason, "reason"),
    value: maybe(f.value, "value"),
    limit: maybe(f.limit, "limit"),
    unit: words(f.unit, "unit"),
    nearest: f.nearest === true,
    hint: words(f.hint, "hint"),
  };
}

export function decode_why(value: unknown): s.Why {
  const f = fields(value, "why");
  return { sentence: words(f.sentence, "sentence"), candidates: maybe_list(f.candidates, "candidates", candidate) };
}
