// SPDX-License-Identifier: BSD-3-Clause
/** The time before this page was opened, as the program remembers it; and times of which nothing is known. */
import { moment } from "./format";
import { LIMITS, TIMES } from "./limits";
import type { Message } from "./schema";
import type { Store } from "./store";

/** Takes what the program remembers. The page does without it when there is no answer. */
export async function recall(store: Store): Promise<void> {
  try {
    const answer = await fetch("/api/history", { signal: AbortSignal.timeout(TIMES.history_ms), cache: "no-store" });
    if (!answer.ok) return;
    const { messages } = (await answer.json()) as { messages?: unknown };
    if (Array.isArray(messages)) store.recall(messages as Message[]);
  } catch {
    // asked again with the next connection
  }
}

/** Says that nothing is known of the time that is shown, or of the time before all others; "" where something is. */
export function unknown_at(store: Store, t: number | null): string {
  const known = store.get("history");
  if (!known || known.first_s === null) return "";
  const gap = t === null ? undefined : known.gaps.find(([from, until]) => t > from + 1 && t < until - 1);
  if (gap) return `nothing from ${moment(gap[0])} to ${moment(gap[1])}`;
  return known.first_s > LIMITS.unknown_s ? `nothing before ${moment(known.first_s)}` : "";
}

/** Times of which nothing is known, to be drawn. */
export const gaps_of = (store: Store): [number, number][] => store.get("history")?.gaps ?? [];
