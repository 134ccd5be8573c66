// SPDX-License-Identifier: BSD-3-Clause
/** Made by src/tutti/program/page/records_test.cpp, of the lists of fields of the program's structs. */
import {
  count,
  list,
  maybe,
  maybe_list,
  maybe_pose,
  maybe_text,
  number,
  one_of,
  or,
  record,
  text,
  truth,
  words,
} from "./reading";
import type { Decoded } from "./reading";

export const mission = {
  name: text,
  description: words,
  mode: or(text, "live"),
  version: words,
  duration_s: maybe,
  robot_silent_s: or(number, 10),
};
export type MissionFields = Decoded<typeof mission>;

export const node_status = {
  /** 1 to 64 letters, digits, '_' and '-'. */
  name: words,
  session: words,
  /** How often a robot has started on its store; distinguishes two of its programs. */
  start: count,
  version: words,
  /** That the server is not known to have stored. */
  backlog_submaps: count,
  backlog_bytes: count,
  /** The newest proxy graph's that it heard. */
  heard_epoch: count,
  heard_revision: count,
  /** Since it used that graph; none: it has used none since its start. */
  update_age_s: maybe,
  keyframes: count,
  /** A robot's, at its newest sample: x y z of the translation, x y z w of the quaternion. */
  T_odom_body: maybe_pose,
  alerts: count,
  /** Its recording has ended. */
  finished: truth,
  /** A worker's, since it started. */
  jobs_done: count,
  /** A problem, for people; empty: none. */
  trouble: words,
  /** That a robot has begun in its session. */
  submaps_begun: maybe,
  battery_v: maybe,
  /** 100: full. */
  battery_percent: maybe,
  /** Empty: it does not localise. */
  map_id: words,
  map_version: count,
  /** localise::to_string() of its state: 'localised', 'searching', .. */
  localisation: words,
  /** What has led to it, for people. */
  localisation_why: words,
  /** In the frame of its floor; the identity without place_age_s. As T_odom_body. */
  T_world_body: maybe_pose,
  /** Standard deviation of its position, all three directions together. */
  sigma_m: maybe,
  /** Standard deviation of its heading. */
  sigma_deg: maybe,
  /** Since the map last showed that it is there; none: it has no place. */
  place_age_s: maybe,
  /** Share of the scan that showed it last which lay on the map. */
  place_overlap: maybe,
  /** The floor of the map that it is on, from 1 on; each has a frame of its own. */
  floor: or(number, 1),
};
export type NodeStatus = Decoded<typeof node_status>;

export const robot_status = {
  number: number,
  /** None: the robot was not heard since the server started. */
  last_seen_s_ago: maybe,
  /** When the robot last used a proxy graph. */
  last_update_s_ago: maybe,
  /** In the map, over all sessions. */
  submaps: count,
  /** That the map does not take. */
  refused_submaps: count,
  /** Why another program that claims to be this robot is refused; empty: there is none. */
  conflict: words,
  ...node_status,
  /** In versions that the server cannot read, which the robot keeps. */
  unread_submaps: count,
};
export type RobotStatus = Decoded<typeof robot_status>;

export const worker_status = {
  number: number,
  last_seen_s_ago: maybe,
  ...node_status,
};
export type WorkerStatus = Decoded<typeof worker_status>;

export const refused_messages = {
  /** A role: 'robot', 'worker', .. */
  from: words,
  /** The message's, as wire::name() has it. */
  kind: words,
  count: count,
  last_why: words,
};
export type RefusedMessages = Decoded<typeof refused_messages>;

export const status = {
  /** The server's wall clock, since the Unix epoch; 0: unknown. */
  wall_ns: count,
  /** The server's program's. */
  version: words,
  epoch: count,
  revision: count,
  submaps: count,
  /** Accepted ones. */
  closures: count,
  /** Parts of the map that nothing joins yet. */
  components: count,
  pending_jobs: count,
  /** The next revision is due. */
  has_news: truth,
  /** Ascending by number. */
  robots: maybe_list(record(robot_status)),
  /** Ascending by number. */
  workers: maybe_list(record(worker_status)),
  /** Messages that were refused. */
  refusals: maybe_list(record(refused_messages)),
  /** A problem, for people; empty: none. */
  trouble: words,
  incarnation: count,
  /** The verifier of closures, as to_string(MethodId) has it. */
  verifier: words,
  /** With closures of other verifiers, which stay in the map until the present verifier has answered. */
  former_pairs: count,
  /** Pairs and refinements that no present worker can compute. */
  waiting: count,
  /** What the last worker that tried them reported. */
  why_waiting: words,
  /** Those of the submaps that show known ground. */
  retired: count,
};
export type StatusFields = Decoded<typeof status>;

export const place = {
  /** ROBOT:SESSION/INDEX; empty: another map's than the server's. */
  submap: words,
  /** For people. */
  name: text,
  matched: count,
  missing: count,
  appeared: count,
  /** The share that fits. */
  trust: number,
  /** Those that did, the last first; at most 8. */
  robots: list(number),
};
export type PlaceFields = Decoded<typeof place>;

export const alert = {
  id: words,
  severity: one_of("error", "warning", "info"),
  what: text,
  where: words,
  since_s: count,
  todo: words,
  robot: maybe,
  closure: maybe_text,
};
export type AlertFields = Decoded<typeof alert>;
