// SPDX-License-Identifier: BSD-3-Clause
/** All that is drawn, as balls: the picture has to hold them so that all of it is seen. */
import type { App } from "../app";
import type { Cloud } from "../cloud";
import { transform } from "../pose";
import type { Vec3 } from "../schema";
import type { Ball } from "./eye";
import { position_of } from "./where";

/** Points of a trajectory or a survey that are looked at. */
const kSamples = 500;

/** The corners of a cloud's box, in its submap's frame. */
export function corners_of({ centre, half_m }: Pick<Cloud, "centre" | "half_m">): Vec3[] {
  return Array.from(
    { length: 8 },
    (_, i) => centre.map((x, k) => (i & (1 << k) ? x + half_m[k] : x - half_m[k])) as Vec3,
  );
}

export function drawn(app: App): Ball[] {
  const { layers } = app.options;
  const out: Ball[] = [];
  const add = (at: readonly number[], radius_m = 0): void => void out.push({ at: at as Vec3, radius_m });
  for (const [id, { submap, target }] of app.world.placed) {
    for (const p of submap.path) add(transform(target, p));
    const cloud = layers.clouds ? app.clouds.get(id) : null;
    if (cloud) for (const corner of corners_of(cloud)) add(transform(target, corner));
  }
  for (const robot of app.robots) {
    const at = layers.robots || layers.reach ? position_of(app, robot) : null;
    if (at) add(at, layers.reach ? robot.reach_m : 0);
  }
  const survey = layers.survey ? app.store.get("survey") : null;
  const surface = survey && app.clouds.get(survey.cloud);
  if (surface) {
    const offset = app.world.offset_of(survey.component);
    const every = 3 * Math.ceil(surface.n / kSamples);
    for (let i = 0; i < surface.xyz.length; i += every)
      add([0, 1, 2].map((k) => surface.step_m * surface.xyz[i + k] + offset[k]));
  }
  if (layers.estimates)
    for (const [, { points, component }] of app.store.all("trajectory")) {
      const offset = app.world.offset_of(component);
      const every = 4 * Math.ceil(points.length / 4 / kSamples);
      for (let i = 0; i < points.length; i += every) add([0, 1, 2].map((k) => points[i + 1 + k] + offset[k]));
    }
  return out;
}
