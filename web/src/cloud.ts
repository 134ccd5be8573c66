// SPDX-License-Identifier: BSD-3-Clause
/** Clouds as bytes: float32 step_m, uint32 n, n times int16 x, y, z. Points are shuffled: a prefix is a thinner cloud. */
import { LIMITS } from "./limits";
import type { Vec3 } from "./schema";

export interface Cloud {
  step_m: number;
  n: number;
  /** x, y, z after each other, times step_m; in the submap's frame. */
  xyz: Int16Array;
  centre: Vec3;
  /** From its centre to its sides, along x, y and z. */
  half_m: Vec3;
  radius_m: number;
}

const kHeader = 8;

/** Throws when the bytes are no cloud. */
export function decode_cloud(bytes: ArrayBuffer): Cloud {
  if (bytes.byteLength < kHeader) throw new Error(`a cloud of ${bytes.byteLength} bytes, expected at least ${kHeader}`);
  const head = new DataView(bytes);
  const step_m = head.getFloat32(0, true);
  const n = head.getUint32(4, true);
  if (bytes.byteLength !== kHeader + 6 * n)
    throw new Error(`a cloud of ${n} points in ${bytes.byteLength} bytes, expected ${kHeader + 6 * n}`);
  if (!(step_m > 0) || !Number.isFinite(step_m)) throw new Error(`a cloud with a step of ${step_m} m`);
  const xyz = new Int16Array(bytes, kHeader, 3 * n); // machines with a browser are little-endian
  return { step_m, n, xyz, ...bounds(xyz, step_m) };
}

function bounds(xyz: Int16Array, step_m: number): { centre: Vec3; half_m: Vec3; radius_m: number } {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < xyz.length; ++i) {
    const k = i % 3;
    if (xyz[i] < low[k]) low[k] = xyz[i];
    if (xyz[i] > high[k]) high[k] = xyz[i];
  }
  if (xyz.length === 0) return { centre: [0, 0, 0], half_m: [0, 0, 0], radius_m: 0 };
  const centre = low.map((l, k) => (step_m * (l + high[k])) / 2) as Vec3;
  const half_m = low.map((l, k) => (step_m * (high[k] - l)) / 2) as Vec3;
  return { centre, half_m, radius_m: Math.hypot(...half_m) };
}

export function bytes_of_base64(text: string): ArrayBuffer {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return bytes.buffer;
}

/** The same bytes again, of the points that are kept. */
export function base64_of_cloud(cloud: Cloud): string {
  const bytes = new Uint8Array(kHeader + 6 * cloud.n);
  const head = new DataView(bytes.buffer);
  head.setFloat32(0, cloud.step_m, true);
  head.setUint32(4, cloud.n, true);
  bytes.set(new Uint8Array(cloud.xyz.buffer, cloud.xyz.byteOffset, 6 * cloud.n), kHeader);
  let raw = "";
  for (let i = 0; i < bytes.length; i += 0x8000) raw += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(raw);
}

/** Fetches what is asked for, and keeps at most LIMITS.points points. */
export class Clouds {
  private held = new Map<string, Cloud>();
  private asked = new Set<string>();
  private queue: string[] = [];
  private failed = new Map<string, number>();
  private running = 0;
  points = 0;

  /** `load`: the bytes of a cloud by its name; a promise that fails is asked again later. */
  constructor(
    private readonly load: (name: string) => Promise<ArrayBuffer>,
    private readonly on_change: () => void,
  ) {}

  get(name: string): Cloud | null {
    return this.held.get(name) ?? null;
  }
  [Symbol.iterator](): IterableIterator<[string, Cloud]> {
    return this.held.entries();
  }
  get waiting(): number {
    return this.queue.length + this.running;
  }

  want(name: string): void {
    if (this.asked.has(name)) return;
    this.asked.add(name);
    this.queue.push(name);
    this.pump();
  }

  clear(): void {
    this.held.clear();
    this.asked.clear();
    this.queue = [];
    this.failed.clear();
    this.points = 0;
    this.on_change();
  }

  private pump(): void {
    while (this.running < LIMITS.fetches && this.queue.length > 0) {
      const name = this.queue.pop()!; // the newest first
      ++this.running;
      this.load(name)
        .then((bytes) => this.keep(name, decode_cloud(bytes)))
        .catch(() => this.try_later(name))
        .finally(() => {
          --this.running;
          this.pump();
        });
    }
  }

  private try_later(name: string): void {
    const times = (this.failed.get(name) ?? 0) + 1;
    this.failed.set(name, times);
    if (times < 5) setTimeout(() => (this.asked.delete(name), this.want(name)), 1000 * times);
  }

  private keep(name: string, cloud: Cloud): void {
    if (!this.asked.has(name)) return; // cleared meanwhile
    this.held.set(name, cloud);
    this.points += cloud.n;
    if (this.points > LIMITS.points) this.thin();
    this.on_change();
  }

  /** Every cloud keeps the same share of its points. */
  private thin(): void {
    const share = (0.9 * LIMITS.points) / this.points;
    this.points = 0;
    for (const [name, cloud] of this.held) {
      const n = Math.floor(cloud.n * share);
      this.held.set(name, { ...cloud, n, xyz: cloud.xyz.slice(0, 3 * n) });
      this.points += n;
    }
  }
}
