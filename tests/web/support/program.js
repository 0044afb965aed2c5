// SPDX-License-Identifier: Apache-2.0
// The other programs under test, as a user runs them: arguments, lines, exit code. A run ends with the test
// program at the latest.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { dirname, join } from "node:path";
import { until, watchdog_ms } from "./watchdog.js";

const alive = new Set();
process.on("exit", () => alive.forEach((child) => child.kill("SIGKILL")));

// The demo robot stops by itself where a busy machine keeps it from running for half a second. Tests are
// about other stops, so theirs bears more.
const busy_machine = ["--stop-service-timeout", "8 s"];

export class program {
  // `rowe ARGUMENTS...`, or another program of the same folder.
  static rowe(...args) {
    return new program(process.env.ROWE_BIN, args.includes("--demo") ? [...args, ...busy_machine] : args);
  }
  static beside_rowe(name, ...args) {
    return new program(join(dirname(process.env.ROWE_BIN), name), args);
  }

  constructor(file, args) {
    const child = spawn(file, args, { stdio: ["ignore", "pipe", "pipe"] });
    this.child = child;
    this.stdout = "";
    this.stderr = "";
    child.stdout.on("data", (words) => (this.stdout += words));
    child.stderr.on("data", (words) => (this.stderr += words));
    child.on("error", (error) => (this.stderr += error));
    alive.add(child);
    this.closed = once(child, "close").then(([code]) => {
      alive.delete(child);
      return code;
    });
  }

  lines() {
    return this.stdout.split("\n").slice(0, -1);
  }

  // Waits for a line of its output that matches; returns the match.
  line(pattern) {
    return until(`a line like ${pattern} of ${this.child.spawnargs.join(" ")}: ${this.stderr}`, () => {
      const found = this.lines().map((line) => line.match(pattern)).find((match) => match);
      if (!found && this.child.exitCode !== null) throw new Error(`it ended: ${this.stdout}${this.stderr}`);
      return found;
    });
  }

  // Waits for its end, after a signal where one is named; returns the exit code.
  async end(signal) {
    if (signal && this.child.exitCode === null) this.child.kill(signal);
    const bark = setTimeout(() => this.child.kill("SIGKILL"), watchdog_ms);
    const code = await this.closed;
    clearTimeout(bark);
    return code;
  }
}

// What attempt(TIME) resolves with, which runs something with `--timeout TIME` that passes in vain: with more
// of it until it gets so far as to be connected.
export async function until_connected(attempt) {
  for (let time_ms = 200; ; time_ms *= 4) {
    const ended = await attempt(`${time_ms}ms`);
    if (ended.code !== 3 || time_ms > watchdog_ms) return ended;
  }
}

// Runs `rowe ARGUMENTS...` to its end. Calls are given time unless they say how much.
export async function rowe(...args) {
  const patient = args[0] === "call" && !args.includes("--timeout") ? ["--timeout", "30s"] : [];
  const run = program.rowe(...args, ...patient);
  const code = await run.end();
  return { code, stdout: run.stdout, stderr: run.stderr };
}
