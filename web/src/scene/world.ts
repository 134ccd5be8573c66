// SPDX-License-Identifier: BSD-3-Clause
/** Where everything is drawn: poses of submaps at the time shown, parts side by side, changes animated. */
import { TIMES } from "../limits";
import { place_parts } from "../places";
import type { Part } from "../places";
import { between, transform } from "../pose";
import { POSE_ROW } from "../schema";
import type { Pose, Poses, Submap, SubmapId, Vec3 } from "../schema";
import type { Store } from "../store";

export interface Placed {
  id: SubmapId;
  submap: Submap;
  component: number;
  /** T_world_submap as drawn now, between `start` and `target`. */
  T: Pose;
  start: Pose;
  target: Pose;
  sigma_m: number;
  holding: number;
}

export class World {
  placed = new Map<SubmapId, Placed>();
  parts = new Map<number, Part>();
  poses: Poses | null = null;
  low: Vec3 = [-10, -10, -2];
  high: Vec3 = [10, 10, 2];
  private moving_since = -Infinity;

  /** `animate`: submaps glide to their new places. */
  update(store: Store, t: number, animate: boolean, now_ms: number): void {
    this.poses = store.get_or_first("poses", t);
    const before = this.placed;
    this.placed = new Map();
    if (!this.poses) return this.measure_trajectories(store);
    const rows = this.poses.rows;
    this.parts = place_parts(this.poses, store.all("submap", t), (id) => this.row(store, id));
    let moved = false;
    for (const [id, submap] of store.all("submap", t)) {
      const at = this.row(store, id) * POSE_ROW;
      const part = at < 0 ? undefined : this.parts.get(rows[at]);
      if (!part) continue;
      const target = Array.from(rows.subarray(at + 1, at + 8)) as Pose;
      for (let k = 0; k < 3; ++k) target[k] += part.offset[k];
      const old = before.get(id);
      const same = old !== undefined && old.target.every((x, k) => Math.abs(x - target[k]) < 1e-9);
      const T = old && animate ? old.T : target;
      moved ||= old !== undefined && !same;
      this.placed.set(id, {
        id,
        submap,
        component: part.component,
        T,
        start: same ? old.start : T,
        target,
        holding: rows[at + 8],
        sigma_m: rows[at + 9],
      });
    }
    if (moved && animate) this.moving_since = now_ms;
    this.measure();
    this.step(now_ms);
  }

  /** Moves what glides; true while something does. */
  step(now_ms: number): boolean {
    const share = Math.min(1, Math.max(0, (now_ms - this.moving_since) / TIMES.animation_ms));
    const eased = share * share * (3 - 2 * share);
    for (const placed of this.placed.values())
      if (placed.T !== placed.target)
        placed.T = eased >= 1 ? placed.target : between(placed.start, placed.target, eased);
    return share < 1;
  }

  /** A point of a submap, where it is drawn now. */
  point(id: SubmapId, p: readonly number[]): Vec3 | null {
    const placed = this.placed.get(id);
    return placed ? transform(placed.T, p) : null;
  }

  offset_of(component: number): Vec3 {
    return this.parts.get(component)?.offset ?? [0, 0, 0];
  }

  private row(store: Store, id: string): number {
    const place = store.place_of(id);
    return place >= 0 && this.poses && place * POSE_ROW < this.poses.rows.length ? place : -1;
  }

  /** A comparison of trajectories has no submaps. */
  private measure_trajectories(store: Store): void {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    for (const [, { points }] of store.all("trajectory"))
      for (let i = 0; i < points.length; i += 4)
        for (let k = 0; k < 3; ++k) {
          this.low[k] = Math.min(this.low[k], points[i + 1 + k]);
          this.high[k] = Math.max(this.high[k], points[i + 1 + k]);
        }
    if (!Number.isFinite(this.low[0]))
      [this.low, this.high] = [
        [-10, -10, -2],
        [10, 10, 2],
      ];
  }

  private measure(): void {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    for (const part of this.parts.values())
      for (let k = 0; k < 3; ++k) {
        this.low[k] = Math.min(this.low[k], part.low[k] + part.offset[k]);
        this.high[k] = Math.max(this.high[k], part.high[k] + part.offset[k]);
      }
    if (!Number.isFinite(this.low[0]))
      [this.low, this.high] = [
        [-10, -10, -2],
        [10, 10, 2],
      ];
  }
}
