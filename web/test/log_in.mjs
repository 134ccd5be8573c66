// SPDX-License-Identifier: BSD-3-Clause
// A server with `--pki`, and the page in a headless Chromium as an operator, a viewer and a stranger see it.
// usage: log_in.mjs TUTTI MISSION. Ends with 1 if anything is not as it should be.
import assert from "node:assert/strict";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Browser } from "./chromium.mjs";
import { play_with, Started } from "./started.mjs";

const [, , tutti, mission] = process.argv;
const kPatience_ms = 120_000; // of a busy machine
const started = new Started(tutti, mission, 8);
const pki = join(started.work, "pki");
const step = (what) => console.log(`ok   ${what}`);
const asks = () => document.querySelector('[aria-label="Credential file"]') !== null;
const sees = () => tutti.app.world.placed.size > 0 && /Live/.test(document.querySelector(".badge").textContent);

async function log_in(page, file) {
  await page.until("a login is asked for", asks, undefined, kPatience_ms);
  await (await page.page.$('[aria-label="Credential file"]')).uploadFile(file);
}

async function play(browser) {
  started.run("pki", "init", "--mission", "page", "--pki", pki);
  const add = (role, name, ...more) => started.run("pki", `add-${role}`, name, "--pki", pki, ...more).trim(); // its file
  const files = {
    eva: add("operator", "eva"),
    vera: add("viewer", "vera"),
    alpha: add("robot", "alpha", "--number", "0"),
  };
  const { program: server, bus, page: url } = await started.server("--pki", pki, "--mission", "page");
  assert.match(url, /^https:/);
  started.robot("alpha", bus, "--credentials", files.alpha, "--mission", "page");

  const stranger = await browser.open(url);
  await stranger.until("a login is asked for", asks, undefined, kPatience_ms);
  assert.deepEqual(await stranger.texts(".badge"), ["Not logged in"]);
  await log_in(stranger, files.alpha);
  await stranger.until("it says why a robot's credential is none", () =>
    /credential of a robot/.test(document.querySelector("#notices").textContent),
  );
  assert.equal(await stranger.evaluate(() => tutti.app.store.get("mission")), null, "a stranger sees nothing");
  step("who has no credential is asked for one, and sees nothing");

  const eva = await browser.open(url);
  await log_in(eva, files.eva);
  await eva.until("the operator sees the map", sees, undefined, kPatience_ms);
  assert.equal((await eva.texts(".person b"))[0], "eva");
  await eva.press("Marks");
  await eva.until("she may mark", () =>
    [...document.querySelectorAll("button")].some((b) => b.textContent === "New mark"),
  );
  await eva.reload();
  await eva.until("she is known after a reload", sees, undefined, kPatience_ms);
  assert.equal((await eva.texts(".person b"))[0], "eva");
  step("an operator logs in, may decide, and is known after a reload");

  const vera = await browser.open(url);
  await log_in(vera, files.vera);
  await vera.until("the viewer sees the map", sees, undefined, kPatience_ms);
  assert.equal((await vera.texts(".person"))[0].startsWith("vera viewer"), true);
  assert.deepEqual(
    (await vera.texts(".tabs button")).filter((t) => /By hand|Marks/.test(t)),
    [],
  );
  step("a viewer logs in, and may decide nothing");

  const kept = join(started.work, "kept.cred"); // somebody has a copy
  copyFileSync(files.vera, kept);
  started.run("pki", "revoke", "vera", "--pki", pki);
  await vera.until("who is revoked is asked again", asks, undefined, kPatience_ms);
  await log_in(vera, kept);
  await vera.until("and refused", () => /revoked/.test(document.querySelector("#notices").textContent));
  step("a revoked viewer is out");

  const nora = await browser.open(url);
  const noras = add("viewer", "nora");
  await log_in(nora, noras);
  await nora.until("another viewer sees the map", sees, undefined, kPatience_ms);
  const users = join(pki, "users"); // a certificate lasts a day at least, so its end is put back
  writeFileSync(
    users,
    readFileSync(users, "utf8").replace(/^(viewer nora .* valid) .*$/m, "$1 2026-01-01 00:00:00 UTC"),
  );
  await nora.until("whose certificate has expired is asked again", asks, undefined, kPatience_ms);
  await log_in(nora, noras);
  await nora.until("and refused, with the reason", () =>
    /expired/.test(document.querySelector("#notices").textContent),
  );
  step("a viewer whose certificate has expired is out, and told so");

  const { pid } = JSON.parse(readFileSync(join(started.work, "server", "page", "status.json"), "utf8"));
  process.kill(pid, "SIGKILL");
  await eva.until("the operator is asked again", asks, undefined, kPatience_ms);
  await log_in(eva, files.eva);
  await eva.until("and sees the map again", sees, undefined, kPatience_ms);
  assert.equal(server.exitCode, null);
  step("the page is killed: it is there again, and the operator logs in again");

  await eva.press("Log out");
  await eva.until("who has logged out is asked again", asks);
  step("who has logged out is out");
  for (const page of [stranger, eva, vera, nora]) assert.deepEqual(page.errors, [], "errors on the page");
}

await play_with(await Browser.launch(undefined, { acceptInsecureCerts: true }), started, play); // the authority is the mission's own
