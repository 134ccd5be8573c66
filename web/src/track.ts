// SPDX-License-Identifier: BSD-3-Clause
/** The values of one key over time. */
export class Track<V> {
  readonly times: number[] = [];
  readonly values: (V | null)[] = [];

  /** `keep`: how many values at most; beyond, every second of the older half goes, so that the past is coarser. */
  push(t: number, value: V | null, keep: number): void {
    const last = this.times.length - 1;
    if (last >= 0 && t <= this.times[last]) {
      this.values[last] = value; // the same message again, or a newer one of the same time
      return;
    }
    this.times.push(t);
    this.values.push(value);
    if (this.times.length > keep) this.thin(keep);
  }

  /** A value of before the last one; a time that is known keeps its value. */
  insert(t: number, value: V | null, keep: number): void {
    const i = this.index(t);
    if (i >= 0 && this.times[i] === t) return;
    this.times.splice(i + 1, 0, t);
    this.values.splice(i + 1, 0, value);
    if (this.times.length > keep) this.thin(keep);
  }

  /** Index of the value that was valid at `t`, -1 before the first one. */
  index(t: number): number {
    let low = 0;
    let high = this.times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= t) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  at(t: number): V | null {
    const i = this.index(t);
    return i < 0 ? null : this.values[i];
  }

  get latest(): V | null {
    return this.values.at(-1) ?? null;
  }

  private thin(keep: number): void {
    const half = this.times.length / 2;
    const drop = (i: number) => (keep < 4 ? i === 0 : i % 2 === 1 && i < half);
    for (const column of [this.times, this.values] as unknown[][]) {
      const kept = column.filter((_, i) => !drop(i));
      column.length = 0;
      for (const element of kept) column.push(element);
    }
  }
}
