// SPDX-License-Identifier: BSD-3-Clause
/** Where robots were at a time, as the map has it now. */
import type { App } from "../app";
import { compose, inverse, transform } from "../pose";
import type { RobotView } from "../derive";
import type { Vec3 } from "../schema";

/**
 * Where a robot is now: beyond its newest submap by its odometry, where the submap states how its frame lies in odometry and
 * the server has heard the robot. Nobody knows more than the map of one that only the map knows.
 */
export function position_of(app: App, robot: RobotView): Vec3 | null {
  const { newest, status } = robot;
  if (!newest) return null;
  const placed = app.world.placed.get(newest.id);
  if (!placed) return null;
  const is_known = status !== null && status.last_seen_s_ago !== null && status.session === newest.session;
  if (newest.T_odom_submap && is_known && status.T_odom_body)
    return transform(compose(placed.T, inverse(newest.T_odom_submap)), status.T_odom_body.translation_m);
  return transform(placed.T, newest.path.at(-1) ?? [0, 0, 0]);
}

/** Where a robot was at time t, by the map's submaps; null where none covers that time. */
export function place_at(app: App, robot: number, t: number): Vec3 | null {
  for (const placed of app.world.placed.values()) {
    const { robot: own, from_s, until_s, path } = placed.submap;
    if (own !== robot || t < from_s || t > until_s || path.length === 0) continue;
    const at = ((t - from_s) / Math.max(until_s - from_s, 1e-6)) * (path.length - 1);
    const i = Math.min(Math.floor(at), path.length - 1);
    const next = path[Math.min(i + 1, path.length - 1)];
    return transform(
      placed.T,
      path[i].map((x, k) => x + (at - i) * (next[k] - x)),
    );
  }
  return null;
}

/** The same by a report's estimates, the best one that knows. */
export function estimate_at(app: App, robot: number, t: number): Vec3 | null {
  for (const kind of ["server", "reference", "corrected", "onboard"])
    for (const [name, trajectory] of app.store.all("trajectory")) {
      const at = name.endsWith(`/${kind}`) && trajectory.robot === robot ? point_at(trajectory.points, t) : null;
      if (at) return at.map((x, k) => x + app.world.offset_of(trajectory.component)[k]) as Vec3;
    }
  return null;
}

/** A point of a trajectory (t, x, y, z after each other) at time t; null outside of it. */
export function point_at(points: Float64Array, t: number): Vec3 | null {
  let low = 0;
  let high = points.length / 4;
  if (high === 0 || t < points[0] || t > points[points.length - 4]) return null;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[4 * middle] <= t) low = middle;
    else high = middle;
  }
  const a = 4 * low;
  const b = Math.min(a + 4, points.length - 4);
  const share = points[b] > points[a] ? (t - points[a]) / (points[b] - points[a]) : 0;
  return [1, 2, 3].map((k) => points[a + k] + share * (points[b + k] - points[a + k])) as Vec3;
}
