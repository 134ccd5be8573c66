// SPDX-License-Identifier: BSD-3-Clause
/** Rigid motions as [x, y, z, qx, qy, qz, qw]: T_a_b maps coordinates of b to coordinates of a. */
import type { Pose, Vec3 } from "./schema";

export const kIdentity: Pose = [0, 0, 0, 0, 0, 0, 1];

function turn(q: readonly number[], x: number, y: number, z: number): Vec3 {
  const [, , , qx, qy, qz, qw] = q as Pose;
  const tx = 2 * (qy * z - qz * y);
  const ty = 2 * (qz * x - qx * z);
  const tz = 2 * (qx * y - qy * x);
  return [x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx];
}

/** p_a = T_a_b p_b */
export function transform(T: readonly number[], p: readonly number[]): Vec3 {
  const r = turn(T, p[0], p[1], p[2]);
  return [r[0] + T[0], r[1] + T[1], r[2] + T[2]];
}

/** T_a_c = T_a_b T_b_c */
export function compose(A: readonly number[], B: readonly number[]): Pose {
  const t = transform(A, B);
  const [, , , ax, ay, az, aw] = A as Pose;
  const [, , , bx, by, bz, bw] = B as Pose;
  return [
    ...t,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function inverse(T: readonly number[]): Pose {
  const back: Pose = [0, 0, 0, -T[3], -T[4], -T[5], T[6]];
  const t = turn(back, -T[0], -T[1], -T[2]);
  return [...t, back[3], back[4], back[5], back[6]];
}

/** Between A (at 0) and B (at 1). */
export function between(A: readonly number[], B: readonly number[], share: number): Pose {
  const dot = A[3] * B[3] + A[4] * B[4] + A[5] * B[5] + A[6] * B[6];
  const out = A.map((a, i) => a + share * ((i > 2 && dot < 0 ? -B[i] : B[i]) - a)) as Pose;
  const norm = Math.hypot(out[3], out[4], out[5], out[6]) || 1;
  for (let i = 3; i < 7; ++i) out[i] /= norm;
  return out;
}

export const distance = (a: readonly number[], b: readonly number[]): number =>
  Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

/** Rows 0 to 2 of the matrix, 12 numbers row by row. */
export function rows_of(T: readonly number[]): Float64Array {
  const [x, y, z, qx, qy, qz, qw] = T as Pose;
  return Float64Array.of(
    1 - 2 * (qy * qy + qz * qz),
    2 * (qx * qy - qz * qw),
    2 * (qx * qz + qy * qw),
    x,
    2 * (qx * qy + qz * qw),
    1 - 2 * (qx * qx + qz * qz),
    2 * (qy * qz - qx * qw),
    y,
    2 * (qx * qz - qy * qw),
    2 * (qy * qz + qx * qw),
    1 - 2 * (qx * qx + qy * qy),
    z,
  );
}

/** Angle of the rotation, degrees. */
export const turn_deg = (T: readonly number[]): number =>
  (2 * Math.atan2(Math.hypot(T[3], T[4], T[5]), Math.abs(T[6])) * 180) / Math.PI;
