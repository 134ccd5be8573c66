// SPDX-License-Identifier: BSD-3-Clause
/** Which points are drawn in which colours. */
import type { Cloud, Clouds } from "../cloud";
import { abgr, bad, css, even, height_ramp, mix, ramp_of, robot_rgb } from "../colours";
import type { Rgb } from "../colours";
import { figure, metres, share, span } from "../format";
import type { Options } from "../options";
import { rows_of, transform } from "../pose";
import type { Painted, Window3 } from "../raster";
import type { Pose } from "../schema";
import { SurveyDistance } from "../survey";
import type { Eye } from "./eye";
import type { Placed, World } from "./world";

export interface Dressing {
  options: Options;
  dark: boolean;
  /** Place of a robot's number among all, for its colour. */
  colour_index: (robot: number) => number;
  robot_name: (robot: number) => string;
  /** The worst disagreement of a submap, over its threshold; null: none is known. */
  disagreement: (id: string) => number | null;
  /** The share of a submap that fits what robots see that localise in it; null: none saw it. */
  trust: (id: string) => number | null;
  /** The distance of a cloud's points to the survey, as places in a ramp; null: there is none. */
  distances: (id: string, cloud: Cloud, T: Pose) => Uint8Array | null;
  /** The time that is shown, s. */
  t: number;
  /** Whether this submap is faint, because another thing is looked at. */
  faint: (id: string) => boolean;
}

export interface Legend {
  title: string;
  entries: { colour: string; label: string }[];
  /** Instead of entries: a scale from left to right. */
  scale: { colours: string[]; low: string; high: string; middle?: string } | null;
}

const kHolding: { most: number; colour: Rgb; label: string }[] = [
  { most: 0, colour: [150, 160, 175], label: "root of its component" },
  { most: 1, colour: [255, 93, 117], label: "1: hangs on one" },
  { most: 2, colour: [240, 180, 70], label: "2" },
  { most: Infinity, colour: [70, 200, 150], label: "3 or more" },
];

/** The share that does not fit has the worst colour where it is largest, but for less than this. */
export const LEAST_DISTRUST = 0.02;

/** Largest sigma of a submap, oldest age, worst disagreement in units of its threshold, worst misfit: the ends of scales. */
interface Scales {
  sigma_m: number;
  age_s: number;
  disagreement: number;
  distrust: number;
}

function scales_of(world: World, d: Dressing): Scales {
  const out = { sigma_m: 0.01, age_s: 10, disagreement: 2, distrust: LEAST_DISTRUST };
  for (const p of world.placed.values()) {
    if (p.sigma_m > out.sigma_m) out.sigma_m = p.sigma_m;
    out.age_s = Math.max(out.age_s, d.t - p.submap.until_s);
    out.disagreement = Math.max(out.disagreement, d.disagreement(p.id) ?? 0);
    out.distrust = Math.max(out.distrust, 1 - (d.trust(p.id) ?? 1));
  }
  return out;
}

/** The threshold lies in the middle of the scale; beyond it, factors are as wide as each other. */
const share_of_disagreement = (x: number, most: number): number =>
  x <= 1 ? x / 2 : 0.5 + (0.5 * Math.log(x)) / Math.log(most);

function colour_of(p: Placed, d: Dressing, s: Scales): Rgb {
  switch (d.options.colour) {
    case "age":
      return even(1 - (d.t - p.submap.until_s) / s.age_s);
    case "sigma":
      return Number.isFinite(p.sigma_m) ? bad(p.sigma_m / s.sigma_m) : [130, 138, 150];
    case "held":
      return Number.isFinite(p.holding) ? kHolding.find((h) => p.holding <= h.most)!.colour : [130, 138, 150];
    case "disagreement": {
      const x = d.disagreement(p.id);
      return x === null ? [130, 138, 150] : bad(share_of_disagreement(x, s.disagreement));
    }
    case "trust": {
      const x = d.trust(p.id);
      return x === null ? [130, 138, 150] : bad((1 - x) / s.distrust);
    }
    case "part":
      return robot_rgb(p.component, d.dark);
    default:
      return robot_rgb(d.colour_index(p.submap.robot), d.dark);
  }
}

export class Dresser {
  private ramps = new Map<string, Uint32Array>();
  private height = height_ramp();
  private bad = Uint32Array.from({ length: 256 }, (_, i) => abgr(bad(i / 255)));

  /** Colours the clouds that the eye sees. `all`: also those that it does not see. */
  dress(world: World, clouds: Clouds, eye: Eye, d: Dressing, all = false): Map<string, Painted> {
    const out = new Map<string, Painted>();
    if (!d.options.layers.clouds) return out;
    const scales = scales_of(world, d);
    for (const [id, placed] of world.placed) {
      const cloud = clouds.get(id);
      if (!cloud || cloud.n === 0) continue;
      const centre = transform(placed.T, cloud.centre);
      if (!all && !eye.sees(centre, cloud.radius_m)) continue;
      const ramp =
        d.options.colour === "height" ? this.height : this.ramp(colour_of(placed, d, scales), d.faint(id), d.dark);
      const shades = d.options.colour === "survey" ? d.distances(id, cloud, placed.target) : null;
      out.set(id, {
        ...painted(cloud, placed.T, shades ? this.bad : ramp, eye, centre),
        ...(shades ? { shades } : {}),
      });
    }
    return out;
  }

  survey(cloud: Cloud, eye: Eye, d: Dressing, offset: readonly number[]): Painted {
    const T = [offset[0], offset[1], offset[2], 0, 0, 0, 1];
    return painted(cloud, T, this.ramp([140, 150, 165], false, d.dark), eye, transform(T, cloud.centre));
  }

  private ramp(colour: Rgb, faint: boolean, dark: boolean): Uint32Array {
    const shown = faint ? mix(colour, dark ? [24, 30, 39] : [235, 235, 232], 0.8) : colour;
    const key = shown.map((x) => Math.round(x / 4)).join();
    let ramp = this.ramps.get(key);
    if (!ramp) this.ramps.set(key, (ramp = ramp_of(shown, dark)));
    if (this.ramps.size > 512) this.ramps.clear();
    return ramp;
  }
}

/** Leaves at most so many points, the same share of each cloud; whether these are all. */
export function thin(clouds: Map<string, Painted>, most: number): boolean {
  let points = 0;
  for (const cloud of clouds.values()) points += cloud.count;
  if (points <= most) return true;
  for (const cloud of clouds.values()) cloud.count = Math.ceil((cloud.count * most) / points);
  return false;
}

function painted(cloud: Cloud, T: readonly number[], ramp: Uint32Array, eye: Eye, centre: readonly number[]): Painted {
  const away = Math.hypot(...centre.map((x, k) => x - eye.position[k]));
  const size = Math.min(4, Math.max(1, Math.round(0.05 * eye.pixels_per_m(Math.max(away, cloud.radius_m * 0.4)))));
  return { xyz: cloud.xyz, count: cloud.n, step_m: cloud.step_m, T_world: rows_of(T), ramp, size };
}

export function window_of(world: World, options: Options): Window3 {
  const low = options.low_m ?? -Infinity;
  const high = options.high_m ?? Infinity;
  const normal: [number, number, number] = [-Math.sin(options.section_rad), Math.cos(options.section_rad), 0];
  const offset_m = normal[0] * options.section_at[0] + normal[1] * options.section_at[1];
  return {
    low_m: low,
    high_m: high,
    section: options.section ? { normal, offset_m, half_m: options.section_half_m } : null,
    ramp_low_m: Number.isFinite(low) ? low : world.low[2] + 3,
    ramp_high_m: Number.isFinite(high) ? high : world.high[2] - 1,
  };
}

export function legend_of(world: World, d: Dressing): Legend {
  const s = scales_of(world, d);
  const scale = (title: string, colour: (x: number) => Rgb, low: string, high: string, middle = ""): Legend => ({
    title,
    entries: [],
    scale: { colours: [0, 0.25, 0.5, 0.75, 1].map((x) => css(colour(x))), low, high, middle },
  });
  const w = window_of(world, d.options);
  switch (d.options.colour) {
    case "height":
      return scale("height", even, metres(w.ramp_low_m), metres(w.ramp_high_m));
    case "age":
      return scale("seen last", (x) => even(1 - x), "now", `${span(s.age_s)} ago`);
    case "sigma":
      if (![...world.placed.values()].some((p) => Number.isFinite(p.sigma_m)))
        return { title: "uncertainty: not computed", entries: [], scale: null };
      return scale(
        "uncertainty of position beside the rest of its robot's way, one sigma",
        bad,
        "0 m",
        metres(s.sigma_m),
      );
    case "survey":
      return scale("distance to the survey's nearest point", bad, "0", `${100 * SurveyDistance.most_m} cm or more`);
    case "disagreement":
      return scale("disagreement, times the threshold", bad, "0", figure(s.disagreement), "1");
    case "trust":
      return scale("share that fits what robots see now; grey: none saw it", bad, "100 %", share(1 - s.distrust));
    case "held":
      return {
        title: "closures that hold it",
        entries: kHolding.map((h) => ({ colour: css(h.colour), label: h.label })),
        scale: null,
      };
    case "part":
      return {
        title: "component of the map",
        entries: [...world.parts.values()].map((p) => ({
          colour: css(robot_rgb(p.component, d.dark)),
          label: `part ${p.component + 1}`,
        })),
        scale: null,
      };
    default: {
      const numbers = [...new Set([...world.placed.values()].map((p) => p.submap.robot))].sort((a, b) => a - b);
      return {
        title: "robot",
        entries: numbers.map((n) => ({ colour: css(robot_rgb(d.colour_index(n), d.dark)), label: d.robot_name(n) })),
        scale: null,
      };
    }
  }
}
