// SPDX-License-Identifier: BSD-3-Clause
// tutti's own programs, started by a test of the page and ended with it.
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

export class Started {
  /** `rate`: times as fast as the robots walk; statuses come by the wall clock. */
  constructor(tutti, mission, rate) {
    Object.assign(this, {
      tutti,
      common: [mission, "--rate", String(rate)],
      work: mkdtempSync(join(tmpdir(), "tutti-web-")),
      programs: [],
    });
  }
  start(words, stderr) {
    const program = spawn(this.tutti, words, { stdio: ["ignore", "pipe", stderr] });
    this.programs.push(program);
    return program;
  }
  /** What a command prints. */
  run(...words) {
    return execFileSync(this.tutti, words, { encoding: "utf8" });
  }
  /** The server, where robots reach it and where its page is, as it reports itself. */
  async server(...more) {
    const program = this.start(
      ["server", ...this.common, ...more, "--state", join(this.work, "server"), "--view", "0"],
      "pipe",
    );
    let bus, page;
    await new Promise((resolve, reject) => {
      for (const stream of [program.stdout, program.stderr])
        createInterface({ input: stream }).on("line", (line) => {
          bus ??= line.match(/--bus ((?:nats|tls):\S+)/)?.[1];
          page ??= line.match(/the page is at (\S+)/)?.[1];
          if (bus && page) resolve();
          else console.log(`    ${line}`);
        });
      program.on("exit", () => reject(new Error("the server ended")));
    });
    return { program, bus, page };
  }
  robot(name, bus, ...more) {
    const program = this.start(
      [
        "robot",
        ...this.common,
        ...more,
        "--name",
        name,
        "--bus",
        bus,
        "--state",
        join(this.work, name),
        "--session",
        "0",
      ],
      "inherit",
    );
    program.stdout.resume();
    return program;
  }
  async end() {
    for (const program of this.programs) {
      program.kill("SIGCONT");
      program.kill("SIGTERM");
    }
    await Promise.all(
      this.programs.map(
        (p) => p.exitCode !== null || p.signalCode !== null || new Promise((resolve) => p.on("exit", resolve)),
      ),
    );
    rmSync(this.work, { recursive: true });
  }
}

/** Plays with a browser, ends all, and ends this program with 1 if anything is not as it should be. */
export async function play_with(browser, started, play) {
  let failed = false;
  try {
    await play(browser);
  } catch (error) {
    failed = true;
    console.log(`FAIL ${error.stack ?? error}`);
  }
  await browser.close();
  await started.end();
  console.log(failed ? "failed" : "all is as it should be");
  process.exit(failed ? 1 : 0);
}
