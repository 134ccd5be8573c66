// SPDX-License-Identifier: BSD-3-Clause
/** Reads values that came from outside; what does not fit throws a DecodeError that names where. */
import type { Numbers } from "./schema";

export class DecodeError extends Error {}

export type Fields = Record<string, unknown>;

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

/** A number, or null when it is missing. */
export function maybe(value: unknown, what: string): number | null {
  return value === null || value === undefined ? null : number(value, what);
}

/** A number, or `otherwise` when it is missing. */
export function count(value: unknown, what: string, otherwise = 0): number {
  return maybe(value, what) ?? otherwise;
}

export function text(value: unknown, what: string): string {
  if (typeof value !== "string") wrong(what, value, "a text");
  return value;
}

/** A text, or "" when it is missing. Numbers become texts: a session may come as either. */
export function words(value: unknown, what: string): string {
  if (value === null || value === undefined) return "";
  return typeof value === "number" ? String(value) : text(value, what);
}

export function list<T>(value: unknown, what: string, read: (element: unknown, what: string) => T): T[] {
  if (!Array.isArray(value)) wrong(what, value, "a list");
  return value.map((element, i) => read(element, `${what}[${i}]`));
}

/** As list(); empty when it is missing. */
export function maybe_list<T>(value: unknown, what: string, read: (element: unknown, what: string) => T): T[] {
  return value === null || value === undefined ? [] : list(value, what, read);
}

export function numbers<T extends number[]>(value: unknown, what: string, n: number): T {
  const out = list(value, what, number);
  if (out.length !== n) wrong(what, value, `${n} numbers`);
  return out as T;
}

export function one_of<T extends string>(value: unknown, what: string, all: readonly T[]): T {
  if (!all.includes(value as T)) wrong(what, value, `one of ${all.join(", ")}`);
  return value as T;
}

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
