// SPDX-License-Identifier: BSD-3-Clause
/** Draws points on the CPU: a machine without a GPU draws a million points ten times faster this way than with WebGL in software. */

/** A cloud to draw: `count` of its points (a prefix), `T_world` the rows of T_world_submap (12 numbers). */
export interface Painted {
  xyz: Int16Array;
  count: number;
  step_m: number;
  T_world: Float64Array;
  /** 256 colours (ABGR) from the lowest to the highest height. */
  ramp: Uint32Array;
  /** Side of a point, pixels. */
  size: number;
  /** Instead of heights: the place of each point in its ramp. */
  shades?: Uint8Array;
}

/** The part of the world that is drawn: heights, and the distance to a plane. */
export interface Window3 {
  low_m: number;
  high_m: number;
  /** Unit normal and offset of the section's plane, and half of its thickness. */
  section: { normal: [number, number, number]; offset_m: number; half_m: number } | null;
  /** Heights of the first and the last colour of ramps. */
  ramp_low_m: number;
  ramp_high_m: number;
}

export class Raster {
  width = 0;
  height = 0;
  pixels = new Uint32Array(0);
  private depth = new Float32Array(0);

  resize(width: number, height: number): void {
    if (width === this.width && height === this.height) return;
    this.width = width;
    this.height = height;
    this.pixels = new Uint32Array(width * height);
    this.depth = new Float32Array(width * height);
  }

  begin(background: number): void {
    this.pixels.fill(background);
    this.depth.fill(Infinity);
  }

  /** `view`: projection times view, 16 numbers column by column, as WebGL has them. Returns the points that were drawn. */
  draw(cloud: Painted, view: ArrayLike<number>, window: Window3): number {
    const { width, height, pixels, depth } = this;
    const m = in_pixels(cloud, view, width, height);
    const [a0, a1, a2, a3, b0, b1, b2, b3, w0, w1, w2, w3] = m.screen as unknown as number[];
    const [h0, h1, h2, h3] = m.height as unknown as number[];
    const [s0, s1, s2, s3] = m.section(window) as unknown as number[];
    const half = window.section?.half_m ?? Infinity;
    const { low_m, high_m } = window;
    const per_m = 255 / Math.max(window.ramp_high_m - window.ramp_low_m, 1e-6);
    const { xyz, ramp, size, shades } = cloud;
    const end = 3 * cloud.count;
    let drawn = 0;
    for (let i = 0; i < end; i += 3) {
      const x = xyz[i];
      const y = xyz[i + 1];
      const z = xyz[i + 2];
      const w = w0 * x + w1 * y + w2 * z + w3;
      if (w < kNear_m) continue;
      const px = ((a0 * x + a1 * y + a2 * z + a3) / w) | 0;
      const py = ((b0 * x + b1 * y + b2 * z + b3) / w) | 0;
      if (px < 0 || py < 0 || px >= width || py >= height) continue;
      const h = h0 * x + h1 * y + h2 * z + h3;
      if (h < low_m || h > high_m) continue;
      const s = s0 * x + s1 * y + s2 * z + s3;
      if (s > half || s < -half) continue;
      const at = py * width + px;
      if (w >= depth[at]) continue;
      ++drawn;
      let shade = shades ? shades[(i / 3) | 0] : ((h - window.ramp_low_m) * per_m) | 0;
      if (shade < 0) shade = 0;
      else if (shade > 255) shade = 255;
      const colour = ramp[shade];
      depth[at] = w;
      pixels[at] = colour;
      if (size > 1) this.fill(px, py, w, colour, size);
    }
    return drawn;
  }

  /** Darkens pixels that lie behind their neighbours, so that edges are seen (after Boucheny's eye-dome lighting). */
  light(strength = 1): void {
    const { width, height, pixels, depth } = this;
    for (let y = 1; y < height - 1; ++y)
      for (let x = 1, i = y * width + 1; x < width - 1; ++x, ++i) {
        const d = depth[i];
        if (d === Infinity) continue;
        let behind = 0;
        const limit = d * 0.05;
        for (const j of [i - 1, i + 1, i - width, i + width]) {
          const step = d - depth[j];
          if (step > 0) behind += step < limit ? step : limit;
        }
        if (behind <= 0) continue;
        const keep = (256 / (1 + (strength * 12 * behind) / d)) | 0;
        const c = pixels[i];
        pixels[i] =
          0xff000000 | ((((c & 0xff00ff) * keep) >>> 8) & 0xff00ff) | ((((c & 0xff00) * keep) >>> 8) & 0xff00);
      }
  }

  private fill(px: number, py: number, w: number, colour: number, size: number): void {
    const { width, height, pixels, depth } = this;
    const right = Math.min(px + size, width);
    const bottom = Math.min(py + size, height);
    for (let y = py; y < bottom; ++y)
      for (let x = px, at = y * width + px; x < right; ++x, ++at)
        if (w < depth[at]) {
          depth[at] = w;
          pixels[at] = colour;
        }
  }
}

const kNear_m = 0.05;

/** Rows that take x, y, z of a cloud to pixels (before the division), to depth, and to height. */
function in_pixels(cloud: Painted, v: ArrayLike<number>, width: number, height: number) {
  const { T_world: T, step_m } = cloud;
  const row = (r: number): number[] => {
    const [x, y, z, t] = [v[r], v[4 + r], v[8 + r], v[12 + r]];
    const along = (k: number) => x * T[k] + y * T[4 + k] + z * T[8 + k];
    return [step_m * along(0), step_m * along(1), step_m * along(2), along(3) + t];
  };
  const [x, y, w] = [row(0), row(1), row(3)];
  const screen = new Float64Array(12);
  for (let k = 0; k < 4; ++k) {
    screen[k] = 0.5 * width * (x[k] + w[k]);
    screen[4 + k] = 0.5 * height * (w[k] - y[k]);
    screen[8 + k] = w[k];
  }
  const section = (window: Window3): number[] => {
    const plane = window.section;
    if (!plane) return [0, 0, 0, 0];
    const [nx, ny, nz] = plane.normal;
    const along = (k: number) => nx * T[k] + ny * T[4 + k] + nz * T[8 + k];
    return [step_m * along(0), step_m * along(1), step_m * along(2), along(3) - plane.offset_m];
  };
  return { screen, height: [step_m * T[8], step_m * T[9], step_m * T[10], T[11]], section };
}
