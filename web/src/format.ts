// SPDX-License-Identifier: BSD-3-Clause
/** Numbers as people read them, with spaces at which no line breaks. "-" where there is none; nothing is estimated in its place. */
type Figure = number | null | undefined;
const known = (x: Figure): x is number => typeof x === "number" && Number.isFinite(x);

export function metres(x: Figure): string {
  if (!known(x)) return "-";
  return Math.abs(x) >= 1000
    ? `${(x / 1000).toFixed(2)}\u00a0km`
    : `${x.toFixed(Math.abs(x) >= 100 ? 0 : Math.abs(x) >= 10 ? 1 : Math.abs(x) >= 1 ? 2 : 3)}\u00a0m`;
}

export function bytes(x: Figure): string {
  if (!known(x)) return "-";
  if (x < 1000) return `${Math.round(x)}\u00a0B`;
  const k = x < 1e6 ? 1e3 : x < 1e9 ? 1e6 : 1e9;
  const digits = x / k >= 100 ? 0 : x / k >= 10 ? 1 : 2;
  return `${(x / k).toFixed(digits)}\u00a0${k === 1e3 ? "kB" : k === 1e6 ? "MB" : "GB"}`;
}

/** How long: "3 s", "4 min 10 s", "2 h 05 min". */
export function span(s: Figure): string {
  if (!known(s)) return "-";
  if (s < 10) return `${Math.max(0, s).toFixed(s < 1 ? 1 : 0)}\u00a0s`;
  if (s < 120) return `${Math.round(s)}\u00a0s`;
  if (s < 3600) return `${Math.floor(s / 60)}\u00a0min\u00a0${two(Math.floor(s % 60))}\u00a0s`;
  return `${Math.floor(s / 3600)}\u00a0h\u00a0${two(Math.floor((s % 3600) / 60))}\u00a0min`;
}

/** A time of the mission: "0:04:10". */
export function moment(s: Figure): string {
  if (!known(s)) return "-";
  const whole = Math.max(0, Math.floor(s));
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

export const milliseconds = (ms: Figure): string =>
  !known(ms)
    ? "-"
    : ms < 1
      ? `${(1000 * ms).toFixed(0)}\u00a0µs`
      : ms < 1000
        ? `${ms.toFixed(ms < 10 ? 2 : ms < 100 ? 1 : 0)}\u00a0ms`
        : span(ms / 1000);

export const share = (x: Figure, digits = 1): string => (known(x) ? `${(100 * x).toFixed(digits)}\u00a0%` : "-");
export const degrees = (x: Figure): string => (known(x) ? `${x.toFixed(2)}°` : "-");

/** A measured value with its unit; three figures that count. */
export function figure(x: Figure, unit = ""): string {
  if (!known(x)) return "-";
  const digits =
    x === 0 || Math.abs(x) >= 100 || Number.isInteger(x) ? 0 : Math.abs(x) >= 10 ? 1 : Math.abs(x) >= 1 ? 2 : 3;
  return `${x.toFixed(digits)}${unit ? `\u00a0${unit}` : ""}`;
}

/** As much as fits a label, and a sign that there is more. */
export const beginning = (text: string, most: number): string =>
  text.length > most ? `${text.slice(0, most - 1).trimEnd()}…` : text;
export const many = (n: number, one: string, several = `${one}s`): string => `${n} ${n === 1 ? one : several}`;

/** A time of the day that is the same for everybody, "04:12:09 UTC"; from ms since 1970. */
export const utc = (ms: number | null): string =>
  ms !== null && Math.abs(ms) < kMostDate_ms ? `${new Date(ms).toISOString().slice(11, 19)} UTC` : "";
/** The same with its day: "2026-11-28 04:12:09 UTC". */
export const utc_date = (ms: number | null): string =>
  ms !== null && Math.abs(ms) < kMostDate_ms ? `${new Date(ms).toISOString().slice(0, 10)} ${utc(ms)}` : "";
const kMostDate_ms = 8.64e15;
/** From ns since 1970, to the minute: "04:12 UTC". */
export const wall = (ns: number | null): string => (ns ? utc(ns / 1e6).replace(/:\d\d UTC$/, " UTC") : "");

const two = (n: number): string => String(n).padStart(2, "0");
