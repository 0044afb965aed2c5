// SPDX-License-Identifier: Apache-2.0
// The program under test, `rowe serve`, with its demo robot or as a test asks for it, on a port of its own;
// and how to hurt it.

import { readdirSync, readFileSync } from "node:fs";
import { free_port } from "./port.js";
import { program, rowe } from "./program.js";
import { until } from "./watchdog.js";

export class robot {
  // Starts the program and resolves when it answers.
  static async start(...how) {
    const made = new robot();
    made.how = how.length > 0 ? how : ["--demo"];
    made.port = await free_port();
    made.origin = `http://127.0.0.1:${made.port}`;
    made.url = `ws://127.0.0.1:${made.port}/`;
    await made.restart();
    return made;
  }

  async restart() {
    const running = program.rowe("serve", ...this.how, "--port", String(this.port));
    this.running = running;
    await until("the robot answers", async () => {
      const { exitCode } = running.child;
      if (exitCode !== null) throw new Error(`the robot ended with ${exitCode}: ${running.stderr}`);
      try {
        return (await fetch(`${this.origin}/healthz`)).ok;
      } catch {
        return false;
      }
    });
  }

  get child() {
    return this.running.child;
  }

  // Lets it drive again where it stopped by itself, as a busy machine makes it.
  async let_run() {
    const { code, stdout } = await rowe("reset", this.url);
    if (code !== 0) await rowe("reset", this.url, stdout.trim().split(" ").pop());
  }

  // Stands still as a machine does whose kernel hangs: the sockets stay, nothing moves. Resolves when that is
  // so: on a busy machine threads run on for a while after the signal.
  async pause() {
    this.child.kill("SIGSTOP");
    const threads = `/proc/${this.child.pid}/task`;
    const stands = (thread) => / T [^)]*$/.test(readFileSync(`${threads}/${thread}/stat`, "latin1"));
    await until("the robot stands still", () => readdirSync(threads).every(stands));
  }

  resume() {
    this.child.kill("SIGCONT");
  }

  // Dies without a word.
  kill() {
    return this.running.end("SIGKILL");
  }
}
