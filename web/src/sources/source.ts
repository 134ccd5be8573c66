// SPDX-License-Identifier: BSD-3-Clause
/** Where messages come from: a running server, or the mission inside the page. */
import type { Message, Submap } from "../schema";

export interface Callbacks {
  /** Every message, in order. */
  message: (message: Message) => void;
  /** All before is void. */
  reset: () => void;
  /** All that was known has been sent: these keys; null: what was new since the last message, and all others stay. */
  ready: (keys: ReadonlySet<string> | null) => void;
  link: (link: LinkState) => void;
}

export interface Source {
  readonly mode: "live" | "report";
  start(on: Callbacks): void;
  /** `submap`: whose cloud it is; null for the survey. */
  cloud(name: string, submap: Submap | null): Promise<ArrayBuffer>;
}

export interface LinkState {
  /** connecting: never heard yet; here: signs of life come; silent: they stopped; locked: it is there, and wants a credential. */
  state: "connecting" | "here" | "silent" | "locked";
  /** performance.now() of the last sign of life. */
  heard_ms: number;
  why: string;
}
