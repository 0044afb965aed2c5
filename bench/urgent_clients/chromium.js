// SPDX-License-Identifier: Apache-2.0
// Chromium as its users have it, with nothing attached to it: a tool that drives a browser is told of every
// frame, and made each message ten times as slow. So the page asks for its orders.

import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { flags, program } from "../../tests/web/support/browser.js";

const file = (name) => readFileSync(new URL(name, import.meta.url));
const html = `<!doctype html><title>reader</title><link rel="icon" href="data:,">
<script type="module" src="page.js"></script>`;
// Without these two a page's clock has steps of 100 us, with them of 5.
const isolated = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};

export class chromium {
  #orders = null;  // what the page is to read next, once we know
  #order = null;
  #answer = null;
  #answers = {
    "GET /": () => ["text/html", html],
    "GET /page.js": () => ["text/javascript", file("page.js")],
    "GET /reader.js": () => ["text/javascript", file("reader.js")],
    "GET /clock": () => ["text/plain", String(Number(process.hrtime.bigint()) / 1e6)],
    "GET /run": async () => {
      const how = await this.#orders;
      this.#wait();
      return ["application/json", JSON.stringify(how)];
    },
    "POST /result": (said) => (this.#answer.resolve(JSON.parse(said)), ["text/plain", ""]),
    "POST /fault": (said) => (this.#answer.reject(new Error(said)), ["text/plain", ""]),
  };

  static version() {
    const said = execFileSync(program, ["--version"], { stdio: ["ignore", "pipe", "ignore"] });
    return String(said).split(" ").slice(0, 2).join(" ");
  }

  // Listens; the browser starts with start().
  static async listen() {
    const made = new chromium();
    made.#wait();
    made.server = createServer((request, response) => made.#serve(request, response));
    made.server.listen(0, "127.0.0.1");
    await once(made.server, "listening");
    made.origin = `http://127.0.0.1:${made.server.address().port}`;
    return made;
  }

  start() {
    this.profile = mkdtempSync(join(tmpdir(), "urgent-clients-"));
    const more = ["--headless", "--disable-dev-shm-usage", `--user-data-dir=${this.profile}`, this.origin];
    // A group of its own, which ends as one: its processes write to the profile until the last moment.
    this.child = spawn(program, [...flags, ...more], { stdio: "ignore", detached: true });
    process.on("exit", () => this.stop());
  }

  // What read() of ./reader.js says of it in a new page.
  read(how) {
    return new Promise((resolve, reject) => {
      this.#answer = { resolve, reject };
      this.#order(how);
    });
  }

  stop() {
    if (!this.child) return;
    try {
      process.kill(-this.child.pid, "SIGKILL");
    } catch {
      // it has gone
    }
    this.child = null;
    this.server.close();
    this.server.closeAllConnections();
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 10 });
  }

  #wait() {
    this.#orders = new Promise((resolve) => (this.#order = resolve));
  }

  async #serve(request, response) {
    let said = "";
    for await (const part of request) said += part;
    const answer = this.#answers[`${request.method} ${request.url}`];
    const [type, body] = answer ? await answer(said) : ["text/plain", ""];
    const headers = { "Content-Type": type, "Cache-Control": "no-store", ...isolated };
    response.writeHead(answer ? 200 : 404, headers);
    response.end(body);
  }
}
