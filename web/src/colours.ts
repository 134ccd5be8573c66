// SPDX-License-Identifier: BSD-3-Clause
/** Colours of robots and scales. Hues keep apart under the common colour deficiencies. */
export type Rgb = [number, number, number];

export interface RobotColours {
  light: Rgb[];
  dark: Rgb[];
}
/** Grey until the program has sent them. */
let robots: RobotColours = { light: [[88, 97, 113]], dark: [[154, 164, 178]] };
export const set_robot_colours = (colours: RobotColours): void => void (robots = colours);

/** Colour of the robot at `index` of the robots in the order of their numbers. */
export function robot_rgb(index: number, dark: boolean): Rgb {
  const all = dark ? robots.dark : robots.light;
  return all[index % all.length];
}

export const css = ([r, g, b]: Rgb, alpha = 1): string => `rgba(${r | 0},${g | 0},${b | 0},${alpha})`;
export const abgr = ([r, g, b]: Rgb): number => (0xff000000 | (b << 16) | (g << 8) | (r | 0)) >>> 0;

export const mix = (a: Rgb, b: Rgb, share: number): Rgb => a.map((x, i) => x + share * (b[i] - x)) as Rgb;

function along(stops: Rgb[], share: number): Rgb {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2);
  return mix(stops[i], stops[i + 1], at - i);
}

/** Dark blue over green to yellow, even in lightness (after viridis). */
const kEven: Rgb[] = [
  [68, 52, 140],
  [56, 98, 158],
  [36, 140, 150],
  [44, 178, 120],
  [140, 208, 70],
  [253, 231, 60],
];
/** Good to bad: blue, pale, orange, red. */
const kBad: Rgb[] = [
  [60, 130, 220],
  [110, 200, 210],
  [240, 210, 110],
  [240, 140, 60],
  [225, 60, 60],
];

export const even = (share: number): Rgb => along(kEven, share);
export const bad = (share: number): Rgb => along(kBad, share);

/** From dim at the bottom to bright at the top, so that walls have a shape. */
export function ramp_of(colour: Rgb, dark: boolean): Uint32Array {
  const low = dark ? mix(colour, [14, 18, 26], 0.62) : mix(colour, [20, 24, 32], 0.45);
  const high = dark ? mix(colour, [255, 255, 255], 0.18) : mix(colour, [255, 255, 255], 0.35);
  return Uint32Array.from({ length: 256 }, (_, i) => abgr(mix(low, high, i / 255)));
}

export const height_ramp = (): Uint32Array => Uint32Array.from({ length: 256 }, (_, i) => abgr(even(i / 255)));
