// SPDX-License-Identifier: BSD-3-Clause
// What tests in Chromium share: the built page, a browser, a fake server for each test, and what runs them one after another.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { Browser } from "./chromium.mjs";
import { FakeMission } from "./fake_mission.mjs";
import { FakeServer } from "./fake_server.mjs";

export const page_text = readFileSync(new URL("../dist/index.html", import.meta.url), "utf8");
export const work = mkdtempSync(join(tmpdir(), "tutti-web-"));
export let browser = await Browser.launch();
export const kPoints = 1200; // of a submap: enough to see a picture
export const small = (options = {}) => new FakeMission({ points: kPoints, ...options });
export const fleet = (n) => Array.from({ length: n }, (_, i) => `r${String(i).padStart(2, "0")}`);
const tests = [];
export const test = (name, run) => tests.push({ name, run });

/** A fake server that lives as long as `run`. */
export async function served(mission, run, options, size) {
  const server = await new FakeServer(mission, options).start();
  const page = await browser.open(`http://127.0.0.1:${server.port}/`, size);
  try {
    if (server.me.role !== null || !server.me.login)
      await page.until("all submaps are placed", (n) => tutti.app.world.placed.size >= n, mission.submaps.length);
    await run(page, server, mission);
    assert.deepEqual(page.errors, [], "errors on the page");
  } finally {
    await page.close();
    await server.stop();
  }
}

/** All tests, or those whose names have `only` in them. */
export async function run_all(only) {
  let failed = 0;
  for (const { name, run } of tests) {
    if (only && !name.includes(only)) continue;
    const start = Date.now();
    try {
      await run().catch(async (error) => {
        // A busy machine draws late: what fails twice is wrong.
        console.log(`     ${browser.lives ? (error.stack ?? error) : "Chromium itself ended"} in: ${name}; once more`);
        if (!browser.lives) browser = await Browser.launch();
        await run();
      });
      console.log(`ok   ${name} (${Date.now() - start} ms)`);
    } catch (error) {
      ++failed;
      console.log(`FAIL ${name}: ${error.stack ?? error}`);
    }
  }
  await browser.close();
  rmSync(work, { recursive: true });
  console.log(failed ? `${failed} of ${tests.length} failed` : "all is as it should be");
  process.exit(failed ? 1 : 0);
}
