// SPDX-License-Identifier: BSD-3-Clause
/** All that the page knows, over time. Fed by either source; asked by everything that is shown. */
import { DECODERS } from "./decode";
import { LIMITS } from "./limits";
import { DecodeError } from "./reading";
import type { Kind, Message, Poses, Values } from "./schema";
import { Track } from "./track";

export type Listener = (changed: ReadonlySet<Kind>) => void;

export class Store {
  private tracks = new Map<Kind, Map<string, Track<unknown>>>();
  private places = new Map<string, number>();
  private ids: string[] = [];
  private changed = new Set<Kind>();
  private listeners: Listener[] = [];
  private scheduled = false;
  private recalls = false;
  /** Messages that could not be read, and what the last one lacked. */
  unread = { count: 0, last: "" };
  /** Times of the newest and the oldest message, s. */
  newest = 0;
  oldest = Infinity;
  /** Grows with every change. */
  version = 0;

  /** `keep_all`: nothing is thinned (reports). `later` calls its argument once, soon. */
  constructor(
    private readonly keep_all = false,
    private readonly later: (run: () => void) => void = (run) => run(),
  ) {}

  apply(message: Message): void {
    const { kind, name } = split(message.key);
    if (!Object.hasOwn(DECODERS, kind)) return; // a newer program sends more than this page knows
    try {
      this.put(kind as Kind, name, message);
    } catch (error) {
      if (!(error instanceof DecodeError)) throw error;
      ++this.unread.count;
      this.unread.last = `${message.key}: ${error.message}`;
    }
  }

  /** Takes messages of before, among those that are here. */
  recall(messages: readonly Message[]): void {
    this.recalls = true;
    for (const message of messages) this.apply(message);
    this.recalls = false;
  }

  /** Forgets everything: another mission, or another life of the server. */
  clear(): void {
    for (const kind of this.tracks.keys()) this.changed.add(kind);
    this.tracks.clear();
    this.places.clear();
    this.ids = [];
    this.newest = 0;
    this.oldest = Infinity;
    this.notify();
  }

  /** After a gap: what is not among these keys has gone meanwhile. */
  retain(keys: ReadonlySet<string>): void {
    for (const [kind, named] of this.tracks)
      for (const [name, track] of named) {
        if (track.latest === null || keys.has(name === "" ? kind : `${kind}/${name}`)) continue;
        track.push(this.newest, null, Infinity);
        this.changed.add(kind);
      }
    this.notify();
  }

  on_change(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** The value of a key at time t; null when there was none, or none any more. */
  get<K extends Kind>(kind: K, t = Infinity, name = ""): Values[K] | null {
    return (this.tracks.get(kind)?.get(name)?.at(t) ?? null) as Values[K] | null;
  }

  /** As get(); before the first value, the first one: who came late places old submaps by the poses that he knows. */
  get_or_first<K extends Kind>(kind: K, t: number, name = ""): Values[K] | null {
    return this.get(kind, t, name) ?? this.track(kind, name)?.values[0] ?? null;
  }

  track<K extends Kind>(kind: K, name = ""): Track<Values[K]> | null {
    return (this.tracks.get(kind)?.get(name) ?? null) as Track<Values[K]> | null;
  }

  /** All values of a kind at time t, by name. */
  *all<K extends Kind>(kind: K, t = Infinity): Generator<[string, Values[K]]> {
    for (const [name, track] of this.tracks.get(kind) ?? []) {
      const value = track.at(t) as Values[K] | null;
      if (value !== null) yield [name, value];
    }
  }

  /** All values over time, by the time since which they are valid. */
  everything(): { key: string; kind: Kind; t: number; value: unknown }[] {
    const out: { key: string; kind: Kind; t: number; value: unknown }[] = [];
    for (const [kind, named] of this.tracks)
      for (const [name, track] of named)
        track.times.forEach((t, i) =>
          out.push({ key: name === "" ? kind : `${kind}/${name}`, kind, t, value: track.values[i] }),
        );
    return out.sort((a, b) => a.t - b.t);
  }

  /** Poses that no message has, such as those of a map that might be. */
  read_poses(value: unknown): Poses {
    return DECODERS.poses(value, "poses", { place: (id) => this.place(id) });
  }

  /** Place of a submap in the rows of poses; -1 when it is in none. */
  place_of(id: string): number {
    return this.places.get(id) ?? -1;
  }
  id_at(place: number): string {
    return this.ids[place] ?? "";
  }

  /** How much is kept: keys, values over time, numbers in poses. */
  size(): { keys: number; values: number; pose_numbers: number } {
    let keys = 0;
    let values = 0;
    for (const named of this.tracks.values())
      for (const track of named.values()) {
        ++keys;
        values += track.values.length;
      }
    const held = this.track("poses")?.values ?? [];
    return { keys, values, pose_numbers: held.reduce((sum, p) => sum + (p?.rows.length ?? 0), 0) };
  }

  private put(kind: Kind, name: string, message: Message): void {
    const table = { place: (id: string) => this.place(id) };
    const value =
      message.value === null || message.value === undefined ? null : DECODERS[kind](message.value, kind, table);
    const named = this.tracks.get(kind) ?? new Map<string, Track<unknown>>();
    this.tracks.set(kind, named);
    let track = named.get(name);
    if (track === undefined) {
      if (value === null && !this.recalls) return;
      if (named.size >= LIMITS.keys) named.delete(named.keys().next().value!);
      named.set(name, (track = new Track()));
    }
    const keep = this.keep_all ? Infinity : LIMITS.history[kind];
    if (this.recalls) track.insert(message.t, value, keep);
    else track.push(message.t, value, keep);
    this.newest = Math.max(this.newest, message.t);
    if (kind !== "mission") this.oldest = Math.min(this.oldest, message.t);
    this.changed.add(kind);
    this.notify();
  }

  private place(id: string): number {
    const known = this.places.get(id);
    if (known !== undefined) return known;
    this.places.set(id, this.ids.length);
    return this.ids.push(id) - 1;
  }

  private notify(): void {
    ++this.version;
    if (this.scheduled) return;
    this.scheduled = true;
    this.later(() => {
      const changed = this.changed;
      this.changed = new Set();
      this.scheduled = false;
      for (const listener of this.listeners) listener(changed);
    });
  }
}

function split(key: string): { kind: string; name: string } {
  const slash = key.indexOf("/");
  return slash < 0 ? { kind: key, name: "" } : { kind: key.slice(0, slash), name: key.slice(slash + 1) };
}
