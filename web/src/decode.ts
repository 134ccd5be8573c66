// SPDX-License-Identifier: BSD-3-Clause
/** From JSON to the values of schema.ts: by its tables, and by hand what the page keeps in another form than it came. */
import { count, DecodeError, fields, list, maybe, named_numbers, number, numbers, pose } from "./reading";
import { record, text, words } from "./reading";
import { status } from "./records";
import * as s from "./schema";

/** Gives every submap's id its place in the rows of poses. */
export interface IdTable {
  place(id: string): number;
}

const read_mission = record(s.mission);
function mission(value: unknown, what: string): s.Mission {
  const out = read_mission(value, what);
  if (out.robot_colours?.light.length === 0 || out.robot_colours?.dark.length === 0)
    throw new DecodeError("robot_colours: expected some");
  return out;
}

function poses(value: unknown, ids: IdTable): s.Poses {
  const f = fields(value, "poses");
  const entries = Object.entries(fields(f.submaps, "submaps"));
  const places = entries.map(([id]) => ids.place(id));
  const rows = new Float64Array((Math.max(-1, ...places) + 1) * s.POSE_ROW).fill(Number.NaN);
  entries.forEach(([id, row], i) => {
    if (!Array.isArray(row) || row.length < 8)
      throw new DecodeError(`submaps.${id}: expected 8 to ${s.POSE_ROW} numbers`);
    const first = places[i] * s.POSE_ROW;
    for (let k = 0; k < 8; ++k) rows[first + k] = number(row[k], id);
    rows[first + 8] = maybe(row[8], id) ?? Number.NaN;
    rows[first + 9] = maybe(row[9], id) ?? Number.NaN;
  });
  return {
    revision: count(f.revision, "revision"),
    accepted: count(f.accepted, "accepted"),
    components: count(f.components, "components"),
    unshown: count(f.unshown, "unshown"),
    rows,
  };
}

function trajectory(value: unknown): s.Trajectory {
  const f = fields(value, "trajectory");
  const rows = list(numbers<[number, number, number, number]>(4))(f.points, "points");
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
  const names = list(text)(f.names, "names");
  const rows = list(list(maybe))(f.points, "points");
  const columns = [0, ...names].map((_, c) => Float64Array.from(rows, (row) => row[c] ?? Number.NaN));
  return { robot: maybe(f.robot, "robot"), against: words(f.against, "against"), names, columns };
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

const read_status = record(status);

/** Every kind of key and what reads its values. */
export const DECODERS: { [K in s.Kind]: (value: unknown, what: string, ids: IdTable) => s.Values[K] } = {
  mission,
  status: (value, what) => ({ ...read_status(value, what), numbers: named_numbers(fields(value, what)) }),
  alerts: list(record(s.alert)),
  submap: record(s.submap),
  poses: (value, _what, ids) => poses(value, ids),
  closure: record(s.closure),
  disagreement: record(s.disagreement),
  trajectory,
  errors,
  survey: record(s.survey),
  report: fields,
  timing: fields,
  settings: text,
  compare: fields,
  odometry: (value, what) =>
    new Map(Object.entries(fields(fields(value, what).submaps, "submaps")).map(([id, T]) => [id, pose(T, id)])),
  mark: record(s.mark),
  held: list(record(s.held)),
  places: record(s.places),
  radio,
  acknowledged: record(s.acknowledged),
  history: record(s.history),
};

export const decode_me = record(s.me);
export const decode_registration = record(s.registration);
export const decode_why = record(s.why);
