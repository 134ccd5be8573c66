// SPDX-License-Identifier: BSD-3-Clause
/** Every number that the server sends of somebody, over time: whatever fields its messages have, and no list of them here. */
import { POSE_ROW } from "./schema";
import type { Kind, Numbers, Poses, RadioBytes, Status, Values } from "./schema";
import type { Store } from "./store";

const is_number = (x: unknown): x is number => typeof x === "number" && Number.isFinite(x);

/** Bytes over the radio by way and kind. */
function numbers_of_radio(store: Store, radio: Map<number, RadioBytes>): Numbers {
  const names = new Map((store.get("status")?.robots ?? []).map((robot) => [robot.number, robot.name]));
  const sums = (bytes: RadioBytes) =>
    (["up", "down"] as const).flatMap((way) =>
      Object.entries(bytes[way]).map(([kind, n]) => [`radio ${way}, ${kind}_bytes`, n]),
    );
  return new Map([...radio].map(([robot, bytes]) => [names.get(robot) ?? `${robot}`, Object.fromEntries(sums(bytes))]));
}

/** How well each robot's newest submap is known, as far as it was there then. */
function numbers_of_poses(store: Store, poses: Poses): Numbers {
  const out = new Map<string, Record<string, number>>();
  for (const [id, submap] of store.all("submap")) {
    const first = store.place_of(id) * POSE_ROW;
    const [holding, sigma_m] = first < 0 ? [] : poses.rows.subarray(first + 8, first + POSE_ROW);
    const known = { ...(is_number(holding) && { held_by_closures: holding }), ...(is_number(sigma_m) && { sigma_m }) };
    if (Object.keys(known).length > 0) out.set(submap.name.split("/")[0], known); // the newest comes last
  }
  return out;
}

/** Which messages have numbers of somebody. */
const SOURCES: { [K in Kind]?: (store: Store, value: Values[K]) => Numbers } = {
  status: (_store, status: Status) => status.numbers,
  poses: numbers_of_poses,
  radio: numbers_of_radio,
};
const read = new WeakMap<object, Numbers>();

function numbers_of(store: Store, kind: Kind, value: object): Numbers {
  const known = read.get(value);
  if (known) return known;
  const out = SOURCES[kind]!(store, value as never);
  read.set(value, out);
  return out;
}

/** The names of all numbers that came last. */
export function fields(store: Store): string[] {
  const out = new Set<string>();
  for (const kind of Object.keys(SOURCES) as Kind[]) {
    const value = store.get(kind) as object | null;
    if (value) for (const own of numbers_of(store, kind, value).values()) for (const field in own) out.add(field);
  }
  return [...out].sort();
}

/** A number of everybody who has it, over time. */
export function series(store: Store, field: string): { times: number[]; by: Map<string, (number | null)[]> } {
  for (const kind of Object.keys(SOURCES) as Kind[]) {
    const track = store.track(kind);
    const all = (track?.values ?? []).map((value) => (value ? numbers_of(store, kind, value as object) : null));
    const by = new Map<string, (number | null)[]>();
    for (const numbers of all)
      for (const [who, own] of numbers ?? []) if (field in own && !by.has(who)) by.set(who, []);
    for (const [who, values] of by) for (const numbers of all) values.push(numbers?.get(who)?.[field] ?? null);
    if (by.size > 0) return { times: [...track!.times], by };
  }
  return { times: [], by: new Map() };
}

/** Units by the last word of a number's name. */
const UNITS: Record<string, string> = {
  s: "s",
  ago: "s",
  m: "m",
  v: "V",
  percent: "%",
  bytes: "B",
  ns: "ns",
  mps: "m/s",
};

export const unit_of = (field: string): string => UNITS[field.split("_").at(-1)!] ?? "";
export const words_of = (field: string): string => field.replaceAll("_", " ");
