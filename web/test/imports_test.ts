// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import { test } from "node:test";

const root = resolve("src"); // run.mjs is started in web/

/** By file: the files that it imports, types too. */
function imports(): Map<string, string[]> {
  const files = readdirSync(root, { recursive: true, encoding: "utf8" }).filter((name) => name.endsWith(".ts"));
  return new Map(
    files.map((name) => [
      name,
      [...readFileSync(join(root, name), "utf8").matchAll(/ from "(\.[^"]+)"/g)].map(
        ([, path]) => `${relative(root, resolve(root, dirname(name), path))}.ts`,
      ),
    ]),
  );
}

test("no file imports itself by way of others", () => {
  const all = imports();
  assert.ok(all.size > 40);
  const done = new Set<string>();
  const visit = (file: string, way: string[]): void => {
    assert.ok(!way.includes(file), `a circle: ${[...way.slice(way.indexOf(file)), file].join(" > ")}`);
    if (done.has(file)) return;
    for (const next of all.get(file) ?? []) visit(next, [...way, file]);
    done.add(file);
  };
  for (const file of all.keys()) visit(file, []);
});
