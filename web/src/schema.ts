// SPDX-License-Identifier: BSD-3-Clause
/**
 * The program sends the page {key, t, value}. A key is KIND or KIND/NAME. Tables of records that have a list of fields
 * in the program are in records.ts, which is made of these; the others are here.
 */
import { count, list, maybe, maybe_list, maybe_text, number, numbers, one_of, or_null } from "./reading";
import { pose, record, text, truth, vec3, words } from "./reading";
import type { Decoded, Numbers, Pose, Reader } from "./reading";
import type { Rgb, RobotColours } from "./colours";
import * as records from "./records";
import type { RobotStatus, StatusFields } from "./records";

export type { Numbers, Pose, Vec3 } from "./reading";
export type { RobotStatus, WorkerStatus } from "./records";

/** "ROBOT:SESSION/INDEX"; text, because a session may have 64 bits. */
export type SubmapId = string;

export interface Message {
  key: string;
  t: number;
  value: unknown;
}

const rgb = numbers<Rgb>(3);
export const mission = {
  ...records.mission,
  mode: ((mode) => (mode === "report" || mode === "compare" ? mode : "live")) as Reader<"live" | "report" | "compare">,
  robot_colours: or_null<RobotColours>(record({ light: list(rgb), dark: list(rgb) })),
};
export type Mission = Decoded<typeof mission>;

/** A map that does not move, as a robot names it. */
export type MapVersion = Pick<RobotStatus, "map_id" | "map_version">;

export interface Status extends StatusFields {
  /** Every number that came, also those that the page has no other use for. */
  numbers: Numbers;
}

export const alert = { ...records.alert, since_s: maybe, submap: maybe_text };
export type Alert = Decoded<typeof alert>;

export const submap = {
  id: text,
  name: text,
  robot: number,
  session: words,
  index: number,
  from_s: count,
  until_s: count,
  path: list(vec3),
  /** Where the robot's own odometry has this submap; null: not sent. */
  T_odom_submap: or_null(pose),
  points: count,
  bytes: count,
};
export type Submap = Decoded<typeof submap>;

/** Poses of all submaps at one revision; `rows` has POSE_ROW numbers for each place in the store's table of ids. */
export interface Poses {
  revision: number;
  accepted: number;
  components: number;
  /** Closures that are not sent, because there are too many. */
  unshown: number;
  rows: Float64Array;
}
/** component, x, y, z, qx, qy, qz, qw, closures that join it to the map, sigma (both NaN: not computed). A component of NaN: not in the map. */
export const POSE_ROW = 10;

export const gate = {
  reason: words,
  value: maybe,
  limit: maybe,
  unit: words,
  /** The limit is the least that is allowed; otherwise the most. */
  at_least: truth,
  ok: truth,
};
export type Gate = Decoded<typeof gate>;

export const link = {
  at_from: vec3,
  at_to: vec3,
  T_from_to: pose,
  misfit_m: maybe,
  misfit_deg: maybe,
  chi2: maybe,
  reason: words,
};
export type Link = Decoded<typeof link>;

const decision = { wish: one_of("accept", "reject", "withdraw"), by: words, wall_ns: maybe };
export const closure = {
  name: text,
  from: text,
  to: text,
  state: one_of("accepted", "rejected", "candidate"),
  reason: words,
  by_hand: truth,
  decision: or_null(record(decision)),
  verifier: words,
  worker: words,
  verified_ns: maybe,
  links: maybe_list(record(link)),
  evidence: maybe_list(record(gate)),
};
export type Closure = Decoded<typeof closure>;
export type ClosureState = Closure["state"];
export type Wish = Decoded<typeof decision>["wish"];

export const disagreement = {
  robot: maybe,
  scale_length_m: list(number),
  /** By scale: the difference, and over what chance explains (above 1 it is none). `submap` only in a running mission. */
  nodes: list(
    record({
      submap: maybe_text,
      t: number,
      distance_m: count,
      d: maybe_list(number),
      significance: list(number),
    }),
  ),
  /** Where odometry left the map. */
  origins: maybe_list(
    record({
      from_s: count,
      until_s: count,
      translation_m: count,
      rotation_rad: count,
      significance: count,
      alert: truth,
    }),
  ),
};
export type Disagreement = Decoded<typeof disagreement>;

export interface Trajectory {
  robot: number | null;
  component: number;
  name: string;
  /** t, x, y, z after each other. */
  points: Float64Array;
}

export interface Errors {
  robot: number | null;
  against: string;
  names: string[];
  /** One column of times, and one per name; NaN where not known. */
  columns: Float64Array[];
}

export const survey = { component: count, cloud: text };
export type Survey = Decoded<typeof survey>;

/** Photos are the server's, or pictures inside the message; anything else could be fetched from elsewhere. */
export const is_photo = (url: string): boolean =>
  /^(\/api\/photo\/\d{1,20}|data:image\/(jpeg|png);base64,[A-Za-z0-9+/=]*)$/.test(url);

export const mark = {
  id: text,
  submap: text,
  at: vec3,
  text: words,
  by: words,
  wall_ns: maybe,
  photo: ((url) => (typeof url === "string" && is_photo(url) ? url : null)) as Reader<string | null>,
};
export type Mark = Decoded<typeof mark>;

/** Who is looking at what now: a key, closure/NAME or robot/NUMBER. */
export const held = { by: text, what: text };
export type Held = Decoded<typeof held>;

const place = {
  ...records.place,
  /** When a robot saw any of it, s. */
  seen_s: number,
};
export type Place = Decoded<typeof place>;
export const places = { map_id: words, map_version: count, places: maybe_list(record(place)) };
export type Places = Decoded<typeof places>;

/** Bytes since the server's start, by kind of message. */
export interface RadioBytes {
  up: Record<string, number>;
  down: Record<string, number>;
}

/** That somebody has seen an alert, for all who watch. */
export const acknowledged = { alert: text, by: words };
export type Acknowledged = Decoded<typeof acknowledged>;

/** The times of which the program knows something. */
export const history = {
  /** Null: of none yet. */
  first_s: maybe,
  gaps: maybe_list(numbers<[number, number]>(2)),
  /** Why it does not remember what is now; "": it does. */
  trouble: words,
};
export type Known = Decoded<typeof history>;

/** The types of values by kind of key. */
export interface Values {
  mission: Mission;
  status: Status;
  alerts: Alert[];
  submap: Submap;
  poses: Poses;
  closure: Closure;
  disagreement: Disagreement;
  trajectory: Trajectory;
  errors: Errors;
  survey: Survey;
  report: Report;
  timing: Report;
  /** The effective settings of a mission, YAML. */
  settings: string;
  /** compare.json of docs/compare.md. */
  compare: Report;
  odometry: Map<SubmapId, Pose>;
  mark: Mark;
  held: Held[];
  places: Places;
  radio: Map<number, RadioBytes>;
  /** By ID@SINCE of the alert. */
  acknowledged: Acknowledged;
  history: Known;
}
export type Kind = keyof Values;

/** report.json and timing.json of docs/report.md; read where they are shown. */
export type Report = Record<string, unknown>;

export type Offer = "decide" | "register" | "closure" | "mark" | "hold" | "acknowledge" | "why" | "disagreement";
export const me = {
  login: truth,
  name: words,
  role: ((role) => (role === "operator" || role === "viewer" ? role : null)) as Reader<"operator" | "viewer" | null>,
  mission: words,
  may_decide: truth,
  nonce: words,
  offers: maybe_list(text as Reader<Offer>),
};
export type Me = Decoded<typeof me>;

export const registration = {
  found: truth,
  why: words,
  /** Advice; "": every gate is passed. */
  hint: words,
  T_from_to: or_null(pose),
  evidence: maybe_list(record(gate)),
  /** The number to ask for the map with it by; null: nothing was found. */
  look: maybe,
};
export type Registration = Decoded<typeof registration>;

export const why = {
  sentence: words,
  candidates: maybe_list(
    record({
      pair: words,
      from: words,
      to: words,
      reason: words,
      value: maybe,
      limit: maybe,
      unit: words,
      nearest: truth,
      hint: words,
    }),
  ),
};
export type Why = Decoded<typeof why>;
