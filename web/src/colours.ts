// SPDX-License-Identifier: BSD-3-Clause
/** Colours of robots and scales. Hues keep apart under the common colour deficiencies. */
export type Rgb = [number, number, number];

export interface RobotColours {
  light: Rgb[];
  dark: Rgb[];
}
/** Grey until the program has sent them. */
let robots: RobotColours = { light: [[88, 97, 113]], dark: [[154, 164, 178]] };
export const set_robot_colours = (colours: RobotColours): void =>
  void (robots = { light: [...colours.light], dark: [...colours.dark] });

/** Beyond so many, colours come again: more are not told apart. */
const kMostColours = 128;

/** Colour of the robot at `index` of the robots in the order of their numbers: the program's, then more that are far from those. */
export function robot_rgb(index: number, dark: boolean): Rgb {
  const all = dark ? robots.dark : robots.light;
  const wanted = index % kMostColours;
  while (all.length <= wanted) all.push(farthest_from(all, dark ? kOnDark : kOnLight));
  return all[wanted];
}

/** Lightness that is seen on dark and on light ground, of OKLab's 0 to 1. */
const kOnDark = [0.62, 0.7, 0.78, 0.86];
const kOnLight = [0.4, 0.48, 0.56, 0.64];

/** The colour that is least like any of these. */
function farthest_from(all: Rgb[], lightness: number[]): Rgb {
  const taken = all.map(oklab_of);
  let best: { away: number; colour: Rgb } = { away: -1, colour: [128, 128, 128] };
  for (const l of lightness)
    for (const chroma of [0.07, 0.12, 0.17, 0.22])
      for (let hue = 0; hue < 2 * Math.PI; hue += Math.PI / 30) {
        const lab = [l, chroma * Math.cos(hue), chroma * Math.sin(hue)];
        const colour = rgb_of(lab);
        if (!colour) continue;
        const away = Math.min(...taken.map((other) => Math.hypot(...other.map((x, k) => x - lab[k]))));
        if (away > best.away) best = { away, colour };
      }
  return best.colour;
}

/** OKLab (B. Ottosson, 2020): distances in it are about as large as they look. */
export function oklab_of(colour: Rgb): number[] {
  const [r, g, b] = colour.map((x) => (x / 255 <= 0.04045 ? x / 255 / 12.92 : ((x / 255 + 0.055) / 1.055) ** 2.4));
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

/** Null where a screen cannot show it. */
function rgb_of([L, a, b]: number[]): Rgb | null {
  const l = (L + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (L - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (L - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  if (linear.some((x) => x < 0 || x > 1)) return null;
  return linear.map((x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055)) as Rgb;
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
