// SPDX-License-Identifier: BSD-3-Clause
/** The view that the operator has chosen. Remembered by this browser. */

export const COLOUR_MODES = {
  robot: "robot",
  height: "height",
  age: "age",
  sigma: "uncertainty",
  held: "closures that hold it",
  disagreement: "disagreement with odometry",
  trust: "how robots find that it fits",
  part: "component of the map",
  survey: "distance to the survey",
} as const;
export type ColourMode = keyof typeof COLOUR_MODES;

export const LAYERS = {
  clouds: "Clouds",
  tracks: "Tracks",
  accepted: "Closures in the map",
  candidate: "Closures waiting",
  rejected: "Closures refused",
  robots: "Robots",
  reach: "Where silent robots may be",
  ghost: "Last correction",
  marks: "Marks",
  survey: "Survey",
  estimates: "Other estimates",
} as const;
export type Layer = keyof typeof LAYERS;

export interface Options {
  colour: ColourMode;
  layers: Record<Layer, boolean>;
  /** Heights that are drawn, m; null: no bound. */
  low_m: number | null;
  high_m: number | null;
  section: boolean;
  section_half_m: number;
  /** The section's line on the ground: a point and the angle of its direction. */
  section_at: [number, number];
  section_rad: number;
  edges: boolean;
}

export function default_options(): Options {
  return {
    colour: "robot",
    layers: {
      clouds: true,
      tracks: true,
      accepted: true,
      candidate: false,
      rejected: false,
      robots: true,
      reach: true,
      ghost: true,
      marks: true,
      survey: false,
      estimates: false,
    },
    low_m: null,
    high_m: null,
    section: false,
    section_half_m: 0.5,
    section_at: [0, 0],
    section_rad: 0,
    edges: true,
  };
}

/** The phases of a mission: what is loud in each. */
export const PHASES = {
  deploy: {
    name: "Deploy",
    help: "Is everybody here, and merged?",
    tab: "alerts",
    colour: "robot",
    layers: { candidate: false, rejected: false },
  },
  explore: {
    name: "Explore",
    help: "Where is everybody, and what is mapped?",
    tab: "alerts",
    colour: "robot",
    layers: { candidate: false, rejected: false },
  },
  recover: {
    name: "Recover",
    help: "Who is silent, and where may he be?",
    tab: "alerts",
    colour: "age",
    layers: { reach: true, rejected: false },
  },
  debrief: {
    name: "Debrief",
    help: "How good is the map, and why?",
    tab: "closures",
    colour: "sigma",
    layers: { rejected: true, candidate: true },
  },
} as const satisfies Record<
  string,
  { name: string; help: string; tab: string; colour: ColourMode; layers: Partial<Record<Layer, boolean>> }
>;
export type Phase = keyof typeof PHASES;

/** This browser's memory; a page opened as a file may not be allowed any. */
export const memory = {
  read<T>(key: string, otherwise: T): T {
    try {
      const text = localStorage.getItem(`tutti.${key}`);
      return text === null ? otherwise : (JSON.parse(text) as T);
    } catch {
      return otherwise;
    }
  },
  write(key: string, value: unknown): void {
    try {
      localStorage.setItem(`tutti.${key}`, JSON.stringify(value));
    } catch {
      // nothing is remembered then
    }
  },
};
