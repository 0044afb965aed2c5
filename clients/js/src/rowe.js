// SPDX-License-Identifier: Apache-2.0
// A client of a robot that speaks rowe: one connection that comes back with all that was asked of it, the
// stop, and control of what is driven. It runs in browsers, as it is, and in Node.

import { drive } from "./drive.js";
import { stop } from "./stop.js";
import { emitter, robot_error, wire } from "./wire.js";

export { robot_error };

const open_ms_max = 10000;

// A socket cannot have headers in a browser, so the token is an offered subprotocol. The robot chooses the
// other one.
const offered = (token) => (token ? ["rowe.v1", `rowe.token.${token}`] : []);

function options_of({ WebSocket = globalThis.WebSocket, token, decode }) {
  if (!WebSocket) {
    throw new robot_error("no_websocket", "this Node has no WebSocket (22 has): `npm install ws`, and " +
      "connect(url, { WebSocket }) with that of `import { WebSocket } from \"ws\"`");
  }
  return { WebSocket, decode, subprotocols: () => offered(typeof token === "function" ? token() : token) };
}

// Where places are kept for the stop, also behind a proxy's prefix.
function kept_url(url) {
  const place = new URL("rowe/stop", url);
  place.search = new URL(url).search;
  return place.href;
}

class robot extends wire {
  #drives = new Set();
  #unlisten = new AbortController();
  #apart = null;

  constructor(url, options) {
    const sockets = options_of(options);
    super(url, sockets);
    this.name = options.name ?? `js-${Math.random().toString(36).slice(2, 6)}`;
    const { reserved = Boolean(globalThis.document) } = options;
    this.stop = new stop(this, this.name, () => new wire(kept_url(url), sockets), reserved);
    if (globalThis.document) this.#listen();
  }

  // Resolves when the connection stands, now or later.
  opened({ timeout_ms = open_ms_max } = {}) {
    const { link } = this;
    return new Promise((done, failed) => {
      const fail = (code, words) => failed(new robot_error(code, `${link.url}: ${words}`));
      if (this.state === "closed") return fail("closed", "closed here");
      if (this.state === "open") return done(this);
      const timer = setTimeout(() => {
        fail("timed_out", `not open within ${timeout_ms} ms (${this.state}, attempt ${link.attempt + 1})`);
        end();
      }, timeout_ms);
      const offs = ["open", "closed"].map((name) => this.on(name, () => {
        if (name === "open") done(this);
        else if (this.state === "closed") fail("closed", "closed here");
        else return;
        end();
      }));
      const end = () => {
        clearTimeout(timer);
        offs.forEach((off) => off());
      };
    });
  }

  // What is large gets a connection of its own: on this one the answer to a stop would wait behind it.
  subscribe(topic, fn, options = {}) {
    if (!options.apart) return super.subscribe(topic, fn, options);
    this.#apart ??= this.#make_apart();
    const made = this.#apart.subscribe(topic, fn, options);
    this.#apart.link.turn(true);
    return made;
  }

  // It never takes a place that the first one needs: it is there while that one is, and somebody wants it.
  #make_apart() {
    const may = () => this.state === "open" && this.#apart?.wanted === true;
    const made = new wire(this.link.url, { ...this.link.options, may });
    made.on("status", (what) => this.emit("status", what));
    for (const name of ["open", "closed"]) this.on(name, () => made.link.turn(true));
    if (this.state === "closed") made.close();
    return made;
  }

  drive(topic, options) {
    const made = new drive(this, topic, options);
    this.#drives.add(made);
    made.on("closed", () => this.#drives.delete(made));
    return made;
  }

  close() {
    this.#unlisten.abort();
    this.halt();
    super.close();
    this.#apart?.close();
    this.stop.close();
  }

  // All that this client drives stands still.
  halt() { for (const one of this.#drives) one.halt(); }

  // Who does not see the page must not drive by it, nor guard.
  #listen() {
    const { signal } = this.#unlisten;
    const listen = (to, what, fn) => what.forEach((name) => to.addEventListener(name, fn, { signal }));
    const hide = () => {
      for (const one of this.#drives) one.release().catch(() => {});
      this.stop.let_go().catch(() => {});
    };
    const hurry = () => this.link.turn(true);
    listen(globalThis, ["blur"], () => this.halt());
    listen(globalThis, ["pagehide"], hide);
    listen(globalThis, ["online", "pageshow", "focus"], hurry);
    listen(document, ["visibilitychange"], () => (document.hidden ? hide() : hurry()));
  }
}

// Begins to connect. Without a URL: to where this page came from.
export const connect = (url = globalThis.location?.origin, options = {}) =>
  new robot(new URL(String(url).replace(/^http/, "ws")).href, options);
