// SPDX-License-Identifier: BSD-3-Clause
/** Reads values that came from outside; what does not fit throws a DecodeError that names where. */

export class DecodeError extends Error {}

export type Fields = Record<string, unknown>;
/** From JSON to a value; `what` names it in errors. */
export type Reader<T> = (value: unknown, what: string) => T;
/** The reader of each field of a record. */
type Table = Readonly<Record<string, Reader<unknown>>>;
export type Decoded<T extends Table> = { [K in keyof T]: ReturnType<T[K]> };

export type Vec3 = [number, number, number];
/** x, y, z, qx, qy, qz, qw: T_a_b maps coordinates of b to coordinates of a. */
export type Pose = [number, number, number, number, number, number, number];
/** By whose they are ("": the server's): numbers by name. */
export type Numbers = ReadonlyMap<string, Readonly<Record<string, number>>>;

const shown = (value: unknown): string => (JSON.stringify(value) ?? "nothing").slice(0, 40);

function wrong(what: string, value: unknown, expected: string): never {
  throw new DecodeError(`${what}: ${shown(value)}, expected ${expected}`);
}

export function fields(value: unknown, what: string): Fields {
  if (typeof value !== "object" || value === null || Array.isArray(value)) wrong(what, value, "an object");
  return value as Fields;
}

export function number(value: unknown, what: string): number {
  if (typeof value !== "number" || !Number.isFinite(value)) wrong(what, value, "a number");
  return value;
}

/** As `read`; `otherwise` when it is missing. */
export const or =
  <T, U>(read: Reader<T>, otherwise: U): Reader<T | U> =>
  (value, what) =>
    value === null || value === undefined ? otherwise : read(value, what);

export const or_null = <T>(read: Reader<T>): Reader<T | null> => or(read, null);

/** A number, or null when it is missing. */
export const maybe = or_null(number);

/** A number, or 0 when it is missing. */
export const count: Reader<number> = or(number, 0);

export function text(value: unknown, what: string): string {
  if (typeof value !== "string") wrong(what, value, "a text");
  return value;
}

/** A text, or null when it is missing or empty. */
export const maybe_text: Reader<string | null> = (value, what) => (value ? text(value, what) : null);

/** A text, or "" when it is missing. Numbers become texts: a session may come as either. */
export const words = or((value, what) => (typeof value === "number" ? String(value) : text(value, what)), "");

/** False when it is missing. */
export const truth: Reader<boolean> = (value) => value === true;

export function list<T>(read: Reader<T>): Reader<T[]> {
  return (value, what) => {
    if (!Array.isArray(value)) wrong(what, value, "a list");
    return value.map((element, i) => read(element, `${what}[${i}]`));
  };
}

/** As list(); empty when it is missing. */
export const maybe_list = <T>(read: Reader<T>): Reader<T[]> => or(list(read), []);

export function numbers<T extends number[]>(n: number): Reader<T> {
  return (value, what) => {
    const out = list(number)(value, what);
    if (out.length !== n) wrong(what, value, `${n} numbers`);
    return out as T;
  };
}

export function one_of<T extends string>(...all: T[]): Reader<T> {
  return (value, what) => {
    if (!all.includes(value as T)) wrong(what, value, `one of ${all.join(", ")}`);
    return value as T;
  };
}

/** A record; keys that the table does not have are passed over. */
export function record<T extends Table>(table: T): Reader<Decoded<T>> {
  const all = Object.entries(table);
  return (value, what) => {
    const f = fields(value, what);
    return Object.fromEntries(all.map(([key, read]) => [key, read(f[key], key)])) as Decoded<T>;
  };
}

export const vec3 = numbers<Vec3>(3);
export const pose = numbers<Pose>(7);
/** As programs write a pose in records; the page uses no rotation of these. */
export const maybe_pose = or_null(record({ translation_m: vec3 }));

/** All numbers of a status, its truths as 0 and 1, and of everything in its lists that has a name. */
export function named_numbers(status: Fields): Numbers {
  const flat = (of: Fields): Record<string, number> =>
    Object.fromEntries(
      Object.entries(of).flatMap(([key, x]) =>
        typeof x === "number" && Number.isFinite(x) ? [[key, x]] : typeof x === "boolean" ? [[key, Number(x)]] : [],
      ),
    );
  const out = new Map([["", flat(status)]]);
  for (const [kind, all] of Object.entries(status))
    if (Array.isArray(all))
      for (const one of all as Fields[])
        if (typeof one?.name === "string" && one.name !== "")
          out.set(kind === "robots" ? one.name : `${kind}: ${one.name}`, flat(one));
  return out;
}
