// SPDX-License-Identifier: BSD-3-Clause
/** Two submaps laid over each other by the motion that was measured between them, or as the map has them. */
import type { App } from "../app";
import { ramp_of } from "../colours";
import type { Rgb } from "../colours";
import { compose, inverse, kIdentity, rows_of, transform } from "../pose";
import type { Painted } from "../raster";
import type { Pose, SubmapId, Vec3 } from "../schema";
import { corners_of } from "./extent";
import { Eye } from "./eye";
import { Ink } from "./ink";
import { CpuPainter } from "./painters";
import { palette_of } from "./picture";

export const kPairColours: { dark: [Rgb, Rgb]; light: [Rgb, Rgb] } = {
  dark: [
    [79, 179, 255],
    [255, 168, 76],
  ],
  light: [
    [15, 111, 181],
    [200, 80, 10],
  ],
};

export interface Pair {
  from: SubmapId;
  to: SubmapId;
  /** T_from_to as measured; null: only as the map has it. */
  measured: Pose | null;
}

/** Where no cloud is there: a tunnel's piece around the submap's place. */
const kNoCloud = { centre: [0, 0, 0] as Vec3, half_m: [5, 5, 1] as Vec3 };
const kFromAbove_rad = 1e-4;
const kMargin_px = { top: 6, bottom: 6, side: 6 };

export class PairView {
  readonly element = document.createElement("div");
  private painter = new CpuPainter();
  private eye = new Eye(this.element, () => this.draw());
  private ink = new Ink(this.eye);
  private pair: Pair | null = null;
  private fitted = "";
  /** Shows the map's opinion instead of the measurement. */
  by_map = false;

  constructor(private readonly app: App) {
    this.element.className = "pair view";
    this.element.append(this.painter.canvas, this.ink.canvas);
    new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = this.element;
      this.eye.resize(width, height);
      this.painter.resize(width, height);
      this.ink.resize(width, height, Math.min(devicePixelRatio || 1, 2));
      this.draw();
    }).observe(this.element);
    app.on((topic) => (topic === "data" || topic === "options" || topic === "cloud") && this.draw());
  }

  show(pair: Pair): void {
    this.pair = pair;
    for (const id of [pair.from, pair.to]) this.app.clouds.want(id);
    this.draw();
  }

  /** T_from_to by which the second cloud is laid; null when it is not known. */
  private relative(): Pose | null {
    if (!this.pair) return null;
    if (this.pair.measured && !this.by_map) return this.pair.measured;
    const [a, b] = [this.app.world.placed.get(this.pair.from), this.app.world.placed.get(this.pair.to)];
    return a && b && a.component === b.component ? compose(inverse(a.target), b.target) : null;
  }

  private draw(): void {
    const { app, pair, eye } = this;
    if (!pair || !eye.width || !this.element.isConnected) return;
    const relative = this.relative();
    const poses: [Pose, Pose | null] = [kIdentity, relative];
    this.fit(pair, poses);
    eye.update();
    const clouds = new Map<string, Painted>();
    const colours = kPairColours[app.dark ? "dark" : "light"];
    let low = Infinity;
    let high = -Infinity;
    [pair.from, pair.to].forEach((id, i) => {
      const cloud = app.clouds.get(id);
      const T = poses[i];
      if (!cloud || !T) return;
      const centre = transform(T, cloud.centre);
      low = Math.min(low, centre[2] - 2);
      high = Math.max(high, centre[2] + 3);
      clouds.set(id, {
        xyz: cloud.xyz,
        count: cloud.n,
        step_m: cloud.step_m,
        T_world: rows_of(T),
        ramp: ramp_of(colours[i], app.dark),
        size: 1,
      });
    });
    const window = { low_m: -Infinity, high_m: Infinity, section: null, ramp_low_m: low, ramp_high_m: high };
    this.painter.draw(clouds, eye.matrix, eye.camera, window, app.dark ? [14, 18, 26] : [244, 243, 239], false);
    this.draw_paths(pair, poses, relative);
  }

  private draw_paths(pair: Pair, poses: (Pose | null)[], relative: Pose | null): void {
    const palette = palette_of(this.app.dark);
    const colours = kPairColours[this.app.dark ? "dark" : "light"];
    this.ink.begin();
    [pair.from, pair.to].forEach((id, i) => {
      const path = this.app.store.get("submap", Infinity, id)?.path ?? [];
      const T = poses[i];
      if (T)
        this.ink.line(
          path.map((p) => transform(T, p)),
          { colour: `rgb(${colours[i].join()})`, width: 2.5 },
        );
    });
    if (!relative) this.ink.text(14, 24, "The map does not join these two.", palette.soft, palette.halo);
    else if (!this.app.clouds.get(pair.from) && !this.app.clouds.get(pair.to))
      this.ink.text(14, 24, "No clouds.", palette.soft, palette.halo);
  }

  /** Once per pair, as soon as both clouds are there. */
  private fit(pair: Pair, poses: (Pose | null)[]): void {
    const clouds = [pair.from, pair.to].map((id) => this.app.clouds.get(id));
    const name = `${pair.from} ${pair.to} ${clouds.map((c) => c !== null).join()}`;
    if (this.fitted === name) return;
    this.fitted = name;
    const balls = clouds.flatMap((cloud, i) => {
      const T = poses[i];
      return T ? corners_of(cloud ?? kNoCloud).map((corner) => ({ at: transform(T, corner), radius_m: 0 })) : [];
    });
    this.eye.fit(balls, kFromAbove_rad, kMargin_px);
  }
}
