// SPDX-License-Identifier: BSD-3-Clause
/** Finds the place that somebody points at: the nearest point of a cloud, or of a track, under the cursor. */
import type { App } from "../app";
import { inverse, rows_of, transform } from "../pose";
import type { SubmapId, Vec3 } from "../schema";
import type { Eye } from "./eye";
import { window_of } from "./dress";

/** A place that somebody pointed at. */
export interface Spot {
  submap: SubmapId;
  /** In the submap's frame. */
  at: Vec3;
  world: Vec3;
}

const kReach_px = 9;

export function nearest_point(app: App, eye: Eye, x: number, y: number): Spot | null {
  const window = window_of(app.world, app.options);
  let best: { score: number; submap: string; world: Vec3 } | null = null;
  const offer = (submap: string, world: Vec3, bonus: number): void => {
    if (world[2] < window.low_m || world[2] > window.high_m) return;
    const at = eye.project(world);
    if (!at) return;
    const away = Math.hypot(at[0] - x, at[1] - y);
    if (away > kReach_px) return;
    const score = at[2] * (1 + 0.02 * away) * bonus; // the nearest to the eye, then to the cursor
    if (!best || score < best.score) best = { score, submap, world };
  };
  for (const [id, placed] of app.world.placed) {
    for (const p of placed.submap.path) offer(id, transform(placed.T, p), 0.9);
    const cloud = app.options.layers.clouds ? app.clouds.get(id) : null;
    if (!cloud || !eye.sees(transform(placed.T, cloud.centre), cloud.radius_m)) continue;
    const T = rows_of(placed.T);
    const s = cloud.step_m;
    for (let i = 0; i < cloud.xyz.length; i += 3) {
      const [a, b, c] = [s * cloud.xyz[i], s * cloud.xyz[i + 1], s * cloud.xyz[i + 2]];
      offer(
        id,
        [
          T[0] * a + T[1] * b + T[2] * c + T[3],
          T[4] * a + T[5] * b + T[6] * c + T[7],
          T[8] * a + T[9] * b + T[10] * c + T[11],
        ],
        1,
      );
    }
  }
  const found = best as { score: number; submap: string; world: Vec3 } | null;
  if (!found) return null;
  const at = transform(inverse(app.world.placed.get(found.submap)!.T), found.world);
  return { submap: found.submap, at, world: found.world };
}
