// SPDX-License-Identifier: BSD-3-Clause
// Bundles test/*_test.ts with esbuild (which Vite brings) and runs them with Node's own test runner. No browser.
import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = mkdtempSync(join(tmpdir(), "tutti-web-test-"));
const files = readdirSync(here).filter((name) => name.endsWith("_test.ts"));
if (files.length === 0) throw new Error(`no tests in ${here}`);
await build({
  entryPoints: files.map((name) => join(here, name)),
  bundle: true,
  platform: "node",
  format: "esm",
  outdir: out,
  outExtension: { ".js": ".mjs" },
  logLevel: "warning",
});
const run = spawnSync(
  process.execPath,
  ["--expose-gc", "--test", ...files.map((name) => join(out, name.replace(/\.ts$/, ".mjs")))],
  { stdio: "inherit" },
);
rmSync(out, { recursive: true });
process.exit(run.status ?? 1);
