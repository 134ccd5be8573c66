// SPDX-License-Identifier: BSD-3-Clause
/** The camera, and how one moves it: mouse, fingers, keys. */
import { MOUSE, Matrix4, PerspectiveCamera, Vector3 } from "three";
import { MapControls } from "three/examples/jsm/controls/MapControls.js";
import type { Vec3 } from "../schema";

const kField_deg = 45;
const kTilt_rad = 0.62;
/** Between what is drawn and the picture's edges, where tools, scale and names are. */
const kMargin_px = { top: 60, bottom: 44, side: 24 };

export interface Ball {
  at: Vec3;
  radius_m: number;
}

export class Eye {
  readonly camera = new PerspectiveCamera(kField_deg, 1, 0.05, 20_000);
  private controls: MapControls;
  /** Projection times view, column by column. */
  readonly matrix = new Float64Array(16);
  width = 1;
  height = 1;
  /** Whether somebody chose what to look at, since fit(). */
  aimed = false;
  private held = false;
  private product = new Matrix4();

  constructor(element: HTMLElement, on_change: () => void) {
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(0, -40, 40);
    this.controls = new MapControls(this.camera, element);
    this.controls.zoomToCursor = true;
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = Math.PI * 0.98;
    this.controls.mouseButtons = { LEFT: MOUSE.PAN, MIDDLE: MOUSE.ROTATE, RIGHT: MOUSE.ROTATE };
    this.controls.addEventListener("start", () => (this.held = true));
    this.controls.addEventListener("end", () => (this.held = false));
    this.controls.addEventListener("change", () => {
      this.aimed ||= this.held;
      on_change();
    });
  }

  resize(width: number, height: number): void {
    this.width = width;
    this.height = height;
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
  }

  update(): void {
    this.camera.updateMatrixWorld();
    this.product.multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
    this.matrix.set(this.product.elements);
  }

  /** The same view in a picture of another shape: as wide, and higher or lower. */
  reshaped(aspect: number): Float64Array {
    const other = this.camera.clone();
    const half = (kField_deg * Math.PI) / 360;
    other.fov = (360 / Math.PI) * Math.atan((Math.tan(half) * Math.min(this.camera.aspect, 2)) / aspect);
    other.aspect = aspect;
    other.updateProjectionMatrix();
    return Float64Array.from(
      this.product.multiplyMatrices(other.projectionMatrix, this.camera.matrixWorldInverse).elements,
    );
  }

  /** Pixels and depth of a point of the world; null behind the camera. */
  project(p: readonly number[]): [number, number, number] | null {
    const m = this.matrix;
    const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    if (w < 0.05) return null;
    const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w;
    const y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
    return [0.5 * this.width * (1 + x), 0.5 * this.height * (1 - y), w];
  }

  /** Pixels of a metre at a depth. */
  pixels_per_m(depth: number): number {
    return (0.5 * this.height) / (Math.tan((kField_deg * Math.PI) / 360) * Math.max(depth, 0.05));
  }

  /** Whether a ball may be in the picture. */
  sees(centre: readonly number[], radius: number): boolean {
    const m = this.matrix;
    for (let plane = 0; plane < 6; ++plane) {
      const row = plane >> 1;
      const sign = plane & 1 ? -1 : 1;
      const a = m[3] + sign * m[row];
      const b = m[7] + sign * m[4 + row];
      const c = m[11] + sign * m[8 + row];
      const d = m[15] + sign * m[12 + row];
      if (row < 2 && a * centre[0] + b * centre[1] + c * centre[2] + d < -radius * Math.hypot(a, b, c)) return false;
    }
    return true;
  }

  /** Whether all of these are in the picture. */
  holds(balls: Iterable<Ball>): boolean {
    for (const { at, radius_m } of balls) {
      const spot = this.project(at);
      if (!spot) return false;
      const reach = radius_m * this.pixels_per_m(spot[2]);
      if (spot[0] < reach || spot[0] + reach > this.width) return false;
      if (spot[1] < reach || spot[1] + reach > this.height) return false;
    }
    return true;
  }

  get target(): Vec3 {
    return this.controls.target.toArray() as Vec3;
  }
  get distance(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }
  get position(): Vec3 {
    return this.camera.position.toArray() as Vec3;
  }
  /** Angle from the world's x to what is right on the screen, seen from above. */
  get heading(): number {
    const m = this.camera.matrixWorld.elements;
    return Math.atan2(m[1], m[0]);
  }

  /** Looks at all of these from above, turned to the south by an angle, from as near as they are all in the picture. */
  fit(balls: Ball[], tilt_rad = kTilt_rad, margin_px = kMargin_px): void {
    if (balls.length === 0) return;
    const [sin, cos] = [Math.sin(tilt_rad), Math.cos(tilt_rad)];
    const half = Math.tan((kField_deg * Math.PI) / 360);
    const free = (px: number, of: number): number => half * Math.max(0.3, 1 - (2 * px) / of);
    /** For one direction of the picture: from how far away, and how far off the origin the middle is. */
    const along = (of: (p: Vec3) => number, low: number, high: number): { away: number; middle: number } => {
      let [most, least] = [-Infinity, -Infinity];
      for (const { at, radius_m } of balls) {
        const nearer = cos * at[2] - sin * at[1]; // to the camera than the origin
        most = Math.max(most, nearer + (of(at) + radius_m * Math.hypot(1, high)) / high);
        least = Math.max(least, nearer + (-of(at) + radius_m * Math.hypot(1, low)) / low);
      }
      const middle = (most - least) / (1 / high + 1 / low);
      return { away: most - middle / high, middle };
    };
    const { aspect } = this.camera;
    const side = free(margin_px.side, this.width) * aspect;
    const right = along((p) => p[0], side, side);
    const up = along(
      (p) => cos * p[1] + sin * p[2],
      free(margin_px.bottom, this.height),
      free(margin_px.top, this.height),
    );
    const away = Math.max(right.away, up.away, 4);
    const place = new Vector3(right.middle, cos * up.middle - sin * away, sin * up.middle + cos * away);
    const ground = balls.reduce((sum, { at }) => sum + at[2], 0) / balls.length;
    const ahead = (place.z - ground) / cos; // what it turns around is on the ground
    this.controls.target.set(place.x, place.y + sin * ahead, ground);
    this.camera.position.copy(place);
    this.controls.update();
    this.aimed = false;
  }

  /** Looks straight down, and keeps what is in the middle. */
  top(): void {
    const away = this.distance;
    this.camera.position.copy(this.controls.target).add(new Vector3(0, -0.0001 * away, away));
    this.aim();
  }

  /** Keeps its direction and looks at p; from `away` if given. */
  look_at(p: readonly number[], away?: number): void {
    const back = this.camera.position.clone().sub(this.controls.target);
    if (away !== undefined) back.setLength(away);
    this.controls.target.set(p[0], p[1], p[2]);
    this.camera.position.copy(this.controls.target).add(back);
    this.aim();
  }

  /** Along the ground: right and forward in shares of the distance; turned by an angle; zoomed by a factor. */
  move(right: number, forward: number, turn = 0, zoom = 1): void {
    const back = this.camera.position.clone().sub(this.controls.target);
    const a = this.heading;
    const d = this.distance;
    const step = new Vector3(
      (Math.cos(a) * right - Math.sin(a) * forward) * d,
      (Math.sin(a) * right + Math.cos(a) * forward) * d,
      0,
    );
    this.controls.target.add(step);
    back.applyAxisAngle(this.camera.up, turn).multiplyScalar(zoom);
    this.camera.position.copy(this.controls.target).add(back);
    this.aim();
  }

  private aim(): void {
    this.aimed = true;
    this.controls.update();
  }
}
