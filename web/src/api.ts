// SPDX-License-Identifier: BSD-3-Clause
/** The page's requests to the server beside events. */
import { decode_me, decode_registration, decode_why } from "./decode";
import { TIMES } from "./limits";
import type { Me, Pose, Registration, SubmapId, Vec3, Why, Wish } from "./schema";

/** Throws an Error with the server's sentence. */
async function ask(path: string, body?: unknown, at_most_ms: number = TIMES.answer_ms): Promise<unknown> {
  const request: RequestInit = { signal: AbortSignal.timeout(at_most_ms) };
  if (body !== undefined) {
    request.method = "POST";
    request.headers = { "Content-Type": "application/json", "X-Tutti": "1" };
    request.body = JSON.stringify(body);
  }
  let answer: Response;
  try {
    answer = await fetch(path, request);
  } catch {
    throw new Error("The server does not answer.");
  }
  const json = (await answer.json().catch(() => null)) as { error?: unknown } | null;
  if (!answer.ok)
    throw new Error(typeof json?.error === "string" ? json.error : `The server answers ${answer.status}.`);
  return json ?? {};
}

export const api = {
  me: async (): Promise<Me> => decode_me(await ask("/api/me"), "me"),
  login: (nonce: string, key: string, signature: string) => ask("/api/login", { nonce, key, signature }),
  logout: () => ask("/api/logout", {}),
  decide: (closure: string, wish: Wish, by: string) => ask("/api/decide", { closure, wish, by }),
  register: async (from: SubmapId, to: SubmapId, T_from_to: Pose | null): Promise<Registration> =>
    decode_registration(await ask("/api/register", { from, to, T_from_to }), "registration"),
  /** The value of `poses` that the map would have with what was registered; takes as long as an update of the map. */
  change: async (look: number): Promise<unknown> =>
    ((await ask("/api/change", { look }, TIMES.change_ms)) as { poses?: unknown }).poses,
  keep_closure: async (from: SubmapId, to: SubmapId, T_from_to: Pose, by: string): Promise<string> =>
    String(((await ask("/api/closure", { from, to, T_from_to, by })) as { name?: unknown }).name ?? ""),
  mark: (submap: SubmapId, at: Vec3, text: string, photo: string | null, by: string) =>
    ask("/api/mark", { submap, at, text, photo, by }),
  unmark: (id: string) => ask("/api/unmark", { id }),
  acknowledge: (alerts: string[], undo: boolean, by: string) => ask("/api/acknowledge", { alerts, undo, by }),
  hold: (what: string, by: string) => ask("/api/hold", { what, by }),
  why: async (from: string, to: string): Promise<Why> =>
    decode_why(await ask(`/api/why?from=${encodeURIComponent(from)}&to=${encodeURIComponent(to)}`), "why"),
};

export const kNobody: Me = {
  login: false,
  name: "",
  role: null,
  mission: "",
  may_decide: false,
  nonce: "",
  offers: [],
};
