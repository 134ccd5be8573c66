// SPDX-License-Identifier: BSD-3-Clause
/** The mission so far as one file, to hand over: this page, with everything that it knows in it. */
import type { App } from "./app";
import { base64_of_cloud } from "./cloud";
import type { Kind, Mark, Mission, Poses, Status } from "./schema";
import { POSE_ROW } from "./schema";
import { MISSION_ELEMENT } from "./sources/inlined";
import type { Store } from "./store";

/** The value as a program sends it, so that the same page reads it again. Most are kept as they came. */
const ENCODERS: { [K in Kind]?: (value: never, store: Store) => unknown } = {
  mission: (m: Mission) => ({ ...m, mode: "report" }),
  poses: (p: Poses, store: Store) => ({
    ...p,
    rows: undefined,
    submaps: Object.fromEntries(rows_of_submaps(p, store)),
  }),
  status: (s: Status) => ({
    ...s.numbers.get(""),
    ...s,
    numbers: undefined,
    workers: s.workers.map((w) => ({ ...s.numbers.get(`workers: ${w.name}`), ...w })),
    robots: s.robots.map((r) => ({ ...s.numbers.get(r.name), ...r })),
  }),
};

function rows_of_submaps(poses: Poses, store: Store): [string, (number | null)[]][] {
  const out: [string, (number | null)[]][] = [];
  for (let place = 0; place * POSE_ROW < poses.rows.length; ++place) {
    const row = Array.from(poses.rows.subarray(place * POSE_ROW, (place + 1) * POSE_ROW));
    if (Number.isFinite(row[0])) out.push([store.id_at(place), row.map((x) => (Number.isFinite(x) ? x : null))]);
  }
  return out;
}

/** Throws an Error when the server does not give its page. */
export async function saved_page(app: App): Promise<string> {
  const answer = await fetch("/", { cache: "no-store" });
  if (!answer.ok) throw new Error(`The server answers ${answer.status}.`);
  const [before, after] = (await answer.text()).split(slot(""));
  if (after === undefined) throw new Error("The server's page has no place for a mission.");
  const messages: unknown[] = [];
  for (const { key, kind, t, value } of app.store.everything()) {
    const said = value === null ? null : (ENCODERS[kind]?.(value as never, app.store) ?? value);
    messages.push({ key, t, value: kind === "mark" && said !== null ? await with_photo(said as Mark) : said });
  }
  const clouds = Object.fromEntries([...app.clouds].map(([name, cloud]) => [name, base64_of_cloud(cloud)]));
  return before + slot(JSON.stringify({ messages, clouds }).replaceAll("<", "\\u003c")) + after;
}

/** Its photo is in it; one that has gone meanwhile is left out. */
async function with_photo(mark: Mark): Promise<Mark> {
  if (mark.photo === null || mark.photo.startsWith("data:")) return mark;
  const answer = await fetch(mark.photo);
  if (!answer.ok) return { ...mark, photo: null };
  const photo = await answer.blob();
  return {
    ...mark,
    photo: await new Promise<string>((resolve, reject) => {
      const reader = Object.assign(new FileReader(), {
        onload: () => resolve(String(reader.result)),
        onerror: () => reject(reader.error!),
      });
      reader.readAsDataURL(photo);
    }),
  };
}

/** Made of parts: the page itself has this text exactly once. */
const slot = (text: string): string => `<script type="application/json" id="${MISSION_ELEMENT}">${text}</` + "script>";

export async function save_file(app: App): Promise<void> {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([await saved_page(app)], { type: "text/html" }));
  link.download = `${(app.store.get("mission")?.name ?? "mission").replace(/[^A-Za-z0-9_-]+/g, "_")}_${Math.round(app.now())}s.html`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
