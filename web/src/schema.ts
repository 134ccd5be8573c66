// SPDX-License-Identifier: BSD-3-Clause
/** What the program sends the page: {key, t, value}. A key is KIND or KIND/NAME. */
import type { RobotColours } from "./colours";

/** "ROBOT:SESSION/INDEX"; text, because a session may have 64 bits. */
export type SubmapId = string;
export type Vec3 = [number, number, number];
/** x, y, z, qx, qy, qz, qw: T_a_b maps coordinates of b to coordinates of a. */
export type Pose = [number, number, number, number, number, number, number];

export interface Message {
  key: string;
  t: number;
  value: unknown;
}

export interface Mission {
  name: string;
  description: string;
  version: string;
  mode: "live" | "report" | "compare";
  duration_s: number | null;
  robots: string[];
  /** A robot that was not heard for so long is silent. */
  robot_silent_s: number;
  robot_colours: RobotColours | null;
}

/** Of a robot's status, what the page shows. */
export interface RobotStatus {
  number: number;
  name: string;
  session: string;
  last_seen_s_ago: number | null;
  last_update_s_ago: number | null;
  submaps: number;
  submaps_begun: number | null;
  refused_submaps: number;
  unread_submaps: number;
  conflict: string;
  version: string;
  backlog_submaps: number;
  backlog_bytes: number;
  heard_revision: number;
  update_age_s: number | null;
  keyframes: number;
  position: Vec3 | null;
  alerts: number;
  finished: boolean;
  trouble: string;
  battery_v: number | null;
  battery_percent: number | null;
  localisation: string; // in a map that does not move; "": it does not localise
  localisation_why: string;
  map_id: string; // of that map
  map_version: number;
  floor: number; // of that map
}

/** A map that does not move, as a robot names it. */
export type MapVersion = Pick<RobotStatus, "map_id" | "map_version">;

export interface WorkerStatus {
  number: number;
  name: string;
  last_seen_s_ago: number | null;
  jobs_done: number;
  trouble: string;
}

/** By whose they are ("": the server's): numbers by name. */
export type Numbers = ReadonlyMap<string, Readonly<Record<string, number>>>;

export interface Status {
  version: string;
  revision: number;
  submaps: number;
  closures: number;
  components: number;
  pending_jobs: number;
  has_news: boolean;
  robots: RobotStatus[];
  workers: WorkerStatus[];
  refused: { from: string; kind: string; count: number; why: string }[];
  trouble: string;
  /** The server's wall clock, ms since 1970; null: not known. */
  wall_ms: number | null;
  verifier: string;
  waiting: number;
  why_waiting: string;
  /** Every number that came, also those that the page has no other use for. */
  numbers: Numbers;
}

export type Severity = "info" | "warning" | "error";
export interface Alert {
  id: string;
  severity: Severity;
  what: string;
  where: string;
  since_s: number | null;
  todo: string;
  robot: number | null;
  submap: SubmapId | null;
  closure: string | null;
}

export interface Submap {
  id: SubmapId;
  name: string;
  robot: number;
  session: string;
  index: number;
  from_s: number;
  until_s: number;
  path: Vec3[];
  /** Where the robot's own odometry has this submap; null: not sent. */
  T_odom_submap: Pose | null;
  points: number;
  bytes: number;
}

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

export type ClosureState = "accepted" | "rejected" | "candidate";
export type Wish = "accept" | "reject" | "withdraw";
export interface Gate {
  reason: string;
  value: number | null;
  limit: number | null;
  unit: string;
  /** The limit is the least that is allowed; otherwise the most. */
  at_least: boolean;
  ok: boolean;
}
export interface Link {
  at_from: Vec3;
  at_to: Vec3;
  T_from_to: Pose;
  misfit_m: number | null;
  misfit_deg: number | null;
  chi2: number | null;
  reason: string;
}
export interface Closure {
  name: string;
  from: SubmapId;
  to: SubmapId;
  state: ClosureState;
  reason: string;
  by_hand: boolean;
  decision: { wish: Wish; by: string; wall_ns: number | null } | null;
  verifier: string;
  worker: string;
  verified_ns: number | null;
  links: Link[];
  evidence: Gate[];
}

export interface Disagreement {
  robot: number | null;
  scale_length_m: number[];
  /** By scale: the difference, and over what chance explains (above 1 it is none). `submap` only in a running mission. */
  nodes: { submap: SubmapId | null; t: number; distance_m: number; d_m: number[]; significance: number[] }[];
  /** Where odometry left the map. */
  origins: {
    from_s: number;
    until_s: number;
    translation_m: number;
    rotation_rad: number;
    significance: number;
    alert: boolean;
  }[];
}

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

export interface Survey {
  component: number;
  cloud: string;
}

export interface Mark {
  id: string;
  submap: SubmapId;
  at: Vec3;
  text: string;
  by: string;
  wall_ns: number | null;
  photo: string | null;
}

/** Who is looking at what now. */
export interface Held {
  by: string;
  /** A key: closure/NAME or robot/NUMBER. */
  what: string;
}

/** What robots that localise in a map have found of one of its submaps, together; in cubes. */
export interface Place {
  /** "": it is of another map than the server's. */
  submap: SubmapId;
  name: string;
  matched: number;
  missing: number;
  appeared: number;
  /** The share that fits. */
  trust: number;
  /** When a robot saw any of it, s. */
  seen_s: number;
  /** Those that did, the last first. */
  robots: number[];
}
export interface Places extends MapVersion {
  places: Place[];
}

/** Bytes since the server's start, by kind of message. */
export interface RadioBytes {
  up: Record<string, number>;
  down: Record<string, number>;
}

/** That somebody has seen an alert, for all who watch. */
export interface Acknowledged {
  alert: string;
  by: string;
}

/** Of which times the program knows something. */
export interface Known {
  /** Null: of none yet. */
  first_s: number | null;
  gaps: [number, number][];
  /** Why it does not remember what is now; "": it does. */
  trouble: string;
}

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
export interface Me {
  login: boolean;
  name: string;
  role: "operator" | "viewer" | null;
  mission: string;
  may_decide: boolean;
  nonce: string;
  offers: Offer[];
}

export interface Registration {
  found: boolean;
  why: string;
  /** What would help; "": every gate is passed. */
  hint: string;
  T_from_to: Pose | null;
  evidence: Gate[];
  /** What to ask for the map with it by; null: nothing was found. */
  look: number | null;
}

export interface Why {
  sentence: string;
  candidates: {
    pair: string;
    from: SubmapId;
    to: SubmapId;
    reason: string;
    value: number | null;
    limit: number | null;
    unit: string;
    nearest: boolean;
    hint: string;
  }[];
}
