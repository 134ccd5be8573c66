// SPDX-License-Identifier: BSD-3-Clause
/** How far the points of a map are from the survey: to the nearest of its points, by a grid. */
import type { Cloud } from "./cloud";
import { rows_of } from "./pose";
import type { Pose } from "./schema";

const kCell_m = 0.3;

export class SurveyDistance {
  /** Farther than this is all the same. */
  static readonly most_m = 0.3;
  /** First point of every cell in `next`, by the cell's number. */
  private first = new Map<number, number>();
  private next: Int32Array;
  private known = new Map<string, { T: Pose; shades: Uint8Array }>();

  constructor(readonly survey: Cloud) {
    this.next = new Int32Array(survey.n).fill(-1);
    const { xyz, step_m: s } = survey;
    for (let i = 0; i < survey.n; ++i) {
      const cell = cell_of(
        Math.floor((s * xyz[3 * i]) / kCell_m),
        Math.floor((s * xyz[3 * i + 1]) / kCell_m),
        Math.floor((s * xyz[3 * i + 2]) / kCell_m),
      );
      this.next[i] = this.first.get(cell) ?? -1;
      this.first.set(cell, i);
    }
  }

  /** 0 for points on the survey, 255 for those most_m away or more. */
  shades(id: string, cloud: Cloud, T: Pose): Uint8Array {
    const known = this.known.get(id);
    if (known && known.T === T && known.shades.length === cloud.n) return known.shades;
    const shades = new Uint8Array(cloud.n);
    const m = rows_of(T);
    const s = cloud.step_m;
    for (let i = 0; i < cloud.n; ++i) {
      const [x, y, z] = [s * cloud.xyz[3 * i], s * cloud.xyz[3 * i + 1], s * cloud.xyz[3 * i + 2]];
      const d = this.nearest(
        m[0] * x + m[1] * y + m[2] * z + m[3],
        m[4] * x + m[5] * y + m[6] * z + m[7],
        m[8] * x + m[9] * y + m[10] * z + m[11],
      );
      shades[i] = Math.min(255, Math.round((255 * d) / SurveyDistance.most_m));
    }
    this.known.set(id, { T, shades });
    return shades;
  }

  /** Distance to the nearest point of the survey, at most most_m. */
  nearest(x: number, y: number, z: number): number {
    const { xyz, step_m: s } = this.survey;
    const [a, b, c] = [Math.floor(x / kCell_m), Math.floor(y / kCell_m), Math.floor(z / kCell_m)];
    let best = SurveyDistance.most_m ** 2;
    for (let dx = -1; dx <= 1; ++dx)
      for (let dy = -1; dy <= 1; ++dy)
        for (let dz = -1; dz <= 1; ++dz)
          for (let i = this.first.get(cell_of(a + dx, b + dy, c + dz)) ?? -1; i >= 0; i = this.next[i]) {
            const d = (s * xyz[3 * i] - x) ** 2 + (s * xyz[3 * i + 1] - y) ** 2 + (s * xyz[3 * i + 2] - z) ** 2;
            if (d < best) best = d;
          }
    return Math.sqrt(best);
  }
}

/** One number per cell; 17 bits an axis. */
const cell_of = (a: number, b: number, c: number): number =>
  ((a + 65536) * 131072 + (b + 65536)) * 131072 + (c + 65536);
